//! The search behind [`Model::inverse`]: downhill from the reference, then from elsewhere, then for the reason.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Matrix3};

use super::{InverseOptions, NoInverse};
use crate::model::newton::{LIMIT_SLACK, within};
use crate::model::solve::{least_step, missing};
use crate::model::{Jacobian, Model, Vector6};
use crate::{Joints, MAX_JOINTS};

/// A search for a pose ends when neither its place (m) nor its angle (rad) is off by more.
const REACHED: f64 = 1e-12;

/// A pose counts as reached below this (m, rad): at a singularity the last digits do not come.
const ACCEPTED: f64 = 1e-9;

/// Keeps a step finite at a singularity. There the error is the square of the joints' distance, and stalls near this.
const LEAST_DAMPING: f64 = 1e-13;

/// A search whose steps are shorter than this (rad, m) has come to rest.
const AT_REST: f64 = 1e-10;

/// Nearer than this (m, rad) at a singular posture, the singularity is the cause and not the distance.
const CLOSE: f64 = 1e-5;

/// Below this smallest singular value an arm is at a singularity.
const SINGULAR: f64 = 1e-2;

/// The longest step of a joint (rad, m) in one iteration: beyond it the Jacobian says nothing.
const LONGEST_STEP: f64 = 0.5;

/// How much of the way back to the reference is gone in one step, where that moves the tool by nothing.
const PULL: f64 = 0.5;

/// The pull has come to rest when steps are shorter than this (rad, m); nearer to the reference is not worth more.
const SETTLED: f64 = 1e-6;

/// Whether a search keeps to the joints' ranges.
#[derive(Clone, Copy, PartialEq)]
enum Within {
    Limits,
    Anything,
}

/// What a search is after: the pose, or its place in whatever orientation.
#[derive(Clone, Copy, PartialEq)]
enum After {
    Pose,
    Place,
}

/// Where a search ended.
struct Found {
    joints: Joints,
    /// What is missing to the pose there.
    motion: Vector6,
}

