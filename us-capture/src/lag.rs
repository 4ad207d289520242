//! The lag alone, from two signals: where a plane is in every image, and where the probe was.
//!
//! ```
//! use probepath_frames::{Pose, Probe, Span, Stamp, Track, World, nalgebra::Isometry3};
//! use probepath_us_capture::lag::{LagOptions, Sample, lag_of};
//!
//! // A probe that bobs over the bottom of a water tank; the images are stamped 40 ms late.
//! let depth_m = |t: f64| 0.005 * (6.0 * t).sin() + 0.003 * (2.6 * t * t.sqrt()).sin();
//! let mut poses: Track<World, Probe> = Track::new(Span::from_milliseconds(100));
//! for t in (0..500).map(|i| f64::from(i) * 0.02) {
//!     // FRAMES: the motion above, made up for the example.
//!     let pose = Pose::assume(Isometry3::translation(0.0, 0.0, depth_m(t)));
//!     poses.push(Stamp::from_nanoseconds((t * 1e9) as i64), pose)?;
//! }
//! let image = |t: f64| Sample {
//!     stamp: Stamp::from_nanoseconds(((t + 0.040) * 1e9) as i64),
//!     position_px: 300.0 - 10_000.0 * depth_m(t),
//!     sd_px: 0.3,
//! };
//! let images: Vec<Sample> = (10..90).map(|i| image(f64::from(i) * 0.1)).collect();
//! let found = lag_of(&images, &poses, &LagOptions::default())?;
//! assert!((found.lag.seconds() + 0.040).abs() < 0.001);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The nouns: a [`Line`] is the plane as one image shows it ([`find_line`]), a [`Sample`] its position at the image's
//! stamp, [`LagFound`] the answer: an image stamped t belongs to the pose at t + lag. [`lag_of_sequences`] does all of
//! it from recorded files. Whatever cannot be told is refused: [`NoLine`] for an image, [`NoLag`] for the whole.
//!
//! The plane's position is a linear function of the pose at t + lag, with coefficients nobody knows: for every lag they
//! are the least squares (variable projection), and the lag is where the rest is smallest. So a motion that runs round
//! a circle at constant speed, or a straight line at constant speed, says nothing, and is refused.
//!
//! What it does not do: calibrate the image's place; that fit finds its own lag.

mod error;
mod find;
mod line;
mod motion;
mod refine;
mod regress;
mod sequences;
mod uncertainty;

use probepath_frames::{Span, Stamp};

pub use error::{NoLag, NoLine};
pub use find::lag_of;
pub use line::{Line, LineOptions, find_line};
pub use sequences::{PoseChoice, Temporal, TemporalError, TemporalOptions, lag_of_sequences};

/// Where the plane was in one image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The image's own stamp, on the poses' clock.
    pub stamp: Stamp,
    /// The plane's position along one column of the image (px).
    pub position_px: f64,
    /// Its standard deviation (px).
    pub sd_px: f64,
}

/// What is looked for, and what is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagOptions {
    /// Lags beyond this, early or late, are not tried.
    pub most_lag: Span,
    /// With fewer images there is no answer.
    pub fewest_images: usize,
    /// The probe has to move at least this far, root mean square (m); a turn counts as it moves a plane 100 mm away.
    pub least_motion_m: f64,
    /// The pose has to explain the plane's position with at least this correlation.
    pub least_correlation: f64,
    /// An answer that is less certain than this is refused (s).
    pub worst_standard_error_s: f64,
}

impl Default for LagOptions {
    /// One second either way, twenty images, 1 mm, a correlation of 0.7, 20 ms.
    fn default() -> Self {
        Self {
            most_lag: Span::from_milliseconds(1000),
            fewest_images: 20,
            least_motion_m: 1e-3,
            least_correlation: 0.7,
            worst_standard_error_s: 0.02,
        }
    }
}

/// The lag, and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagFound {
    /// An image stamped t belongs to the pose at t + lag.
    pub lag: Span,
    /// Standard error of the lag (s). Residuals that hang together in time are counted as the few they are worth.
    pub standard_error_s: f64,
    /// Correlation of the plane's position with what the poses at t + lag explain of it.
    pub correlation: f64,
    /// Root mean square of what they do not explain (px).
    pub residual_px: f64,
    /// How much the images' own stamps wander about the lag (s), as far as fast motion shows more residual than slow.
    pub stamp_jitter_s: f64,
    /// How far the probe moved (m, root mean square).
    pub motion_m: f64,
    /// Images that were used.
    pub images: usize,
    /// Images that disagreed with all others, and were left out.
    pub outliers: usize,
}

#[cfg(test)]
mod tests;
