//! `probepath calibrate temporal`: the lag alone, from a plane that moves in the image.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use probepath_us_capture::lag::{PoseChoice, TemporalOptions, lag_of_sequences};
use serde::Serialize;

use super::CalibrateError;
use super::request::TemporalRequest;
use super::subject::sequence;
use crate::progress::Progress;

/// The lag between images and poses.
#[derive(Clone, Debug, Serialize)]
pub struct Temporal {
    /// An image stamped t belongs to the pose at t + lag.
    pub lag_s: f64,
    /// Its standard error.
    pub standard_error_s: f64,
    /// The file of the images.
    pub images_file: PathBuf,
    /// The transform that was taken as the probe's pose.
    pub poses: String,
    /// Images in which the plane was found and that were used.
    pub images: usize,
    /// Images that disagreed with all others, and were left out.
    pub outliers: usize,
    /// Images without a plane, by the code of the reason.
    pub refused: BTreeMap<String, usize>,
    /// Correlation of the plane's position with what the poses explain of it.
    pub correlation: f64,
    /// Root mean square of what they do not explain (px).
    pub residual_px: f64,
    /// How much the images' own stamps wander about the lag.
    pub stamp_jitter_s: f64,
    /// How far the probe moved (root mean square).
    pub motion_mm: f64,
    /// What the reader must know.
    pub notes: Vec<String>,
}

/// Finds the lag between the images of one file and the poses of another, or of the same.
///
/// # Errors
/// When a file cannot be read, shows no plane or has no poses, or the two signals give no lag.
pub fn temporal(request: &TemporalRequest, progress: &dyn Progress) -> Result<Temporal, CalibrateError> {
    let orientation = request.orientation.map(|stored| stored.0);
    progress.at("reading", 0.0);
    let images = sequence(&request.images, orientation)?;
    let apart = request.poses_file.as_ref().map(|path| sequence(path, orientation)).transpose()?;
    progress.at("looking for the plane", 0.3);
    let mut options = TemporalOptions::default();
    if let Some(name) = &request.poses {
        options.poses = PoseChoice::Named(name.clone());
    }
    let everywhere = |_: usize, _: usize| true;
    let lag = lag_of_sequences(&images, apart.as_ref().unwrap_or(&images), &everywhere, &options)?;
    let found = lag.found;
    Ok(Temporal {
        lag_s: found.lag.seconds(),
        standard_error_s: found.standard_error_s,
        images_file: request.images.clone(),
        poses: lag.poses,
        images: found.images,
        outliers: found.outliers,
        refused: lag.refused.into_iter().map(|(code, count)| (code.to_owned(), count)).collect(),
        correlation: found.correlation,
        residual_px: found.residual_px,
        stamp_jitter_s: found.stamp_jitter_s,
        motion_mm: found.motion_m * 1e3,
        notes: images.notes().iter().map(ToString::to_string).collect(),
    })
}

impl fmt::Display for Temporal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} against {}", self.images_file.display(), self.poses)?;
        writeln!(
            f,
            "lag {:.1} ± {:.1} ms: an image stamped t belongs to the pose at t + lag",
            self.lag_s * 1e3,
            self.standard_error_s * 1e3
        )?;
        writeln!(
            f,
            "from {} images ({} left out as outliers); the probe moved {:.1} mm RMS, correlation {:.4}, {:.2} px RMS left",
            self.images, self.outliers, self.motion_mm, self.correlation, self.residual_px
        )?;
        writeln!(f, "the images' own stamps wander by {:.1} ms", self.stamp_jitter_s * 1e3)?;
        for (code, count) in &self.refused {
            writeln!(f, "refused: {count} images ({code})")?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        Ok(())
    }
}
