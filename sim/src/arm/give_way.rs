//! How the arm gives way in freedrive: its motors carry arm and tool, and a light mass and a damper are left.

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector3, Vector6};
use probepath_frames::{Flange, Frame, Pose};
use probepath_robot::{Joints, Model};

/// Mass (kg) and inertia (kg m²) that the hand feels.
const MASS: [f64; 2] = [2.0, 0.02];
/// And damping (N s/m, N m s/rad).
const DAMPING: [f64; 2] = [90.0, 0.8];
/// It goes no faster (m/s, rad/s): the teaching anchor of the standards (FIELD.md section 10).
const FASTEST: [f64; 2] = [0.25, 1.0];

/// The velocity at which the arm gives way, in Base's axes at the tool's origin: linear, then angular.
#[derive(Clone, Debug)]
pub(crate) struct GiveWay {
    velocity: Vector6<f64>,
}

impl Default for GiveWay {
    fn default() -> Self {
        Self { velocity: Vector6::zeros() }
    }
}

impl GiveWay {
    /// The velocity after `seconds` of a push (force and torque in Base's axes at the tool's origin), of which only
    /// what `free` leaves is given way to.
    pub(crate) fn step(
        &mut self,
        push: &Vector6<f64>,
        free: impl Fn(Vector6<f64>) -> Vector6<f64>,
        seconds: f64,
    ) -> Vector6<f64> {
        for part in 0..2 {
            let rows = 3 * part;
            let velocity = self.velocity.fixed_rows::<3>(rows).into_owned();
            let wished = push.fixed_rows::<3>(rows) / DAMPING[part];
            let share = 1.0 - (-seconds * DAMPING[part] / MASS[part]).exp();
            let next = (velocity + (wished - velocity) * share).cap_magnitude(FASTEST[part]);
            self.velocity.fixed_rows_mut::<3>(rows).copy_from(&next);
        }
        self.velocity = free(self.velocity);
        self.velocity
    }
}

/// Joints that move the tool from where `from` has it with `velocity` (Base's axes at the tool's origin) for `seconds`;
/// `None` near a singularity, where it would take faster joints than there are.
pub(crate) fn moved<T: Frame>(
    model: &Model,
    tool: &Pose<Flange, T>,
    from: &Joints,
    velocity: &Vector6<f64>,
    seconds: f64,
) -> Option<Joints> {
    let here = (model.forward(from) * *tool).isometry().to_owned();
    let turn = UnitQuaternion::from_scaled_axis(velocity.fixed_rows::<3>(3) * seconds);
    let place = here.translation.vector + velocity.fixed_rows::<3>(0) * seconds;
    reached(model, tool, from, &Isometry3::from_parts(place.into(), turn * here.rotation))
}

/// Joints near `seed` that bring the tool to `goal` in Base: Newton's method, at most six steps. For chains of six
/// joints or more; the shortest step of the joints is taken.
pub(crate) fn reached<T: Frame>(
    model: &Model,
    tool: &Pose<Flange, T>,
    seed: &Joints,
    goal: &Isometry3<f64>,
) -> Option<Joints> {
    let mut joints = *seed;
    for _ in 0..6 {
        let here = (model.forward(&joints) * *tool).isometry().to_owned();
        let off = difference(&here, goal);
        if off.norm() < 1e-10 {
            return Some(joints);
        }
        let j = model.jacobian(&joints, tool);
        let square: SMatrix<f64, 6, 6> = j.matrix() * j.matrix().transpose();
        let pull = j.matrix().transpose() * square.cholesky()?.solve(&off);
        let step = pull.amax();
        if !step.is_finite() || step > 0.2 {
            return None;
        }
        joints.as_mut_slice().iter_mut().zip(pull.iter()).for_each(|(q, dq)| *q += dq);
    }
    let here = (model.forward(&joints) * *tool).isometry().to_owned();
    (difference(&here, goal).norm() < 1e-7).then_some(joints)
}

/// From `here` to `goal`: place (m) and rotation vector (rad) in Base's axes.
pub(crate) fn difference(here: &Isometry3<f64>, goal: &Isometry3<f64>) -> Vector6<f64> {
    let place = goal.translation.vector - here.translation.vector;
    let turn: Vector3<f64> = (goal.rotation * here.rotation.inverse()).scaled_axis();
    Vector6::new(place.x, place.y, place.z, turn.x, turn.y, turn.z)
}

#[cfg(test)]
mod tests {
    use probepath_robot::{Arm, Command};

    use super::*;
    use crate::cell::{CellConfig, SimulatedCell};

    #[test]
    fn in_freedrive_the_hand_leads_the_arm_along_the_leg_and_then_it_rests() {
        for seed in 1..=2 {
            let cell = SimulatedCell::new(&CellConfig::default(), seed).unwrap();
            let mut arm = cell.arm();
            cell.hand().guide();
            let mut state = arm.exchange(&Command::Freedrive).unwrap();
            let mut ticks = 0;
            while cell.hand().guides() && ticks < 90 * 500 {
                state = arm.exchange(&Command::Freedrive).unwrap();
                assert!((state.commanded.zip(&state.position, |a, b| a - b)).largest() < 0.02);
                ticks += 1;
            }
            assert!(!state.guiding && ticks > 2000, "{ticks}");
            let moments = cell.truth().moments();
            let forces: Vec<f64> = moments.iter().map(|m| m.skin.force.norm()).filter(|f| *f > 0.5).collect();
            let mean = forces.iter().sum::<f64>() / forces.len() as f64;
            let most = forces.iter().copied().fold(0.0, f64::max);
            assert!((3.0..6.0).contains(&mean) && most < 16.0, "{mean} {most}");
            let z = |i: usize| moments[i].world_from_probe.origin().vector().z;
            let furthest = (0..moments.len()).map(z).fold(0.0, f64::min);
            assert!(furthest < -0.19, "{furthest}");
            // Let go of, it drifts to rest, and the next command goes on from there.
            (0..200).for_each(|_| state = arm.exchange(&Command::Freedrive).unwrap());
            state = arm.exchange(&Command::Position(state.commanded)).unwrap();
            assert!(state.velocity.largest() < 0.05);
        }
    }

    #[test]
    fn newton_brings_the_tool_where_it_was_asked_and_says_when_it_cannot() {
        let cell = SimulatedCell::new(&CellConfig::default(), 1).unwrap();
        let (model, tool) = (cell.nominal().model(), cell.nominal().flange_from_probe);
        let start = cell.nominal().start;
        let velocity = Vector6::new(0.1, -0.05, 0.02, 0.3, 0.1, -0.2);
        let next = moved(model, &tool, &start, &velocity, 0.002).unwrap();
        let (here, there) = (model.forward(&start) * tool, model.forward(&next) * tool);
        let went = difference(here.isometry(), there.isometry());
        assert!((went - velocity * 0.002).norm() < 1e-9);
        assert!(moved(model, &tool, &start, &(velocity * 1e4), 0.002).is_none());
    }
}
