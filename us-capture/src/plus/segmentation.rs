//! What a configuration says about its images and systems: `Segmentation`, `vtkPlusProbeCalibrationAlgo`.

use roxmltree::Node;

use super::PlusError;
use super::volume::{Rectangle, clip};
use super::xml::{bad, finite};

/// What we use of `Segmentation`: PLUS's own thresholds are not asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct PlusSegmentation {
    /// About how large a pixel is (mm), the same both ways. A start, not a calibration.
    pub approximate_spacing_mm: Option<f64>,
    /// The part of the image in which dots are looked for (MF pixels).
    pub clip: Option<Rectangle>,
}

/// Which name of the file plays which part in a calibration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlusFrames {
    /// The image, in pixels.
    pub image: String,
    /// The marker on the probe.
    pub probe: String,
    /// The phantom, as its definition has it.
    pub phantom: String,
    /// What does not move against the phantom.
    pub reference: String,
}

impl Default for PlusFrames {
    fn default() -> Self {
        Self {
            image: "Image".into(),
            probe: "Probe".into(),
            phantom: "Phantom".into(),
            reference: "Reference".into(),
        }
    }
}

pub(super) fn segmentation(node: Node<'_, '_>) -> Result<PlusSegmentation, PlusError> {
    let attribute = "ApproximateSpacingMmPerPixel";
    let spacing = finite(node, attribute, 1)?.and_then(|numbers| numbers.first().copied());
    if spacing.is_some_and(|mm| mm <= 0.0) {
        return Err(bad(node, attribute, "a pixel has a positive size (mm)"));
    }
    Ok(PlusSegmentation { approximate_spacing_mm: spacing, clip: clip(node)? })
}

/// The names that are given; the usual ones for the others.
pub(super) fn frames(node: Node<'_, '_>) -> PlusFrames {
    let usual = PlusFrames::default();
    let name = |attribute, usual: String| node.attribute(attribute).map_or(usual, str::to_owned);
    PlusFrames {
        image: name("ImageCoordinateFrame", usual.image),
        probe: name("ProbeCoordinateFrame", usual.probe),
        phantom: name("PhantomCoordinateFrame", usual.phantom),
        reference: name("ReferenceCoordinateFrame", usual.reference),
    }
}
