//! The whole road: from B-scans that know where they were to the lumen and its stenoses.

mod warning;

use std::collections::{BTreeMap, BTreeSet};

use probepath_us_capture::PlacedBScan;
use serde::{Deserialize, Serialize};

pub use warning::ReconWarning;

use crate::centreline::Centreline;
use crate::surface::LumenSurface;
use crate::uncertainty::Shown;
use crate::vessel::{self, Fitted, Vessel};
use crate::{
    Contour, ImageLumen, LumenSettings, Mesh, NoLumen, ReconError, Section, Stenosis, measures, segment,
};

/// The lumen in 3D, with everything measured on it.
#[derive(Clone, Debug, PartialEq)]
pub struct LumenReconstruction {
    /// What each image gave, in their order.
    pub images: Vec<ImageLumen>,
    /// The vessels: the one followed first, then its branches.
    pub vessels: Vec<Vessel>,
    /// The first vessel's surface, as a grid.
    pub surface: LumenSurface,
    /// The curve along the first vessel's middle.
    pub centreline: Centreline,
    /// The first vessel's sections normal to it, every half millimetre.
    pub sections: Vec<Section>,
    /// The first vessel's narrowings, along it.
    pub stenoses: Vec<Stenosis>,
    /// How many images there were, and how many showed a lumen.
    pub counts: ImageCounts,
    /// What the reader should know.
    pub warnings: Vec<ReconWarning>,
}

/// How many images showed a lumen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageCounts {
    /// Images in all.
    pub images: usize,
    /// Those in which no lumen was seen.
    pub without_lumen: usize,
    /// Why, and how often.
    pub reasons: BTreeMap<String, usize>,
}

/// Reconstructs the lumen from images that cut the vessel roughly across: in any order, tilted, repeated, unevenly
/// spaced. They are looked at in the order of their numbers.
///
/// # Errors
/// When the settings make no sense, an image has no size or place, or too few images show a lumen.
pub fn reconstruct_lumen(
    images: &[PlacedBScan],
    settings: &LumenSettings,
) -> Result<LumenReconstruction, ReconError> {
    check_sweep(images, settings)?;
    reconstruct_from(images, segment_by_number(images, settings), settings)
}

/// The lumen of every image; the images are followed in the order of their numbers, whatever order they come in.
fn segment_by_number(images: &[PlacedBScan], settings: &LumenSettings) -> Vec<ImageLumen> {
    if images.is_sorted_by_key(|image| image.bscan.number) {
        return segment(images, settings);
    }
    let mut order: Vec<usize> = (0..images.len()).collect();
    order.sort_by_key(|&i| images[i].bscan.number);
    // Pixels are shared, not copied.
    let sorted: Vec<PlacedBScan> = order.iter().map(|&i| images[i].clone()).collect();
    let mut found: Vec<(usize, ImageLumen)> = order.into_iter().zip(segment(&sorted, settings)).collect();
    found.sort_by_key(|(i, _)| *i);
    found.into_iter().map(|(_, lumen)| lumen).collect()
}

/// Whether images and settings can be worked with: what every way to a reconstruction asks first.
///
/// # Errors
/// When the settings make no sense, there is no image, or one has no size or place.
pub fn check_sweep(images: &[PlacedBScan], settings: &LumenSettings) -> Result<(), ReconError> {
    settings.check()?;
    images.iter().try_for_each(check)?;
    if images.is_empty() { Err(ReconError::NoImages) } else { Ok(()) }
}

/// The same from what each image gave, whoever found it. The images say where the probe was, when, and how hard it
/// pressed; their pixels are not looked at. Without images (an empty slice) the intervals are those of the contours alone.
///
/// # Errors
/// When too few images show a lumen.
pub fn reconstruct_from(
    images: &[PlacedBScan],
    mut lumens: Vec<ImageLumen>,
    settings: &LumenSettings,
) -> Result<LumenReconstruction, ReconError> {
    let fitted = fitted(&mut lumens)?;
    let counts = counts(&lumens);
    let mut warnings = warnings(&fitted, &counts, settings);
    let vessel = fitted.vessel(0, settings).judged(&by_time(images, &lumens, 0), settings);
    warnings.extend(measures::warnings(&vessel.sections, settings.reference));
    let (vessels, more) = with_branches(vessel.clone(), images, &lumens, settings);
    Ok(LumenReconstruction {
        surface: vessel.surface,
        centreline: vessel.centreline,
        sections: vessel.sections,
        stenoses: vessel.stenoses,
        vessels,
        images: lumens,
        counts,
        warnings: warnings.into_iter().chain(more).collect(),
    })
}

impl LumenReconstruction {
    /// The surface of all vessels together: closed at the ends, every edge with two triangles, facing outward. Its
    /// points carry `area_mm2` (of the section they lie in), `radius_mm` (from the centreline) and `error_sd_mm` (across
    /// the border, from speckle, poses and the model of the wall); area and error are NaN where no image shows the lumen
    /// and the surface only bridges, as it does from a branch's first section into its parent.
    ///
    /// One vessel gives rings 0.4 mm apart of 64 points; branches are joined on a grid of 0.5 mm.
    pub fn closed_surface(&self) -> Mesh {
        vessel::closed_surface(&self.vessels)
    }
}

