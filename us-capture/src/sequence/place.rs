//! From a sequence to B-scans that know where they were.

mod chain;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use probepath_frames::{Image, Pose, Probe, Span, Stamp, Track, World};
use thiserror::Error;

use super::{Sequence, SequenceImage, TransformName};
use crate::plus::{PlusConfig, PlusError};
use crate::{BScan, PixelMap, PixelSpacing, PlacedBScan, Setting};
use chain::Chain;
pub use chain::ChainNames;

/// How the images of a sequence are placed: World is the file's reference system.
#[derive(Clone, Debug, PartialEq)]
pub struct Placing {
    /// Where the pixels lie in the probe's system (the spatial calibration).
    pub probe_from_pixel: PixelMap<Probe>,
    /// The way from the probe to the system that becomes World.
    pub chain: ChainNames,
    /// How the machine was set, where that is known: a file does not say.
    pub setting: Option<Setting>,
    /// An image stamped t belongs to the pose at t + lag.
    pub lag: Span,
    /// Poses further apart are not interpolated between (only asked for with a lag).
    pub widest_gap: Span,
}

impl Placing {
    /// PLUS's usual names (`Probe`, `Reference`), no lag.
    pub fn new(probe_from_pixel: PixelMap<Probe>) -> Self {
        Self {
            probe_from_pixel,
            chain: ChainNames::default(),
            setting: None,
            lag: Span::ZERO,
            widest_gap: Span::from_milliseconds(1000),
        }
    }

    /// The chain of a PLUS configuration: its `ImageToProbe`, its reference, its fixed transforms.
    ///
    /// # Errors
    /// When it has no such transform, or one that mirrors.
    pub fn from_plus(config: &PlusConfig) -> Result<Self, PlusError> {
        let volume = config.volume.as_ref();
        let image = volume.map_or("Image", |v| v.image.as_str());
        let mut placing = Self::new(config.pixels_in_probe(image, "Probe")?);
        if let Some(volume) = volume {
            placing.chain.reference.clone_from(&volume.reference);
        }
        let fixed = config.transforms.iter().filter(|t| t.from != image);
        placing.chain.fixed = fixed.map(|t| (TransformName::new(&t.from, &t.to), t.matrix_mm)).collect();
        Ok(placing)
    }
}

/// Why an image has no place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum SkipReason {
    /// The recorder marked it, with this word.
    ImageInvalid(String),
    /// There is no picture, only poses.
    NoPicture,
    /// A pose of the chain is marked as not to be used.
    PoseInvalid(String),
    /// A pose of the chain is not there.
    PoseMissing(String),
    /// The chain's product is no rigid pose.
    NotRigid,
    /// It has no stamp, and a lag was asked for.
    NoStamp,
    /// With the lag, its instant lies outside the poses or in a gap of them.
    NoPoseThen,
}

impl fmt::Display for SkipReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ImageInvalid(word) => write!(f, "image marked {word}"),
            Self::NoPicture => f.write_str("no picture"),
            Self::PoseInvalid(name) => write!(f, "{name} marked as not to be used"),
            Self::PoseMissing(name) => write!(f, "{name} missing"),
            Self::NotRigid => f.write_str("pose not rigid"),
            Self::NoStamp => f.write_str("no stamp"),
            Self::NoPoseThen => f.write_str("no pose at its instant"),
        }
    }
}

/// Where the probe was in one image, or why nobody knows.
pub type MaybePose = Result<Pose<World, Probe>, SkipReason>;

/// Images without a place, counted by reason.
pub type Skipped = BTreeMap<SkipReason, usize>;

/// A sequence that cannot be placed at all.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "no way from {probe} to {reference} through the tracked transforms ({}): \
     name the probe's and the reference's system as the file does", there.join(", ")
)]
pub struct NoChain {
    /// The probe's system.
    pub probe: String,
    /// The reference's.
    pub reference: String,
    /// The transforms there are.
    pub there: Vec<String>,
}

/// A B-scan with its place, rigid and as calibrated.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The B-scan; its pose is the rigid one nearest to the calibration.
    pub bscan: PlacedBScan,
    /// Where its pixels are by the calibration as it stands, shear and all: for volumes.
    pub world_from_pixel: PixelMap<World>,
}

/// The images of a sequence that have a place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedSequence {
    /// In the file's order.
    pub images: Vec<Placed>,
    /// The others.
    pub skipped: Skipped,
    /// Placed images without a stamp; theirs is zero.
    pub unstamped: usize,
    /// How far the rigid poses are from the calibration at the worst pixel (m).
    pub off_rigid_m: f64,
}

