//! [`Tool`]: what hangs on the force sensor, and what the sensor reads when nothing touches it.
//!
//! The sensor feels its own bias, the weight of all that is beyond it, and the skin. With the direction `u` of gravity
//! in the probe's axes it reads, in the air, `force = W u + b` and `torque = (W c) × u + t`: linear in the weight `W`,
//! the first moment `W c` and the bias, so that a few poses give them by least squares ([`identify`]), with their
//! standard errors. [`ZeroWatch`] compares what is read in the air with what should be, and re-zeroes there and only
//! there.
//!
//! ```
//! use probepath_frames::{Base, Direction, Pose, Probe, nalgebra::{Isometry3, Vector3}};
//! use probepath_robot::{Tool, ToolReading, identify};
//!
//! let down = Direction::<Base>::z().reversed();
//! let truth = Tool { weight_n: 9.0, centre_m: Vector3::new(0.0, 0.01, -0.05), ..Tool::none() };
//! let readings: Vec<_> = [(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5), (0.4, 0.4)]
//!     .into_iter()
//!     .map(|(about_x, about_y)| {
//!         // FRAMES: a probe that was turned by hand, for the example.
//!         let turn = Isometry3::new(Vector3::zeros(), Vector3::new(about_x, about_y, 0.0));
//!         let base_from_probe = Pose::<Base, Probe>::assume(turn);
//!         ToolReading { base_from_probe, wrench: truth.in_air(&base_from_probe, &down) }
//!     })
//!     .collect();
//! let fit = identify(&readings, &down)?;
//! assert!((fit.tool.weight_n - 9.0).abs() < 1e-9);
//! # Ok::<(), probepath_robot::ToolError>(())
//! ```

mod identify;
mod zero;

use nalgebra::Vector3;
use probepath_frames::{Base, Direction, Pose, Probe, Wrench};
use thiserror::Error;

pub use identify::{ToolFit, ToolReading, identify};
pub use zero::{Air, ZeroSettings, ZeroWatch};

/// What the sensor reads in the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Weight of all that is beyond the sensor (N).
    pub weight_n: f64,
    /// Its centre of gravity, in the probe's axes from the probe's origin (m).
    pub centre_m: Vector3<f64>,
    /// What the sensor reads without weight.
    pub bias: Wrench<Probe>,
}

/// A tool that cannot be identified, or a zero that cannot be taken.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ToolError {
    /// Too few poses.
    #[error(
        "{given} poses are too few to tell weight from bias; hold the probe still in {wanted} or more, \
         tilted differently"
    )]
    TooFew {
        /// How many there were.
        given: usize,
        /// How many there have to be.
        wanted: usize,
    },
    /// The poses differ too little.
    #[error(
        "the poses are too alike: gravity turned by {found_deg:.1} degrees for want of a tilt about the probe's \
         {axis}, and {wanted_deg} are needed; add poses tilted about its {axis} to either side"
    )]
    Alike {
        /// The probe's axis about which it has to be tilted.
        axis: &'static str,
        /// How much gravity turned (degrees, one standard deviation).
        found_deg: f64,
        /// How much it has to.
        wanted_deg: f64,
    },
    /// A reading that is no number.
    #[error("pose {pose} has a reading that is not finite; take it again")]
    NotFinite {
        /// Which, from 0.
        pose: usize,
    },
    /// Something touched the probe, or its cable pulls.
    #[error(
        "pose {pose} is {off_n:.2} N off what the others say ({usual_n:.2} N is usual): something touched the probe \
         or its cable pulled; take it again"
    )]
    Outlier {
        /// Which, from 0.
        pose: usize,
        /// How far it is off (N).
        off_n: f64,
        /// The others' root mean square (N).
        usual_n: f64,
    },
    /// A zero can only be taken in the air.
    #[error(
        "the probe is not in the air ({why}); lift it off and keep it still for {still_s} s, then take the zero"
    )]
    NotInAir {
        /// What speaks against it.
        why: String,
        /// How long it has to be still (s).
        still_s: f64,
    },
}

impl Tool {
    /// No weight, no bias.
    pub fn none() -> Self {
        Self { weight_n: 0.0, centre_m: Vector3::zeros(), bias: Wrench::zero() }
    }

    /// What the sensor reads with nothing touching; `down` is where things fall to.
    pub fn in_air(&self, base_from_probe: &Pose<Base, Probe>, down: &Direction<Base>) -> Wrench<Probe> {
        let weight = (base_from_probe.inverse() * *down).vector() * self.weight_n;
        Wrench::new(weight, self.centre_m.cross(&weight)) + self.bias
    }

    /// What touches the probe, when the sensor reads `read`.
    pub fn touching(
        &self,
        read: &Wrench<Probe>,
        base_from_probe: &Pose<Base, Probe>,
        down: &Direction<Base>,
    ) -> Wrench<Probe> {
        *read - self.in_air(base_from_probe, down)
    }
}

#[cfg(test)]
mod tests;