/// The first vessel and its branches. A branch of too few contours is left out, and said.
fn with_branches(
    first: Vessel,
    images: &[PlacedBScan],
    lumens: &[ImageLumen],
    settings: &LumenSettings,
) -> (Vec<Vessel>, Vec<ReconWarning>) {
    let numbers: BTreeSet<usize> =
        all(lumens).map(|(_, contour)| contour.vessel).filter(|&v| v != 0).collect();
    let (mut vessels, mut warnings) = (vec![first], Vec::new());
    for number in numbers {
        let contours: Vec<&Contour> = shown(lumens, number).into_iter().map(|(_, contour)| contour).collect();
        match Fitted::branch(&contours, &vessels) {
            Ok((fitted, parent)) => {
                let branch = fitted.vessel(number, settings).rooted(&vessels, parent);
                let branch = branch.judged(&by_time(images, lumens, number), settings);
                if branch.leaves.is_none() {
                    warnings.push(ReconWarning::NotJoined { vessel: number });
                }
                vessels.push(branch);
            }
            Err(why) => warnings.push(ReconWarning::NoBranch { vessel: number, why: why.to_string() }),
        }
    }
    (vessels, warnings)
}

/// Whether an image has a size and a place.
pub(crate) fn check(image: &PlacedBScan) -> Result<(), ReconError> {
    let number = image.bscan.number;
    let setting = &image.bscan.setting;
    let bad = |what| Err(ReconError::Image { number, what });
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if !positive(setting.spacing.x_m) || !positive(setting.spacing.y_m) {
        return bad("its pixel spacing");
    }
    if !positive(setting.depth_m) || !setting.focus_m.is_finite() || !setting.window_top_m.is_finite() {
        return bad("its depth, focus or window");
    }
    if !positive(setting.window_width_m) {
        return bad("the width of its window");
    }
    if image.world_from_image.is_finite() { Ok(()) } else { bad("its pose") }
}

/// The first vessel; contours far from it lose their place.
fn fitted(lumens: &mut [ImageLumen]) -> Result<Fitted, ReconError> {
    let shown = shown(lumens, 0);
    let contours: Vec<&Contour> = shown.iter().map(|(_, contour)| *contour).collect();
    let found = Fitted::to(&contours);
    if let Err(ReconError::TooFew { seen, needed, .. }) = found {
        return Err(too_few(lumens, seen, needed));
    }
    let (fitted, strays) = found?;
    let strays: Vec<(usize, f64)> = strays.into_iter().map(|(i, by)| (shown[i].0, by)).collect();
    for (image, by) in strays {
        lumens[image].lumen = Err(NoLumen::Jump { by_mm: by * 1e3 });
    }
    Ok(fitted)
}

/// Every contour, with its image's place among all.
fn all(lumens: &[ImageLumen]) -> impl Iterator<Item = (usize, &Contour)> {
    lumens.iter().enumerate().flat_map(|(i, image)| {
        image.lumen.as_ref().ok().into_iter().chain(&image.others).map(move |contour| (i, contour))
    })
}

/// The images in the order they were formed, each with its contour of one vessel. `lumens` go with `images`.
fn by_time<'a>(images: &'a [PlacedBScan], lumens: &'a [ImageLumen], vessel: usize) -> Vec<Shown<'a>> {
    let contour = |lumen: &'a ImageLumen| {
        lumen.lumen.as_ref().ok().into_iter().chain(&lumen.others).find(|contour| contour.vessel == vessel)
    };
    let mut shown: Vec<Shown<'a>> =
        images.iter().zip(lumens).map(|(image, lumen)| Shown { image, contour: contour(lumen) }).collect();
    shown.sort_by_key(|shown| (shown.image.bscan.formed.nanoseconds(), shown.image.bscan.number));
    shown
}

/// The contours of one vessel, with their images' places among all, by the numbers of the images; by where they lie
/// where numbers are the same, so that the order of the images says nothing.
fn shown(lumens: &[ImageLumen], vessel: usize) -> Vec<(usize, &Contour)> {
    let mut shown: Vec<(usize, &Contour)> =
        all(lumens).filter(|(_, contour)| contour.vessel == vessel).collect();
    let key = |contour: &Contour| {
        let first = contour.world.first().map_or([0.0; 3], |point| point.vector().into());
        let centre: [f64; 3] = contour.centre.vector().into();
        centre.into_iter().chain(first)
    };
    let by_place = |a: &Contour, b: &Contour| {
        let pairs = key(a).zip(key(b)).map(|(a, b)| a.total_cmp(&b));
        pairs.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    };
    let number = |i: usize| lumens[i].number;
    shown.sort_by(|a, b| number(a.0).cmp(&number(b.0)).then_with(|| by_place(a.1, b.1)));
    shown
}

fn too_few(lumens: &[ImageLumen], seen: usize, needed: usize) -> ReconError {
    let counts = counts(lumens);
    let most = counts.reasons.iter().max_by_key(|(_, count)| **count);
    let reason = most.map_or_else(|| "away from its neighbours".into(), |(reason, _)| reason.clone());
    ReconError::TooFew { seen, images: lumens.len(), needed, reason }
}

pub(crate) fn counts(lumens: &[ImageLumen]) -> ImageCounts {
    let mut counts = ImageCounts { images: lumens.len(), ..ImageCounts::default() };
    for why in lumens.iter().filter_map(|image| image.lumen.as_ref().err()) {
        counts.without_lumen += 1;
        *counts.reasons.entry(why.kind().into()).or_default() += 1;
    }
    counts
}

fn warnings(fitted: &Fitted, counts: &ImageCounts, settings: &LumenSettings) -> Vec<ReconWarning> {
    let percent = 100.0 * counts.without_lumen as f64 / counts.images.max(1) as f64;
    let many = (percent > 10.0).then_some(ReconWarning::ManyWithout { percent });
    many.into_iter().chain(fitted.warnings(settings.longest_gap_m)).collect()
}

#[cfg(test)]
mod tests;