impl PlacedSequence {
    /// The B-scans alone.
    pub fn into_bscans(self) -> Vec<PlacedBScan> {
        self.images.into_iter().map(|placed| placed.bscan).collect()
    }
}

impl Sequence {
    /// Gives every image its place, where it has one.
    ///
    /// The file says no depth and no focus: unless the setting is given, depth and window are taken from the calibrated
    /// size of the picture, the focus as the middle of it.
    ///
    /// # Errors
    /// When no chain of transforms leads from the probe to the reference.
    pub fn place(&self, placing: &Placing) -> Result<PlacedSequence, NoChain> {
        let chain = Chain::find(self, &placing.chain)?;
        let track = (placing.lag != Span::ZERO).then(|| self.track(&chain, placing));
        let (probe_from_image, spacing) = placing.probe_from_pixel.nearest_rigid();
        let setting = placing.setting.unwrap_or_else(|| setting_of(spacing, self.width, self.height));
        let off_rigid_m = placing.probe_from_pixel.off_rigid_m(self.width, self.height);
        let mut placed =
            PlacedSequence { images: Vec::new(), skipped: Skipped::new(), unstamped: 0, off_rigid_m };
        for image in &self.images {
            match self.place_one(image, &chain, track.as_ref(), placing.lag, setting) {
                Ok((bscan, world_from_probe)) => {
                    placed.unstamped += usize::from(image.stamp.is_none());
                    placed.images.push(at(bscan, world_from_probe, probe_from_image, placing));
                }
                Err(reason) => *placed.skipped.entry(reason).or_default() += 1,
            }
        }
        Ok(placed)
    }

    /// Where the probe was in every image, in the file's order, by the transforms tracked with it.
    ///
    /// # Errors
    /// When no chain of transforms leads from the probe to the reference.
    pub fn probe_poses(&self, names: &ChainNames) -> Result<Vec<MaybePose>, NoChain> {
        let chain = Chain::find(self, names)?;
        Ok(self.images.iter().map(|image| chain.pose(image)).collect())
    }

    fn place_one(
        &self,
        image: &SequenceImage,
        chain: &Chain,
        track: Option<&Track<World, Probe>>,
        lag: Span,
        setting: Setting,
    ) -> Result<(BScan, Pose<World, Probe>), SkipReason> {
        let pixels = image.pixels.as_ref().ok_or(SkipReason::NoPicture)?;
        if !image.status.is_usable() {
            return Err(SkipReason::ImageInvalid(image.status.word().unwrap_or_default().into()));
        }
        let arrived = image.stamp.unwrap_or(Stamp::ZERO);
        let formed = arrived + lag;
        let world_from_probe = match track {
            None => chain.pose(image)?,
            Some(_) if image.stamp.is_none() => return Err(SkipReason::NoStamp),
            Some(track) => track.at(formed).map_err(|_| SkipReason::NoPoseThen)?,
        };
        let size = (self.width, self.height);
        let bscan = BScan::new(image.number, (formed, arrived), setting, size, Arc::clone(pixels));
        Ok((bscan.map_err(|_| SkipReason::NoPicture)?, world_from_probe))
    }

    /// The poses that may be used, by their stamps; repeated stamps and steps back are left out.
    fn track(&self, chain: &Chain, placing: &Placing) -> Track<World, Probe> {
        let mut track = Track::new(placing.widest_gap);
        for image in &self.images {
            if let (Some(stamp), Ok(pose)) = (image.stamp, chain.pose(image)) {
                let _step_back = track.push(stamp, pose);
            }
        }
        track
    }
}

fn at(
    bscan: BScan,
    world_from_probe: Pose<World, Probe>,
    probe_from_image: Pose<Probe, Image>,
    placing: &Placing,
) -> Placed {
    let world_from_pixel = placing.probe_from_pixel.placed(&world_from_probe);
    let world_from_image = world_from_probe * probe_from_image;
    Placed {
        bscan: PlacedBScan { bscan, world_from_probe, world_from_image, wrench: None },
        world_from_pixel,
    }
}

/// What a picture's size says of the machine's setting.
pub(super) fn setting_of(spacing: PixelSpacing, width: usize, height: usize) -> Setting {
    let depth_m = spacing.y_m * height as f64;
    Setting {
        depth_m,
        focus_m: depth_m / 2.0,
        window_top_m: 0.0,
        window_height_m: depth_m,
        window_width_m: spacing.x_m * width as f64,
        spacing,
    }
}
