//! Configurations of the PLUS toolkit (`PlusDeviceSet_*.xml`) and its calibration results: transforms between
//! systems, the phantom and what is said of its images, and how a volume is to be built.
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
//! What it does not do: devices, PLUS's own thresholds.

mod error;
mod phantom;
mod segmentation;
mod volume;
mod xml;

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion};
use probepath_frames::{Phantom, Pose, Probe, World};
use roxmltree::{Document, Node};

use crate::PixelMap;
use crate::phantom::WirePhantom;
pub use error::PlusError;
pub use segmentation::{PlusFrames, PlusSegmentation};
pub use volume::{Fan, FanArc, HoleStick, PlusCompounding, PlusVolume, Rectangle};

/// How far a printed rotation may be from one: old files print four digits, which leaves 1e-4.
const ROUNDED_WITHIN: f64 = 2e-3;

/// What a configuration says about places, phantoms and volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct PlusConfig {
    /// Transforms of `CoordinateDefinitions` and `CalibrationResults`, in the file's order.
    pub transforms: Vec<PlusTransform>,
    /// The settings of `VolumeReconstruction`, when there are any.
    pub volume: Option<PlusVolume>,
    /// The phantom of `PhantomDefinition`, when there is one.
    pub phantom: Option<WirePhantom>,
    /// Where files before PLUS 2.1 keep where the phantom stands: `Registration` inside the phantom's definition.
    pub registration: Option<PlusTransform>,
    /// What `Segmentation` says of the images, when it is there.
    pub segmentation: Option<PlusSegmentation>,
    /// The systems that a probe calibration names; the usual names where it names none.
    pub frames: PlusFrames,
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
        let document = Document::parse(text)?;
        let root = document.root_element();
        let definition = element(root, &["PhantomDefinition"]);
        let algorithm = element(root, &["vtkPlusProbeCalibrationAlgo", "vtkProbeCalibrationAlgo"]);
        let config = Self {
            transforms: xml::transforms(root)?,
            volume: element(root, &["VolumeReconstruction"]).map(volume::parse).transpose()?,
            phantom: definition.map(phantom::parse).transpose()?,
            registration: definition.map(phantom::registration).transpose()?.flatten(),
            segmentation: element(root, &["Segmentation"]).map(segmentation::segmentation).transpose()?,
            frames: algorithm.map(segmentation::frames).unwrap_or_default(),
        };
        if config.transforms.is_empty() && config.volume.is_none() && config.phantom.is_none() {
            return Err(PlusError::NothingHere { root: root.tag_name().name().into() });
        }
        Ok(config)
    }

    /// Where the phantom stands in the reference system: the transform between the names of `frames`, or, where there
    /// is none or only the identity that PLUS puts in its place, the `Registration` of an old file. `None` when the
    /// file does not say.
    ///
    /// The rotation is the one nearest to the printed digits, of which old files have four.
    ///
    /// # Errors
    /// When what is printed is farther from a rotation than rounding explains: scaled, sheared or mirrored.
    pub fn world_from_phantom(&self) -> Result<Option<Pose<World, Phantom>>, PlusError> {
        let stated = self.transform(&self.frames.phantom, &self.frames.reference);
        let placeholder =
            |t: &&PlusTransform| t.matrix_mm == Matrix4::identity() && self.registration.is_some();
        let transform = stated.filter(|t| !placeholder(t)).or(self.registration.as_ref());
        transform.map(PlusTransform::rigid).transpose()
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

impl PlusTransform {
    fn rigid(&self) -> Result<Pose<World, Phantom>, PlusError> {
        let linear: Matrix3<f64> = self.matrix_mm.fixed_view::<3, 3>(0, 0).into_owned();
        let off = (linear.transpose() * linear - Matrix3::identity()).abs().max();
        if off > ROUNDED_WITHIN || linear.determinant() <= 0.0 {
            let why = format!("off by {off:.1e}, determinant {:.3}", linear.determinant());
            return Err(PlusError::NotRigid { from: self.from.clone(), to: self.to.clone(), why });
        }
        let rotation = Rotation3::from_matrix_eps(&linear, 1e-15, 100, Rotation3::identity());
        let translation = self.matrix_mm.fixed_view::<3, 1>(0, 3) / 1e3;
        // FRAMES: PLUS's transform takes column vectors from the phantom to the reference, which is our World.
        Ok(Pose::assume(Isometry3::from_parts(
            Translation3::from(translation),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )))
    }
}

/// The phantom alone: what else the file holds is not looked at.
pub(crate) fn phantom_of(text: &str) -> Result<WirePhantom, PlusError> {
    let document = Document::parse(text)?;
    let root = document.root_element();
    let definition = element(root, &["PhantomDefinition"]);
    phantom::parse(definition.ok_or_else(|| PlusError::NoPhantom { root: root.tag_name().name().into() })?)
}

/// The first element of one of these names; the root may be it.
fn element<'a, 'i>(root: Node<'a, 'i>, names: &[&str]) -> Option<Node<'a, 'i>> {
    root.descendants().find(|n| n.is_element() && names.contains(&n.tag_name().name()))
}
