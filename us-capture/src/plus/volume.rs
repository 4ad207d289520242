//! The settings of `VolumeReconstruction`.

use roxmltree::Node;

use super::PlusError;
use super::xml::{bad, finite, missing, numbers};

/// How PLUS builds a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct PlusVolume {
    /// Voxel size along x, y, z (mm).
    pub spacing_mm: [f64; 3],
    /// System of the images; `Image` when the file does not say.
    pub image: String,
    /// System of the volume; `Reference` when the file does not say.
    pub reference: String,
    /// Whether a pixel goes to its eight neighbours (LINEAR) or to the nearest voxel.
    pub linear: bool,
    /// What many pixels in one voxel become.
    pub compounding: PlusCompounding,
    /// The part of the images that is used, in pixels; all of them when absent.
    pub clip: Option<Rectangle>,
    /// A fan, outside which nothing is used.
    pub fan: Option<Fan>,
    /// Sticks that fill holes, when holes are to be filled.
    pub holes: Option<HoleStick>,
}

/// What many pixels in one voxel become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlusCompounding {
    /// Their mean.
    Mean,
    /// The brightest.
    Maximum,
    /// The last one.
    Latest,
}

/// A part of an image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    /// First column and row.
    pub origin: [usize; 2],
    /// Columns and rows.
    pub size: [usize; 2],
}

/// The fan of a curved or sector probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fan {
    /// Its apex (column, row).
    pub origin_px: [f64; 2],
    /// First and last angle from straight down, positive toward greater columns (rad).
    pub angles_rad: [f64; 2],
    /// First and last distance from the apex, when the file says.
    pub radius_px: Option<FanArc>,
}

/// Between two distances from a fan's apex, in rows' pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FanArc {
    /// The transducer's face.
    pub start: f64,
    /// The deepest echo.
    pub stop: f64,
}

/// Hole filling by sticks: a straight line of voxels through the hole that ends in seen voxels on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HoleStick {
    /// Most voxels of a stick, its ends included.
    pub longest: usize,
    /// How many of the shortest sticks are averaged.
    pub sticks: usize,
}

pub(super) fn parse(node: Node<'_, '_>) -> Result<PlusVolume, PlusError> {
    let name = |attribute, or: &str| node.attribute(attribute).unwrap_or(or).to_owned();
    Ok(PlusVolume {
        spacing_mm: spacing(node)?,
        image: name("ImageCoordinateFrame", "Image"),
        reference: name("ReferenceCoordinateFrame", "Reference"),
        linear: linear(node)?,
        compounding: compounding(node)?,
        clip: clip(node)?,
        fan: fan(node)?,
        holes: holes(node)?,
    })
}

fn spacing(node: Node<'_, '_>) -> Result<[f64; 3], PlusError> {
    let spacing = finite(node, "OutputSpacing", 3)?.ok_or_else(|| missing(node, "OutputSpacing"))?;
    match spacing.as_slice() {
        &[x, y, z] if [x, y, z].iter().all(|s| s.is_finite() && *s > 0.0) => Ok([x, y, z]),
        _ => Err(bad(node, "OutputSpacing", "a voxel has a positive size (mm)")),
    }
}

fn linear(node: Node<'_, '_>) -> Result<bool, PlusError> {
    match node.attribute("Interpolation") {
        Some("LINEAR") => Ok(true),
        None | Some("NEAREST_NEIGHBOR") => Ok(false),
        Some(_) => Err(bad(node, "Interpolation", "known are LINEAR and NEAREST_NEIGHBOR")),
    }
}

/// `CompoundingMode`; files before PLUS 2.4 say `Compounding="ON"` (or `"On"`) for the mean.
fn compounding(node: Node<'_, '_>) -> Result<PlusCompounding, PlusError> {
    let word = |name| node.attribute(name).map(str::to_ascii_uppercase);
    match (word("CompoundingMode").as_deref(), word("Compounding").as_deref()) {
        (Some("MEAN"), _) | (None, Some("ON")) => Ok(PlusCompounding::Mean),
        (Some("MAXIMUM"), _) => Ok(PlusCompounding::Maximum),
        (Some("LATEST"), _) | (None, Some("OFF") | None) => Ok(PlusCompounding::Latest),
        _ => Err(bad(node, "CompoundingMode", "known are MEAN, MAXIMUM and LATEST")),
    }
}

