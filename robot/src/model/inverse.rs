//! Inverse kinematics: joints for a pose, within limits, near a reference posture; or why there are none.

mod search;

use probepath_frames::{Base, Flange, Frame, Pose};
use thiserror::Error;

use self::search::Search;
use super::Model;
use crate::Joints;

/// How hard to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseOptions {
    /// Steps from each posture that is tried.
    pub steps: usize,
    /// Postures that are tried after the reference, spread evenly over the joints' ranges, always the same ones.
    pub restarts: usize,
    /// Restarts end when so many solutions were found; the one nearest to the reference is taken.
    pub enough: usize,
}

impl Default for InverseOptions {
    fn default() -> Self {
        Self { steps: 100, restarts: 60, enough: 4 }
    }
}

/// Why no joints put the tool there.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NoInverse {
    /// The reference has another number of joints than the model.
    #[error("the reference posture has {found} joints and the arm {expected}; give one position per joint")]
    WrongJoints {
        /// In the reference.
        found: usize,
        /// In the model.
        expected: usize,
    },
    /// A number that is not finite came in.
    #[error("{what} is not finite; check the numbers that were given")]
    NotFinite {
        /// Which input.
        what: &'static str,
    },
    /// The place is beyond the arm in every orientation, whatever the limits.
    #[error(
        "out of reach by {:.3} mm, in whatever orientation; bring the pose nearer to the base",
        short_m * 1000.0
    )]
    OutOfReach {
        /// From the pose's origin to the nearest place that was reached (m).
        short_m: f64,
    },
    /// The place is within reach, and not in this orientation, whatever the limits.
    #[error(
        "the place is within reach and not in this orientation: the nearest posture found is {:.3} mm and {:.3} degrees \
         off; turn the tool, or bring the pose nearer to the base",
        short_m * 1000.0, short_rad.to_degrees()
    )]
    NotSoOriented {
        /// What is left of the distance at the posture that comes closest (m).
        short_m: f64,
        /// What is left of the angle there (rad).
        short_rad: f64,
    },
    /// Postures reach it, and each that was found is outside the limits of a joint.
    #[error(
        "joint \"{joint}\" would have to be at {needed:.4} and may be at {lower:.4} to {upper:.4} (rad or m); \
         move the pose or the base, or turn the tool"
    )]
    BeyondLimit {
        /// The joint that is furthest outside, in the posture that is the least outside.
        joint: String,
        /// Where it would have to be.
        needed: f64,
        /// Its lower limit.
        lower: f64,
        /// Its upper limit.
        upper: f64,
    },
    /// The arm gets near and there loses a direction it would need.
    #[error(
        "singular: {:.3} mm and {:.3} degrees short the arm cannot move as it would have to \
         (smallest singular value {smallest:.1e}); move the pose away from there",
        short_m * 1000.0, short_rad.to_degrees()
    )]
    Singular {
        /// Distance that is left (m).
        short_m: f64,
        /// Angle that is left (rad).
        short_rad: f64,
        /// The smallest singular value of the Jacobian there.
        smallest: f64,
    },
}

impl Model {
    /// Joints that put the tool at `base_from_tool`, within the limits: to 1e-12 (m and rad), at a singularity to 1e-9.
    /// The search begins at `reference`; only if that leads nowhere it begins elsewhere, and takes the solution nearest
    /// to `reference`. The same question gives the same answer.
    ///
    /// Damped least squares with the damping of Sugihara (2011), which goes with the error and so is as quick as
    /// Newton at the end and steady where there is no solution; joints at a limit are held there, and what freedom
    /// is left pulls to the reference.
    ///
    /// # Errors
    /// When nothing was found: out of reach and by how much, which joint's limit is in the way, or singular.
    pub fn inverse<T: Frame>(
        &self,
        base_from_tool: &Pose<Base, T>,
        flange_from_tool: &Pose<Flange, T>,
        reference: &Joints,
        options: &InverseOptions,
    ) -> Result<Joints, NoInverse> {
        if reference.len() != self.joints() {
            return Err(NoInverse::WrongJoints { found: reference.len(), expected: self.joints() });
        }
        refuse_infinite("the pose", base_from_tool.is_finite())?;
        refuse_infinite("the tool", flange_from_tool.is_finite())?;
        refuse_infinite("the reference posture", reference.is_finite())?;
        let (goal, tool) = (base_from_tool.isometry(), flange_from_tool.isometry());
        Search::new(self, goal, tool, reference, options).answer()
    }
}

fn refuse_infinite(what: &'static str, finite: bool) -> Result<(), NoInverse> {
    if finite { Ok(()) } else { Err(NoInverse::NotFinite { what }) }
}
