//! [`PointToPoint`]: from rest to rest in joint space, all joints arriving together, jerk-limited.

use probepath_frames::Span;
use rsruckig::prelude::{
    DataArrayOrVec, InputParameter, Ruckig, RuckigResult, Synchronization, ThrowErrorHandler, Trajectory,
};
use thiserror::Error;

use crate::{Command, Controller, Joints, LimitsError, MotionLimits, State};

/// The rates planned with, as a fraction of the limits: the limiter stays a millionth inside, and is never needed.
const PLANNED: f64 = 0.9999;

/// The target is commanded once more for each difference that has to become zero: velocity, acceleration, and the
/// tick after.
const SETTLE: u64 = 3;

/// A time-optimal move between two joint positions, planned before anything moves (the Ruckig algorithm, Berscheid
/// and Kröger 2021, in `rsruckig`); a step only evaluates it. Its samples' finite differences are averages of its
/// derivatives, so they keep the same limits.
#[derive(Clone, Debug)]
pub struct PointToPoint {
    trajectory: Trajectory<0>,
    target: Joints,
    dt: f64,
    tick: u64,
    last_tick: u64,
}

/// A move that cannot be planned.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NoMove {
    /// The limits cannot be kept.
    #[error("no move can be planned: {0}")]
    Limits(#[from] LimitsError),
    /// An end of the move outside a joint's range.
    #[error("joint {joint} would be at {at:.4}, outside {lower:.4} to {upper:.4} (rad, m)")]
    OutOfRange {
        /// The joint, counted from zero.
        joint: usize,
        /// Where it would be (rad, m).
        at: f64,
        /// Lower limit.
        lower: f64,
        /// Upper limit.
        upper: f64,
    },
    /// The planner found nothing.
    #[error("no move could be planned: {why}")]
    Planner {
        /// What it said.
        why: String,
    },
}

impl PointToPoint {
    /// Plans from the commanded position `start`, at rest, to `target`.
    ///
    /// # Errors
    /// When a position is not finite or outside its range anywhere on the way, or the limits cannot be kept.
    pub fn plan(
        start: &Joints,
        target: &Joints,
        limits: &MotionLimits,
        period: Span,
    ) -> Result<Self, NoMove> {
        // The limiter's own questions: the number of joints, finite numbers, limits, the period.
        let mut limiter = crate::Limiter::at_rest(*limits, period, *start)?;
        limiter.limit(target)?;
        inside(target, limits)?;
        let trajectory = planned(start, target, &limits.scaled(PLANNED))?;
        let dt = period.seconds();
        let last_tick = (trajectory.get_duration() / dt).ceil() as u64 + SETTLE;
        let mut plan = Self { trajectory, target: *target, dt, tick: 0, last_tick };
        plan.keeps_range(limits)?;
        Ok(plan)
    }

    /// How long it takes (s), without the last ticks of rest.
    pub fn duration_s(&self) -> f64 {
        self.trajectory.get_duration()
    }

    /// The joint positions a time (s) after the start.
    pub fn at(&self, time_s: f64) -> Joints {
        let mut at = self.target;
        if time_s < self.trajectory.get_duration() {
            let mut section = 0;
            self.trajectory.state_to_integrate_from(time_s, &mut section, |joint, t, q, v, a, j| {
                at[joint] = q + t * (v + t * (a / 2.0 + t * j / 6.0));
            });
        }
        at
    }

    /// Ruckig plans without regard to positions: a profile may overshoot its target.
    fn keeps_range(&mut self, limits: &MotionLimits) -> Result<(), NoMove> {
        let joints = self.target.len();
        let extrema = self.trajectory.get_position_extrema();
        for joint in 0..joints {
            let (lower, upper) = (limits.lower[joint], limits.upper[joint]);
            for at in [extrema[joint].min, extrema[joint].max] {
                if at < lower - 1e-9 || at > upper + 1e-9 {
                    return Err(NoMove::OutOfRange { joint, at, lower, upper });
                }
            }
        }
        Ok(())
    }
}

impl Controller for PointToPoint {
    fn step(&mut self, _: &State) -> Option<Command> {
        self.tick += 1;
        (self.tick <= self.last_tick).then(|| Command::Position(self.at(self.tick as f64 * self.dt)))
    }
}

/// Whether a position is inside its range.
fn inside(position: &Joints, limits: &MotionLimits) -> Result<(), NoMove> {
    let outside = |joint: &usize| {
        let at = position[*joint];
        at < limits.lower[*joint] || at > limits.upper[*joint]
    };
    match (0..position.len()).find(outside) {
        Some(joint) => Err(NoMove::OutOfRange {
            joint,
            at: position[joint],
            lower: limits.lower[joint],
            upper: limits.upper[joint],
        }),
        None => Ok(()),
    }
}

