//! What is asked of a calibration.

use std::path::PathBuf;

use super::wishes::{Fan, PhantomToReference, PixelMm, Place, Region, Scale, Stored};

/// The phantom, and how the images of a sequence are to be read.
#[derive(Clone, Debug, Default)]
pub struct SubjectRequest {
    /// A phantom file (.toml), a PLUS configuration (.xml), or the name of a phantom that ships.
    pub phantom: String,
    /// The chain of poses (`ProbeToReference`).
    pub poses: Option<String>,
    /// The part of the image that is looked at.
    pub region: Option<Region>,
    /// What a curved probe sees of it.
    pub fan: Option<Fan>,
    /// For files that do not say theirs.
    pub orientation: Option<Stored>,
}

/// `calibrate spatial`.
#[derive(Clone, Debug, Default)]
pub struct SpatialRequest {
    /// Images of the phantom with poses.
    pub sequence: PathBuf,
    /// The phantom, and how the images are read.
    pub subject: SubjectRequest,
    /// Other images, on which the calibration is measured.
    pub validate: Option<PathBuf>,
    /// Folder for the pictures.
    pub overlay: Option<PathBuf>,
    /// Where the calibration is stored.
    pub out: Option<PathBuf>,
    /// Whether the document holds the labelled dots.
    pub dots: bool,
    /// Where the phantom is; otherwise the configuration says it, or nobody.
    pub phantom_to_reference: Option<PhantomToReference>,
    /// How that is taken.
    pub place: Option<Place>,
    /// Size of a pixel; otherwise the configuration says it, or nobody.
    pub pixel_mm: Option<PixelMm>,
    /// How that is taken.
    pub scale: Option<Scale>,
    /// Temperature of the phantom's water (Celsius).
    pub water_celsius: f64,
    /// What lies between grey 0 and 255 (dB): the width of the beam is read from the wires with it.
    pub dynamic_range_db: Option<f64>,
    /// Where the image is on the probe, about: an earlier calibration (.toml) or a PLUS configuration (.xml).
    pub nominal: Option<PathBuf>,
    /// The probe may look at the phantom from either side: a mirrored image is not looked for.
    pub any_side: bool,
    /// The lag (s), where it is known.
    pub lag_s: Option<f64>,
    /// Today (ISO 8601), for the stored calibration.
    pub date: String,
}

/// `calibrate temporal`.
#[derive(Clone, Debug, Default)]
pub struct TemporalRequest {
    /// The images, and the poses where one file holds both.
    pub images: PathBuf,
    /// The poses, where they were recorded apart.
    pub poses_file: Option<PathBuf>,
    /// The chain of poses.
    pub poses: Option<String>,
    /// For files that do not say theirs.
    pub orientation: Option<Stored>,
}

/// `calibrate check`.
#[derive(Clone, Debug, Default)]
pub struct CheckRequest {
    /// The stored calibration.
    pub calibration: PathBuf,
    /// A short scan of the phantom.
    pub sequence: PathBuf,
    /// The phantom, and how the images are read.
    pub subject: SubjectRequest,
    /// Where the phantom is.
    pub phantom_to_reference: Option<PhantomToReference>,
    /// Temperature of the water it stands in (Celsius), where somebody measured it.
    pub water_celsius: Option<f64>,
}