/// A part of the image. PLUS writes negative numbers for "all of it".
pub(super) fn clip(node: Node<'_, '_>) -> Result<Option<Rectangle>, PlusError> {
    let negative = |name| matches!(numbers::<i64>(node, name, 2), Ok(Some(n)) if n.iter().any(|x| *x < 0));
    if negative("ClipRectangleOrigin") || negative("ClipRectangleSize") {
        return Ok(None);
    }
    let origin = numbers::<usize>(node, "ClipRectangleOrigin", 2)?;
    let size = numbers::<usize>(node, "ClipRectangleSize", 2)?;
    match (origin.as_deref(), size.as_deref()) {
        (Some(&[x, y]), Some(&[width, height])) if width > 0 && height > 0 => {
            Ok(Some(Rectangle { origin: [x, y], size: [width, height] }))
        }
        (None, None) => Ok(None),
        (Some(_), Some(_)) => Err(bad(node, "ClipRectangleSize", "a rectangle has at least one pixel")),
        _ => Err(missing(node, "ClipRectangleOrigin and ClipRectangleSize together")),
    }
}

fn fan(node: Node<'_, '_>) -> Result<Option<Fan>, PlusError> {
    let angles = finite(node, "FanAnglesDeg", 2)?.or(finite(node, "FanAngles", 2)?);
    let origin = finite(node, "FanOriginPixel", 2)?.or(finite(node, "FanOrigin", 2)?);
    let (Some(&[first, last]), Some(&[x, y])) = (angles.as_deref(), origin.as_deref()) else {
        return Ok(None);
    };
    if !(first < last && first >= -90.0 && last <= 90.0) {
        // PLUS takes equal angles for "no fan".
        return if first >= last {
            Ok(None)
        } else {
            Err(bad(node, "FanAnglesDeg", "between -90 and 90 degrees"))
        };
    }
    let start = finite(node, "FanRadiusStartPixel", 1)?;
    let stop = finite(node, "FanRadiusStopPixel", 1)?.or(finite(node, "FanDepth", 1)?);
    let radius_px = match (start.as_deref(), stop.as_deref()) {
        (start, Some(&[stop])) => {
            Some(FanArc { start: start.and_then(|s| s.first()).copied().unwrap_or(0.0), stop })
        }
        _ => None,
    };
    Ok(Some(Fan { origin_px: [x, y], angles_rad: [first.to_radians(), last.to_radians()], radius_px }))
}

fn holes(node: Node<'_, '_>) -> Result<Option<HoleStick>, PlusError> {
    if node.attribute("FillHoles") != Some("ON") {
        return Ok(None);
    }
    let mut elements = node.descendants().filter(|n| n.has_tag_name("HoleFillingElement"));
    let element = elements
        .next()
        .ok_or_else(|| missing(node, "HoleFilling/HoleFillingElement for FillHoles=\"ON\""))?;
    if elements.next().is_some() {
        return Err(bad(element, "Type", "one HoleFillingElement is supported, there are more"));
    }
    if element.attribute("Type") != Some("STICK") {
        return Err(bad(element, "Type", "of PLUS's hole fillings STICK is supported"));
    }
    let whole = |name| -> Result<usize, PlusError> {
        let value = numbers::<usize>(element, name, 1)?.ok_or_else(|| missing(element, name))?;
        value.first().copied().filter(|n| *n > 0).ok_or_else(|| bad(element, name, "at least 1"))
    };
    Ok(Some(HoleStick { longest: whole("StickLengthLimit")?, sticks: whole("NumberOfSticksToUse")? }))
}