/// One question, and what it is measured against.
pub(super) struct Search<'a> {
    model: &'a Model,
    goal: Isometry3<f64>,
    goal_rotation: Matrix3<f64>,
    tool: Isometry3<f64>,
    reference: Joints,
    options: InverseOptions,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        model: &'a Model,
        goal: &Isometry3<f64>,
        tool: &Isometry3<f64>,
        reference: &Joints,
        options: &InverseOptions,
    ) -> Self {
        let goal_rotation = goal.rotation.to_rotation_matrix().into_inner();
        Self { model, goal: *goal, goal_rotation, tool: *tool, reference: *reference, options: *options }
    }

    pub(super) fn answer(&self) -> Result<Joints, NoInverse> {
        self.nearest().map_or_else(|| self.without_limits(), Ok)
    }

    /// From the reference; when that fails, from the other postures.
    fn nearest(&self) -> Option<Joints> {
        if let Some(joints) = self.solve(&self.reference) {
            return Some(joints);
        }
        (1..=self.options.restarts)
            .filter_map(|number| self.solve(&self.spread(number)))
            .take(self.options.enough)
            .min_by(|a, b| self.distance(a).total_cmp(&self.distance(b)))
    }

    /// A solution within limits, from one posture: first the pose by itself, then, with joints to spare, the pull to
    /// the reference.
    fn solve(&self, start: &Joints) -> Option<Joints> {
        let found = self.descend(start, Within::Limits, After::Pose, 0.0);
        if !within(&found.motion, ACCEPTED) {
            return None;
        }
        let found = self.unwound(&found.joints);
        let pulled = self.descend(&found, Within::Limits, After::Pose, PULL);
        let better =
            within(&pulled.motion, ACCEPTED) && self.distance(&pulled.joints) < self.distance(&found);
        Some(if better { pulled.joints } else { found })
    }

    fn distance(&self, q: &Joints) -> f64 {
        q.zip(&self.reference, |a, b| (a - b) * (a - b)).iter().sum()
    }

    /// Goes downhill from a posture until the pose is reached and the pull to the reference has come to rest, or the
    /// search has, or the steps are used up.
    fn descend(&self, start: &Joints, bounds: Within, after: After, pull: f64) -> Found {
        let pull = if self.model.joints() > 6 { pull } else { 0.0 };
        let mut found = Found { joints: self.clamped(start, bounds), motion: Vector6::repeat(f64::INFINITY) };
        for _ in 0..self.options.steps {
            let mut reach = self.model.reach(&found.joints, &self.tool);
            found.motion = missing(&reach, &self.goal, &self.goal_rotation);
            if after == After::Place {
                found.motion.fixed_rows_mut::<3>(3).fill(0.0);
                reach.jacobian.matrix.fixed_rows_mut::<3>(3).fill(0.0);
            }
            if pull <= 0.0 && within(&found.motion, REACHED) {
                break;
            }
            let Some(step) = self.step(&reach.jacobian, &found, bounds, pull) else { break };
            let rest = if within(&found.motion, REACHED) { SETTLED } else { AT_REST };
            if step.largest() < rest {
                break;
            }
            let shorter = (LONGEST_STEP / step.largest()).min(1.0);
            found.joints = self.clamped(&found.joints.zip(&step, |q, step| q + step * shorter), bounds);
        }
        found
    }

    /// One damped step; a joint that it would push out of its range is held and the rest is solved again.
    fn step(&self, jacobian: &Jacobian, found: &Found, bounds: Within, pull: f64) -> Option<Joints> {
        let damping = 0.5 * found.motion.norm_squared() + LEAST_DAMPING;
        let mut free = *jacobian;
        let mut pull = self.reference.zip(&found.joints, |reference, q| pull * (reference - q));
        for _ in 0..=found.joints.len() {
            // The step nearest to the pull among those that move the tool as asked.
            let rest = found.motion - free.velocity(&pull);
            let step = least_step(&free, &rest, damping)?.zip(&pull, |step, pull| step + pull);
            let pushed =
                if bounds == Within::Limits { self.pushed_out(&found.joints, &step, &free) } else { None };
            let Some(held) = pushed else { return Some(step) };
            free.matrix.column_mut(held).fill(0.0);
            pull[held] = 0.0;
        }
        Some(Joints::zeros(found.joints.len()))
    }

    /// A joint at its limit that the step would push further, and that is not held yet.
    fn pushed_out(&self, joints: &Joints, step: &Joints, free: &Jacobian) -> Option<usize> {
        (0..joints.len()).find(|&j| {
            let limit = &self.model.limits[j];
            let out =
                (joints[j] <= limit.lower && step[j] < 0.0) || (joints[j] >= limit.upper && step[j] > 0.0);
            out && free.matrix.column(j).amax() > 0.0
        })
    }

    fn clamped(&self, joints: &Joints, bounds: Within) -> Joints {
        let mut all = *joints;
        if bounds == Within::Anything {
            return all;
        }
        for (q, limit) in all.as_mut_slice().iter_mut().zip(&self.model.limits) {
            *q = q.max(limit.lower).min(limit.upper);
        }
        all
    }

    /// Whole turns taken off, as near to the reference as the limits allow.
    fn unwound(&self, joints: &Joints) -> Joints {
        let mut all = *joints;
        for (j, q) in all.as_mut_slice().iter_mut().enumerate() {
            if !self.model.turns_freely(j) {
                continue;
            }
            let limit = &self.model.limits[j];
            let nearest = *q - ((*q - self.reference[j]) / TAU).round() * TAU;
            let lift = ((limit.lower - LIMIT_SLACK - nearest) / TAU).ceil().max(0.0) * TAU;
            let lowered = ((nearest - limit.upper - LIMIT_SLACK) / TAU).ceil().max(0.0) * TAU;
            *q = nearest + lift - lowered;
        }
        all
    }

    /// Posture `number` of a sequence that fills the joints' ranges evenly (Halton, one prime a joint).
    fn spread(&self, number: usize) -> Joints {
        let mut all = self.reference;
        for ((q, limit), prime) in all.as_mut_slice().iter_mut().zip(&self.model.limits).zip(PRIMES) {
            let (lower, upper) = (limit.lower.max(-PI), limit.upper.min(PI));
            let (lower, upper) = if lower < upper { (lower, upper) } else { (limit.lower, limit.upper) };
            *q = lower + (upper - lower) * radical_inverse(number, prime);
        }
        all
    }

    /// After every posture failed: the cause, looked for again without the limits. What that finds within the limits
    /// is an answer all the same.
    fn without_limits(&self) -> Result<Joints, NoInverse> {
        let found = self.anywhere(After::Pose);
        let solved = found.iter().filter(|found| within(&found.motion, ACCEPTED));
        let solved = solved.map(|found| self.unwound(&found.joints));
        let least =
            solved.filter_map(|q| Some((q, self.furthest_out(&q)?))).min_by(|a, b| a.1.2.total_cmp(&b.1.2));
        match least {
            Some((joints, (_, _, by))) if by <= LIMIT_SLACK => Ok(joints),
            Some((_, (joint, needed, _))) => {
                let limit = &self.model.limits[joint];
                let name = self.model.names.get(joint).cloned().unwrap_or_default();
                Err(NoInverse::BeyondLimit { joint: name, needed, lower: limit.lower, upper: limit.upper })
            }
            None => Err(self.short(&found)),
        }
    }

    /// Where searches without limits end, from the reference and a dozen other postures.
    fn anywhere(&self, after: After) -> Vec<Found> {
        (0..=self.options.restarts.min(12))
            .map(|number| if number == 0 { self.reference } else { self.spread(number) })
            .map(|start| self.descend(&start, Within::Anything, after, 0.0))
            .collect()
    }

    /// The joint that is furthest outside, where it is, and by how much.
    fn furthest_out(&self, joints: &Joints) -> Option<(usize, f64, f64)> {
        let out = joints
            .iter()
            .zip(&self.model.limits)
            .map(|(q, limit)| (q, (limit.lower - q).max(q - limit.upper)));
        out.enumerate().map(|(j, (q, by))| (j, q, by)).max_by(|a, b| a.2.total_cmp(&b.2))
    }

    fn short(&self, found: &[Found]) -> NoInverse {
        let place = self.anywhere(After::Place);
        let short_m = place.iter().map(|found| found.motion.norm()).fold(f64::INFINITY, f64::min);
        if short_m > CLOSE {
            return NoInverse::OutOfReach { short_m };
        }
        let nearest = found.iter().min_by(|a, b| a.motion.norm().total_cmp(&b.motion.norm()));
        let (short_m, short_rad, smallest) = nearest.map_or((f64::NAN, f64::NAN, f64::NAN), |found| {
            let reach = self.model.reach(&found.joints, &self.tool);
            let (linear, angular) =
                (found.motion.fixed_rows::<3>(0).norm(), found.motion.fixed_rows::<3>(3).norm());
            (linear, angular, reach.jacobian.smallest_singular_value())
        });
        if short_m < CLOSE && short_rad < CLOSE && smallest < SINGULAR {
            return NoInverse::Singular { short_m, short_rad, smallest };
        }
        NoInverse::NotSoOriented { short_m, short_rad }
    }
}

const PRIMES: [usize; MAX_JOINTS] = [2, 3, 5, 7, 11, 13, 17, 19];

/// The digits of `number` in base `prime`, mirrored at the point.
fn radical_inverse(mut number: usize, prime: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while number > 0 {
        digit /= prime as f64;
        value += digit * (number % prime) as f64;
        number /= prime;
    }
    value
}