fn planned(start: &Joints, target: &Joints, limits: &MotionLimits) -> Result<Trajectory<0>, NoMove> {
    let joints = start.len();
    let list = |values: &Joints| DataArrayOrVec::Heap(values.as_slice().to_vec());
    let mut input = InputParameter::<0>::new(Some(joints));
    input.synchronization = Synchronization::Time;
    input.current_position = list(start);
    input.target_position = list(target);
    input.max_velocity = list(&limits.velocity);
    input.max_acceleration = list(&limits.acceleration);
    input.max_jerk = list(&limits.jerk);
    let mut trajectory = Trajectory::<0>::new(Some(joints));
    let mut ruckig = Ruckig::<0, ThrowErrorHandler>::new(Some(joints), 1.0);
    match ruckig.calculate(&input, &mut trajectory) {
        Ok(RuckigResult::Working | RuckigResult::Finished) => Ok(trajectory),
        Ok(other) => Err(NoMove::Planner { why: format!("{other:?}") }),
        Err(error) => Err(NoMove::Planner { why: error.to_string() }),
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::Limiter;

    const PERIOD: Span = Span::from_milliseconds(2);

    fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
        low + (high - low) * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn some(rng: &mut ChaCha8Rng, low: f64, high: f64) -> Joints {
        let mut joints = Joints::zeros(6);
        joints.as_mut_slice().iter_mut().for_each(|value| *value = between(rng, low, high));
        joints
    }

    fn problem(rng: &mut ChaCha8Rng) -> (Joints, Joints, MotionLimits) {
        let limits = MotionLimits {
            lower: Joints::splat(6, -3.0),
            upper: Joints::splat(6, 3.0),
            velocity: some(rng, 0.3, 3.2),
            acceleration: some(rng, 1.0, 15.0),
            jerk: some(rng, 30.0, 1000.0),
        };
        let start = some(rng, -3.0, 3.0);
        let reach = if rng.next_u32().is_multiple_of(4) { 0.01 } else { 6.0 };
        let target = start.zip(&some(rng, -reach, reach), |from, by| (from + by).clamp(-3.0, 3.0));
        (start, target, limits)
    }

    #[test]
    fn a_thousand_moves_never_need_the_limiter_and_arrive_together_at_rest() {
        let mut rng = ChaCha8Rng::seed_from_u64(30);
        for case in 0..1000 {
            let (start, target, limits) = problem(&mut rng);
            let mut plan = PointToPoint::plan(&start, &target, &limits, PERIOD).unwrap();
            let mut limiter = Limiter::at_rest(limits, PERIOD, start).unwrap();
            let state = crate::State {
                tick: 0,
                stamp: probepath_frames::Stamp::ZERO,
                position: start,
                velocity: start,
                commanded: start,
                wrench: probepath_frames::Wrench::zero(),
                guiding: false,
                safety: crate::Safety::Normal,
                age: Span::ZERO,
            };
            let mut arrived = None;
            for tick in 0.. {
                let Some(Command::Position(next)) = plan.step(&state) else { break };
                let limited = limiter.limit(&next).unwrap();
                assert!(limited.changed <= 0.0, "case {case}, tick {tick}: changed by {:e}", limited.changed);
                if arrived.is_none() && next.zip(&target, |a, b| a - b).largest() < 1e-12 {
                    arrived = Some(tick);
                }
            }
            assert_eq!(*limiter.position(), target);
            assert!(limiter.is_at_rest() && arrived.is_some());
        }
    }

    #[test]
    fn a_move_is_as_fast_as_its_slowest_joint_allows() {
        // Rest to rest over d with limits that are all reached: d/v + v/a + a/j.
        let mut limits = problem(&mut ChaCha8Rng::seed_from_u64(31)).2;
        limits.velocity = Joints::splat(6, 1.0);
        limits.acceleration = Joints::splat(6, 4.0);
        limits.jerk = Joints::splat(6, 80.0);
        let mut target = Joints::splat(6, 0.1);
        target[3] = 2.0;
        let plan = PointToPoint::plan(&Joints::zeros(6), &target, &limits, PERIOD).unwrap();
        let best = 2.0 / 1.0 + 1.0 / 4.0 + 4.0 / 80.0;
        assert!((plan.duration_s() - best).abs() < 1e-3 * best, "{} s, best {best} s", plan.duration_s());
    }

    #[test]
    fn a_move_out_of_range_or_of_no_number_is_refused_with_its_joint() {
        let (start, _, limits) = problem(&mut ChaCha8Rng::seed_from_u64(32));
        let mut target = start;
        target[4] = 3.5;
        let refused = PointToPoint::plan(&start, &target, &limits, PERIOD).unwrap_err();
        assert!(matches!(refused, NoMove::OutOfRange { joint: 4, .. }), "{refused}");
        target[4] = f64::NAN;
        let refused = PointToPoint::plan(&start, &target, &limits, PERIOD).unwrap_err();
        assert!(matches!(refused, NoMove::Limits(LimitsError::NotFinite { joint: 4, .. })), "{refused}");
        let refused = PointToPoint::plan(&start, &Joints::zeros(5), &limits, PERIOD).unwrap_err();
        assert!(matches!(refused, NoMove::Limits(LimitsError::Joints { found: 5, joints: 6 })), "{refused}");
    }
}
