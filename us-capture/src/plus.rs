//! Configurations of the PLUS toolkit (`PlusDeviceSet_*.xml`) and its calibration results: transforms between
//! systems, and how a volume is to be built.
//!
//! ```no_run
//! use probepath_us_capture::plus::PlusConfig;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let config = PlusConfig::read("PlusDeviceSet_VolumeReconstruction.xml".as_ref())?;
//! let probe_from_pixel = config.pixels_in_probe("Image", "Probe")?;
//! println!("sheared by {:.1} degrees", probe_from_pixel.shear_rad().to_degrees());
//! # Ok(()) }
//! ```
//!
//! What it does not do: devices, phantoms, segmentation settings.

mod error;
mod volume;
mod xml;

use std::path::Path;

use nalgebra::Matrix4;
use probepath_frames::Probe;

use crate::PixelMap;
pub use error::PlusError;
pub use volume::{Fan, FanArc, HoleStick, PlusCompounding, PlusVolume, Rectangle};

/// What a configuration says about places and volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct PlusConfig {
    /// Transforms of `CoordinateDefinitions` and `CalibrationResults`, in the file's order.
    pub transforms: Vec<PlusTransform>,
    /// The settings of `VolumeReconstruction`, when there are any.
    pub volume: Option<PlusVolume>,
}

/// A transform that does not change: its matrix takes column vectors from `from` to `to`, millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct PlusTransform {
    /// Where vectors come from.
    pub from: String,
    /// Where they go.
    pub to: String,
    /// Millimetres; pixels where `from` is an image.
    pub matrix_mm: Matrix4<f64>,
    /// PLUS's own error of it, as it prints it (mm).
    pub error_mm: Option<f64>,
    /// When it was found, as it stands.
    pub date: Option<String>,
}

impl PlusConfig {
    /// Reads a configuration from disk.
    ///
    /// # Errors
    /// When the disk refuses, it is no XML of PLUS, or a value in it is none.
    pub fn read(path: &Path) -> Result<Self, PlusError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| PlusError::Disk { path: path.into(), source })?;
        Self::parse(&text)
    }

    /// Reads a configuration.
    ///
    /// # Errors
    /// When it is no XML of PLUS, or a value in it is none; each error gives the line.
    pub fn parse(text: &str) -> Result<Self, PlusError> {
        let document = roxmltree::Document::parse(text)?;
        let root = document.root_element();
        let transforms = xml::transforms(root)?;
        let volume = root.descendants().find(|n| n.has_tag_name("VolumeReconstruction"));
        let volume = volume.map(volume::parse).transpose()?;
        if transforms.is_empty() && volume.is_none() {
            return Err(PlusError::NothingHere { root: root.tag_name().name().into() });
        }
        Ok(Self { transforms, volume })
    }

    /// The transform that takes vectors from one system to another; the last one counts, as in PLUS.
    pub fn transform(&self, from: &str, to: &str) -> Option<&PlusTransform> {
        self.transforms.iter().rfind(|t| t.from == from && t.to == to)
    }

    /// Where the pixels lie in the probe's system, from the transform between those two names.
    ///
    /// # Errors
    /// When there is no such transform, or it mirrors or is flat.
    pub fn pixels_in_probe(&self, image: &str, probe: &str) -> Result<PixelMap<Probe>, PlusError> {
        let transform = self.transform(image, probe).ok_or_else(|| PlusError::NoTransform {
            from: image.into(),
            to: probe.into(),
            there: self.transforms.iter().map(|t| format!("{}To{}", t.from, t.to)).collect(),
        })?;
        Ok(PixelMap::from_matrix_mm(&transform.matrix_mm)?)
    }
}
