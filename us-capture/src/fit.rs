//! The fit: where the image's plane is in the probe, and when it was formed, from labelled dots and poses.
//!
//! ```no_run
//! use probepath_us_capture::fit::{FitOptions, PhantomPlace, Sighting, fit};
//! # use probepath_us_capture::{PixelSpacing, phantom::WirePhantom};
//! # use probepath_frames::{Phantom, Pose, Probe, Track, World};
//! # fn run(phantom: &WirePhantom, sightings: &[Sighting], track: &Track<World, Probe>,
//! #        world_from_phantom: Pose<World, Phantom>, spacing: PixelSpacing) -> Result<(), Box<dyn std::error::Error>> {
//! let options = FitOptions::new(spacing, PhantomPlace::prior(world_from_phantom));
//! let fit = fit(phantom, sightings, track, &options, None)?;
//! let error = fit.uncertainty.standard_error_map(820, 616);
//! println!("{:?}, lag {:.3} s, good to {:.2} mm", fit.probe_from_image, fit.lag.seconds(), error.mean_m() * 1e3);
//! # Ok(()) }
//! ```
//!
//! Every dot says that `phantom_from_world * world_from_probe(stamp + lag) * probe_from_image * spacing.point(u, v)`
//! lies on its wire ([P1] eq. 1, and the lag). Levenberg-Marquardt on all wires: a dot's residual is the vector from
//! its wire, perpendicular to it, weighed by the dot's covariance; outliers count less ([`Robust`]). The nouns: a
//! [`Sighting`] is what one image saw; [`FitOptions`] say what is known; a [`Fit`] is the answer with its
//! [`Uncertainty`]; an [`Information`] is what sightings not yet made would tell.
//!
//! What it does not do: find dots, or tell which wire made which.

mod affine;
mod error;
mod information;
mod lag_scan;
mod linear;
mod model;
mod motion;
mod options;
mod parameters;
mod problem;
mod robust;
mod solve;
mod spread;
mod uncertainty;
mod water;
mod weak;

#[cfg(test)]
mod tests;

use nalgebra::Matrix2;
use probepath_frames::{Image, Phantom, Pose, Probe, Span, Stamp, Track, World};

use crate::phantom::WirePhantom;
use crate::{PixelMap, PixelSpacing};
pub use error::FitError;
pub use information::Information;
pub(crate) use linear::middle_point;
pub use linear::{linear_start, start_from_planes};
pub use options::{FitOptions, Lag, PhantomPlace, Robust, Scale};
pub use parameters::Parameter;
pub use uncertainty::{StandardErrorMap, Uncertainty};
pub(crate) use water::{deeper_in_tissue_m, first_row_m};
pub use water::{in_tissue, speed_of_sound_in_water};
pub use weak::Weakness;

/// The labelled dots of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The image's number in its sequence.
    pub image: usize,
    /// When the image says it was formed; the pose is asked at this stamp plus the lag.
    pub stamp: Stamp,
    /// What was seen of which wire.
    pub dots: Vec<SeenWire>,
}

/// A dot with its wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenWire {
    /// Index into the phantom's wires.
    pub wire: usize,
    /// Its centre (column, row), in pixels.
    pub at_px: [f64; 2],
    /// How uncertain the centre is (px²).
    pub covariance_px2: Matrix2<f64>,
}

/// Where the image's plane is, when images were formed, and how sure that is.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Where the image's plane is in the probe.
    pub probe_from_image: Pose<Probe, Image>,
    /// Size of a pixel, as fitted.
    pub spacing: PixelSpacing,
    /// An image stamped t belongs to the pose at t + lag.
    pub lag: Span,
    /// Where the phantom stands, as refined.
    pub world_from_phantom: Pose<World, Phantom>,
    /// What was fitted, with its covariance.
    pub uncertainty: Uncertainty,
    /// Images that took part.
    pub images: usize,
    /// Dots that took part.
    pub dots: usize,
    /// Images whose stamp, with the lag, the track does not cover: they took no part.
    pub outside: usize,
    /// Root mean square distance of the dots from their wires, outliers included (m).
    pub line_rms_m: f64,
    /// How many times larger the dots' errors are than their covariances (with the floor) say: from the median, so
    /// that outliers do not count.
    pub variance_factor: f64,
    /// How much larger the variance of a parameter is because the dots of one image share errors.
    pub design_effect: f64,
    /// How far columns and rows would be from a right angle if they were free to be (rad), and its standard error:
    /// a rigid image has none, so a shear beyond its error points at bad labels, a bad phantom file, or bad poses.
    pub shear_rad: (f64, f64),
    /// What is weakly determined, weakest first, in words.
    pub weak: Vec<Weakness>,
}

impl Fit {
    /// Where the pixels lie in the probe.
    pub fn pixels(&self) -> PixelMap<Probe> {
        PixelMap::of(&self.probe_from_image, self.spacing)
    }
}

/// Fits the calibration.
///
/// Without a `start` it finds one by itself from the phantom's Zs ([`linear_start`]). Images that the track does not
/// cover at their stamp plus the lag take no part, and are counted.
///
/// # Errors
/// When an option or a sighting is no use (which, and why), there are fewer dots than parameters, the track covers too
/// few images, no start was found, or the dots and poses leave a parameter undetermined (which, and what to do).
pub fn fit(
    phantom: &WirePhantom,
    sightings: &[Sighting],
    track: &Track<World, Probe>,
    options: &FitOptions,
    start: Option<Pose<Probe, Image>>,
) -> Result<Fit, FitError> {
    options.check()?;
    let mut problem = problem::Problem::new(phantom, sightings, track, options)?;
    let (pose, lag) = match start {
        Some(pose) if pose.is_finite() => (pose, options.lag.start()),
        Some(_) => {
            return Err(FitError::Option { field: "start", found: f64::NAN, wanted: "finite numbers" });
        }
        None => linear_start(phantom, sightings, track, options)?,
    };
    let mut values = parameters::Values::start(&pose, lag, options);
    if let Lag::Estimated { .. } = options.lag {
        values = lag_scan::scan(&mut problem, &values, options.lag)?;
    }
    let values = solve::settle(&mut problem, values)?;
    options.lag.check_found(values.lag_s)?;
    uncertainty::conclude(&problem, &values, options)
}
