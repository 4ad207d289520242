//! [`Shots`]: B-scans of a phantom with their stamps, and where the probe was meanwhile.

use std::sync::Arc;

use probepath_frames::{Probe, Span, Stamp, Track, World};
use thiserror::Error;

use crate::sequence::{ChainNames, MaybePose, NoChain, Sequence, SkipReason};

/// Poses further apart than this many of the usual steps are not interpolated between: a freehand probe has been
/// anywhere meanwhile.
const WIDEST_GAP_STEPS: i64 = 4;
/// How far apart images without stamps are put.
const UNSTAMPED_STEP: Span = Span::from_milliseconds(1000);

/// One B-scan of a phantom.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// Its number in the recording, refused and invalid ones counted.
    pub number: u64,
    /// The image's own stamp. Which pose belongs to it is what the lag says.
    pub stamp: Stamp,
    /// 8-bit grey, MF, row after row; why there is none otherwise.
    pub pixels: Result<Arc<[u8]>, SkipReason>,
}

/// B-scans of one size and one setting, and the probe's track by the same clock.
#[derive(Clone, Debug)]
pub struct Shots {
    width: usize,
    height: usize,
    shots: Vec<Shot>,
    track: Track<World, Probe>,
    /// Poses that were not to be used, by reason, in the recording's order.
    pub lost_poses: Vec<(u64, SkipReason)>,
    /// Whether the images said when they were taken. Without that there is no lag to be found.
    pub stamped: bool,
}

/// B-scans that cannot be used together.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BadShots {
    /// The file holds no pictures.
    #[error(
        "there are {images} images in the recording and no picture in any: give the file with the images"
    )]
    NoPictures {
        /// Images in the file.
        images: usize,
    },
    /// No way from the probe to the reference.
    #[error(transparent)]
    Chain(#[from] NoChain),
    /// Images without poses.
    #[error(
        "none of the {images} images has a usable pose of the probe ({first}): \
         record the tracker's poses with the images, and name the right chain"
    )]
    NoPoses {
        /// Images in the file.
        images: usize,
        /// Why the first has none.
        first: SkipReason,
    },
    /// A picture of another size.
    #[error("image {number} has {bytes} pixels, {width} x {height} are expected")]
    Size {
        /// The image.
        number: u64,
        /// What came.
        bytes: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl Shots {
    /// B-scans that were captured here, and the probe's track while they were.
    ///
    /// # Errors
    /// When there is none, or one has another size.
    pub fn new(
        (width, height): (usize, usize),
        shots: Vec<Shot>,
        track: Track<World, Probe>,
    ) -> Result<Self, BadShots> {
        if shots.iter().all(|shot| shot.pixels.is_err()) {
            return Err(BadShots::NoPictures { images: shots.len() });
        }
        for shot in &shots {
            if let Ok(pixels) = &shot.pixels
                && pixels.len() != width * height
            {
                let (number, bytes) = (shot.number, pixels.len());
                return Err(BadShots::Size { number, bytes, width, height });
            }
        }
        Ok(Self { width, height, shots, track, lost_poses: Vec::new(), stamped: true })
    }

    /// The images of a tracked sequence, with the probe's poses through `chain`.
    ///
    /// An image without a stamp is put a second after the one before it, and `stamped` says so.
    ///
    /// # Errors
    /// When it has no picture, no usable pose, or no way from the probe to the reference.
    pub fn from_sequence(sequence: &Sequence, chain: &ChainNames) -> Result<Self, BadShots> {
        let images = sequence.images();
        let stamped = images.iter().all(|image| image.stamp.is_some());
        let mut stamp = Stamp::ZERO;
        let mut shots = Vec::with_capacity(images.len());
        for image in images {
            stamp = if stamped { image.stamp.unwrap_or(stamp) } else { stamp + UNSTAMPED_STEP };
            let word = || SkipReason::ImageInvalid(image.status.word().unwrap_or_default().into());
            let pixels = match &image.pixels {
                None => Err(SkipReason::NoPicture),
                Some(_) if !image.status.is_usable() => Err(word()),
                Some(pixels) => Ok(Arc::clone(pixels)),
            };
            shots.push(Shot { number: image.number, stamp, pixels });
        }
        let (track, lost_poses) = track_of(&shots, sequence.probe_poses(chain)?)?;
        let size = (sequence.width(), sequence.height());
        Ok(Self { lost_poses, stamped, ..Self::new(size, shots, track)? })
    }

    /// Columns and rows of every image.
    pub const fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The B-scans in the recording's order, those without a picture too.
    pub fn shots(&self) -> &[Shot] {
        &self.shots
    }

    /// Where the probe was.
    pub const fn track(&self) -> &Track<World, Probe> {
        &self.track
    }
}

/// By the median step from stamp to stamp.
fn widest_gap(shots: &[Shot]) -> Span {
    let mut steps: Vec<i64> = shots.windows(2).map(|w| (w[1].stamp - w[0].stamp).nanoseconds()).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return Span::ZERO;
    }
    let (_, median, _) = steps.select_nth_unstable(middle);
    Span::from_nanoseconds(median.saturating_mul(WIDEST_GAP_STEPS).max(0))
}

type Lost = Vec<(u64, SkipReason)>;

/// The poses that may be used by their stamps. Repeated stamps and steps back are left out: of two poses for one
/// instant nobody knows the right one.
fn track_of(shots: &[Shot], poses: Vec<MaybePose>) -> Result<(Track<World, Probe>, Lost), BadShots> {
    let (mut track, mut lost) = (Track::new(widest_gap(shots)), Lost::new());
    for (shot, pose) in shots.iter().zip(poses) {
        match pose {
            Ok(pose) => {
                if track.push(shot.stamp, pose).is_err() {
                    lost.push((shot.number, SkipReason::NoStamp));
                }
            }
            Err(reason) => lost.push((shot.number, reason)),
        }
    }
    match lost.first() {
        Some((_, first)) if track.samples().is_empty() => {
            Err(BadShots::NoPoses { images: shots.len(), first: first.clone() })
        }
        _ => Ok((track, lost)),
    }
}
