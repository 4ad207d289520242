//! One tick's tracking: a few Newton steps from where the arm is.

use nalgebra::Isometry3;
use probepath_frames::{Base, Flange, Frame, Pose};

use super::solve::{least_step, missing};
use super::{Model, Vector6};
use crate::Joints;

/// A pose is reached when neither its place (m) nor its angle (rad) is off by more.
const REACHED: f64 = 1e-12;

/// Newton halves the digits that are missing at each step; from one tick's distance four steps are enough, and eight
/// mean that the arm is near a singularity or the pose is not near.
const MOST_STEPS: usize = 8;

/// Far below the square of any useful singular value (1e-4), so that it slows nothing and saves the last digits of a
/// division by zero.
const DAMPING: f64 = 1e-14;

/// Joints that are further than this (rad, m) from where the arm is are another posture, not the next tick.
const NEAR: f64 = 0.5;

/// A joint may be this far outside its limit (rad, m): rounding, no more.
pub(super) const LIMIT_SLACK: f64 = 1e-9;

impl Model {
    /// The joints, near `near`, that put the tool at `base_from_tool` to 1e-12 (m and rad): the smallest change of
    /// the joints that does it, for tracking a path tick by tick. No heap.
    ///
    /// `None` when no such joints are found in a few Newton steps: the pose is not near, out of reach, or the arm is
    /// at a singularity; when they are outside the limits; and when a joint would have to move by more than 0.5 rad
    /// (0.5 m), because that is another posture and not the next tick.
    pub fn refine<T: Frame>(
        &self,
        base_from_tool: &Pose<Base, T>,
        flange_from_tool: &Pose<Flange, T>,
        near: &Joints,
    ) -> Option<Joints> {
        let q = self.newton(base_from_tool.isometry(), flange_from_tool.isometry(), near, MOST_STEPS)?;
        let near = q.zip(near, |q, near| q - near).largest() <= NEAR;
        (near && self.outside_limits(&q, LIMIT_SLACK).is_none()).then_some(q)
    }

    /// Newton's method on the pose, without regard for limits.
    pub(super) fn newton(
        &self,
        goal: &Isometry3<f64>,
        tool: &Isometry3<f64>,
        near: &Joints,
        most: usize,
    ) -> Option<Joints> {
        let goal_rotation = goal.rotation.to_rotation_matrix().into_inner();
        let mut q = *near;
        for _ in 0..=most {
            let reach = self.reach(&q, tool);
            let motion = missing(&reach, goal, &goal_rotation);
            if within(&motion, REACHED) {
                return Some(q);
            }
            let step = least_step(&reach.jacobian, &motion, DAMPING)?;
            q = q.zip(&step, |q, step| q + step);
        }
        None
    }
}

/// Whether both the linear and the angular part are at most `bound`; false for NaN.
pub(super) fn within(motion: &Vector6, bound: f64) -> bool {
    motion.fixed_rows::<3>(0).norm() <= bound && motion.fixed_rows::<3>(3).norm() <= bound
}
