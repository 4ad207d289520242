//! What sightings not yet made would tell: the plan of a calibration before anything moves.

use nalgebra::DMatrix;
use probepath_frames::{Image, Pose, Probe, Track, World};

use super::parameters::{COUNT, Parameter, Values};
use super::problem::{Problem, Square};
use super::uncertainty::{Geometry, Uncertainty, fitted, invert};
use super::{FitError, FitOptions, Sighting, solve};
use crate::phantom::WirePhantom;

/// What dots at these places, seen from these poses, tell about the parameters: `J^T W J`, and what the priors tell.
///
/// ```no_run
/// # use probepath_us_capture::{fit::*, phantom::WirePhantom};
/// # use probepath_frames::*;
/// # fn run(phantom: &WirePhantom, planned: &[Sighting], track: &Track<World, Probe>, options: &FitOptions,
/// #        guess: Pose<Probe, Image>) -> Result<(), FitError> {
/// let information = Information::of(phantom, planned, track, options, guess)?;
/// let expected = information.expected()?.standard_error_map(820, 616);
/// println!("expect {:.2} mm over the image", expected.mean_m() * 1e3);
/// # Ok(()) }
/// ```
#[derive(Clone, Debug)]
pub struct Information {
    square: Square,
    prior: Square,
    active: [bool; COUNT],
    geometry: Geometry,
}

impl Information {
    /// What `sightings`, predicted or made, tell near `probe_from_image`. Their covariances (with the floor) are taken
    /// as they are; the track says how the probe moves at their stamps, which is what the lag shows in.
    ///
    /// # Errors
    /// When an option or a sighting is no use, or the track has no pose for a sighting.
    pub fn of(
        phantom: &WirePhantom,
        sightings: &[Sighting],
        track: &Track<World, Probe>,
        options: &FitOptions,
        probe_from_image: Pose<Probe, Image>,
    ) -> Result<Self, FitError> {
        options.check()?;
        let mut problem = Problem::new(phantom, sightings, track, options)?;
        let values = Values::start(&probe_from_image, options.lag.start(), options);
        problem.weigh_as_said(&values)?;
        let whole = solve::normal(&problem, &values).ok_or(FitError::Diverged)?.square;
        let prior = Square::from_diagonal(&problem.prior);
        Ok(Self {
            square: whole - prior,
            prior,
            active: problem.active,
            geometry: Geometry::of(&values, options.spacing),
        })
    }

    /// The same, of sightings whose errors have a variance `factor` times what was said.
    #[must_use]
    pub fn with_variance(mut self, factor: f64) -> Self {
        self.square /= factor;
        self
    }

    /// Both together: what either's sightings tell, the priors once.
    #[must_use]
    pub fn and(mut self, other: &Self) -> Self {
        self.square += other.square;
        self
    }

    /// What would be fitted, in the order of the matrix.
    pub fn parameters(&self) -> Vec<Parameter> {
        fitted(&self.active)
    }

    /// `J^T W J` with the priors: second derivatives of the cost, in one over the parameters' units.
    pub fn matrix(&self) -> DMatrix<f64> {
        super::uncertainty::kept(&(self.square + self.prior), &self.active)
    }

    /// The uncertainty that these sightings would leave.
    ///
    /// # Errors
    /// When they would leave a parameter undetermined: which, and what to do.
    pub fn expected(&self) -> Result<Uncertainty, FitError> {
        let inverse = invert(&(self.square + self.prior), &self.active)?;
        Ok(Uncertainty::of(&inverse, &self.active, self.geometry))
    }
}
