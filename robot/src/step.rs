//! One tick of differential inverse kinematics: [`Stepper`].
//!
//! Every tick a small quadratic program ([`crate::qp`]) finds the joints' steps `Δq` and the part `σ` of the way along
//! the path, from 0 to 1, with
//!
//! ```text
//! J Δq = σ · (way along the path) + (motion of the contact) + (pull back onto the path)
//! ```
//!
//! and σ as near to 1 as can be, where each joint stays in its [`Room`](crate::Room) (range, speed, acceleration and
//! jerk, now and for ever after), the probe can still brake before every plane of the workspace, and the arm before a
//! singularity. What a seventh joint leaves free pulls the joints away from their limits and the arm from
//! singularities. A singularity is looked at from as far away as braking takes: from a fixed distance it was too late for
//! fast joints, which then left the way by up to 39 mm. A second look with the Jacobian at the end takes away what the first order leaves (1e-9 m), so
//! nothing adds up.
//!
//! Where not even σ = 0 is possible the probe leaves its way, by as little as the limits allow, and is led back
//! gently: it never jumps. Whatever holds it back is said as a [`Binding`].

mod behind;
mod brake;
mod posture;
mod program;
mod settings;
mod singular;

use std::fmt;

use nalgebra::Isometry3;
use probepath_frames::{Base, Flange, Pose, Probe, Span};

use crate::model::solve::{between, least_step, missing};
use crate::model::{Reach, Vector6};
use crate::{JointBound, Joints, Limiter, LimitsError, MAX_JOINTS, Model, MotionLimits, Plane};
pub use behind::Behind;
use brake::Together;
use posture::Posture;
use program::{Answer, Near, PLANES, Wanted};
pub use settings::{StepError, StepSettings};
use singular::Weakest;

/// Joints that a probe needs to go anywhere.
const LEAST_JOINTS: usize = 6;
/// Below this many times the least singular value its gradient is looked at, and wherever it falls so that it would
/// come there within this many times the way of a brake.
const NEAR_SINGULAR: f64 = 3.0;
const NEAR_BRAKE: f64 = 2.0;
/// Off its way by less than this (m, rad) the probe is put back in a tick; by more, as by three equal poles (rad/s),
/// the quicker the less it is.
const TINY: f64 = 1e-8;
const BACK_RAD_S: (f64, f64) = (4.0, 40.0);
/// Part of the joints' jerk for the way back, and the way of the probe for a joint's (m/rad).
const BACK_SHARE: f64 = 0.5;
const REACH_M: f64 = 0.5;
/// Below this many times the least singular value the joints slow down toward a part of their speed: near a singularity
/// they would be the faster the slower they have to become.
const SLOW_SINGULAR: f64 = 6.0;
const SLOWEST: f64 = 0.05;
/// A part of the way above this is all of it.
const WHOLE: f64 = 1.0 - 1e-9;

/// What the probe is to do in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathStep {
    /// Where it should be at the end of the tick if it did not move along the path at all: what the contact wants.
    pub still: Pose<Base, Probe>,
    /// Where it should be at the end of the tick.
    pub ahead: Pose<Base, Probe>,
    /// How much of its freedom a redundant arm may use (0 to 1): zero while the probe is to rest.
    pub freedom: f64,
}

/// What held the probe back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// A joint's limit.
    Joint {
        /// The joint, counted from zero.
        joint: usize,
        /// Which of its limits.
        bound: JointBound,
    },
    /// A plane of the workspace.
    Plane {
        /// Counted from zero.
        number: usize,
    },
    /// The distance to a singularity.
    Singularity,
}

impl fmt::Display for Binding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint { joint, bound } => write!(f, "joint {joint} {bound}"),
            Self::Plane { number } => write!(f, "plane {number} of the workspace"),
            Self::Singularity => f.write_str("a singularity"),
        }
    }
}

/// One tick's answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepped {
    /// The joints' next positions (rad, m): within every limit.
    pub position: Joints,
    /// The part of the way along the path that was gone, 0 to 1.
    pub part: f64,
    /// What held it back, when the part is below 1 or the probe is off its way.
    pub binding: Option<Binding>,
    /// How far the probe is off its way (m), and turned against it (rad): zero but for rounding where the limits allow.
    pub off: (f64, f64),
}

/// Steps an arm along a path, tick by tick. `Model` and settings are constants; what it remembers is what was
/// commanded last, and what was left off the way.
///
/// ```
/// use probepath_frames::{Pose, Probe, Span, nalgebra::Isometry3};
/// use probepath_robot::{Joints, Model, MotionLimits};
/// use probepath_robot::step::{PathStep, StepSettings, Stepper};
///
/// let model = Model::ur5e();
/// let limits = MotionLimits::of_model(&model, Joints::splat(6, 5.0), Joints::splat(6, 50.0))?;
/// let start = Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0])?;
/// // FRAMES: a made-up holder: the probe's face 150 mm in front of the flange.
/// let flange_from_probe: Pose<_, Probe> = Pose::assume(Isometry3::translation(0.0, 0.0, 0.15));
/// let still = model.forward(&start) * flange_from_probe;
/// let mut stepper =
///     Stepper::at_rest(model, flange_from_probe, limits, Span::from_milliseconds(2), start, StepSettings::default())?;
/// // FRAMES: the probe, a hundredth of a micrometre along its own x axis.
/// let ahead = still * Pose::<Probe, Probe>::assume(Isometry3::translation(1e-8, 0.0, 0.0));
/// let stepped = stepper.step(&PathStep { still, ahead, freedom: 1.0 })?;
/// assert!(stepped.part == 1.0 && stepped.off.0 < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stepper {
    model: Model,
    flange_from_probe: Isometry3<f64>,
    limiter: Limiter,
    settings: StepSettings,
    dt: f64,
    /// What the last three steps left between the probe and its way, the newest first; none when the last command
    /// was not a step's.
    left: Option<[Vector6; 3]>,
    weakest: Weakest,
    posture: Posture,
}

/// What a tick begins with.
struct Look {
    /// Where the arm would be after another step like the last: the program is linear about there, as what a tick
    /// changes is then of second order, and a jerk that is kept is of third.
    reach: Reach,
    /// The joints' last step (rad, m).
    last: Joints,
    dt: f64,
    /// Whether the probe is led, and has no way to leave.
    slides: bool,
    /// The joints' speeds (rad/s, m/s).
    speeds: Joints,
    /// The least and the largest step of each joint (rad, m).
    ends: [Ends; MAX_JOINTS],
    planes: [Option<Near>; PLANES],
    /// How the smallest singular value grows, and the least it may grow in this tick; none far from a singularity.
    singular: Option<(Joints, f64)>,
}

/// The least and the largest step of a joint (rad, m), and what forbids more.
#[derive(Clone, Copy, Debug)]
struct Ends {
    low: f64,
    high: f64,
    low_by: Binding,
    high_by: Binding,
}

impl Ends {
    /// Not below `least`, as far as there is room.
    fn raise(&mut self, least: Option<f64>, by: Binding) {
        if let Some(least) = least.filter(|least| *least > self.low) {
            (self.low, self.low_by) = (least.min(self.high), by);
        }
    }

    /// Not above `most`, as far as there is room.
    fn lower(&mut self, most: Option<f64>, by: Binding) {
        if let Some(most) = most.filter(|most| *most < self.high) {
            (self.high, self.high_by) = (most.max(self.low), by);
        }
    }
}

impl Stepper {
    /// An arm at rest at `start`.
    ///
    /// # Errors
    /// When a setting cannot be, the limits cannot be kept, or the arm has fewer than six joints.
    pub fn at_rest(
        model: Model,
        flange_from_probe: Pose<Flange, Probe>,
        limits: MotionLimits,
        period: Span,
        start: Joints,
        settings: StepSettings,
    ) -> Result<Self, StepError> {
        settings.check()?;
        let joints = model.joints();
        if joints < LEAST_JOINTS || limits.joints() != joints {
            return Err(StepError::Joints { found: joints.min(limits.joints()) });
        }
        let limiter = Limiter::at_rest(limits, period, start)?;
        let flange_from_probe = *flange_from_probe.isometry();
        let weakest = Weakest::of(&model.reach(&start, &flange_from_probe).jacobian);
        let (posture, dt) = (Posture::at_rest(joints), period.seconds());
        Ok(Self { model, flange_from_probe, limiter, settings, dt, left: None, weakest, posture })
    }

    /// The next command toward a goal, remembered as sent.
    ///
    /// # Errors
    /// When a pose is not finite; nothing is remembered then.
    pub fn step(&mut self, goal: &PathStep) -> Result<Stepped, StepError> {
        if !(goal.still.is_finite() && goal.ahead.is_finite()) {
            return Err(StepError::NotFinite { what: "goal" });
        }
        let look = self.look(false);
        let (still, ahead) = (goal.still.isometry(), goal.ahead.isometry());
        let (way, to_still) = (between(still, ahead), to(&look.reach, still));
        let left = self.left.unwrap_or([to_still + look.reach.jacobian.velocity(&look.last); 3]);
        let keep = self.left_next(&left);
        let posture = self.pull(&look, goal.freedom);
        // What is new in this tick is gone with; of what is left, `keep` stays.
        let wanted =
            Wanted { way, move_on: to_still - keep + look.reach.jacobian.velocity(&look.last), posture };
        let exact = program::on_the_way(&look, &wanted);
        let stays = exact.is_ok();
        let Ok(answer) = exact.or_else(|_| program::off_the_way(&look, &wanted)) else {
            return Ok(self.braked(None));
        };
        let here = *self.limiter.position();
        let mut position = here.zip(&answer.step, |q, step| q + step);
        // FRAMES: between two poses of Probe in Base.
        let target = if answer.part > WHOLE { *ahead } else { still.lerp_slerp(ahead, answer.part) };
        let mut off = to(&self.model.reach(&position, &self.flange_from_probe), &target);
        if stays {
            (position, off) = self.refined(&look, &position, &off, &keep);
        }
        Ok(self.sent_unless_unsafe(&look, &answer, position, off))
    }

    /// The next command that moves the probe with `twist` (m/s, then rad/s, in Base's axes), or as nearly so as the
    /// limits allow: along a wall, not against it. Remembered as sent. The part it gives is 1.
    ///
    /// # Errors
    /// When the twist is not finite; nothing is remembered then.
    pub fn lead(&mut self, twist: &Vector6, freedom: f64) -> Result<Stepped, StepError> {
        if !twist.iter().all(|v| v.is_finite()) {
            return Err(StepError::NotFinite { what: "velocity" });
        }
        let look = self.look(true);
        let posture = self.pull(&look, freedom);
        let wanted = Wanted { way: Vector6::zeros(), move_on: twist * self.dt, posture };
        let Ok(answer) = program::off_the_way(&look, &wanted) else { return Ok(self.braked(None)) };
        let off = wanted.move_on - look.reach.jacobian.velocity(&answer.step);
        let position = self.limiter.position().zip(&answer.step, |q, step| q + step);
        let stepped = self.sent_unless_unsafe(&look, &answer, position, off);
        self.left = None;
        Ok(stepped)
    }

    /// The next command on the way to rest, remembered as sent: every joint brakes as hard as its limits allow.
    pub fn brake(&mut self) -> Joints {
        self.braked(None).position
    }

    /// A command that something else decided, limited and remembered as sent.
    ///
    /// # Errors
    /// When a number is not finite, or the number of joints is wrong.
    pub fn sent(&mut self, position: &Joints) -> Result<(), LimitsError> {
        self.limiter.limit(position)?;
        self.left = None;
        Ok(())
    }

    /// What was commanded, and the limits.
    pub const fn limiter(&self) -> &Limiter {
        &self.limiter
    }

    /// The smallest singular value of the probe's Jacobian, as of the last step.
    pub const fn smallest_singular_value(&self) -> f64 {
        self.weakest.value()
    }

    /// Kinematics and room at what was commanded last.
    fn look(&mut self, slides: bool) -> Look {
        let here = *self.limiter.position();
        let last = self.limiter.velocity().map(|v| v * self.dt);
        let there = here.zip(&last, |q, step| q + step);
        let reach = self.model.reach(&there, &self.flange_from_probe);
        self.weakest.follow(&reach.jacobian);
        let together = Together::of(&self.limiter, self.settings.brake_share, self.dt, slides);
        let speeds = self.limiter.limits().velocity;
        let planes = self.planes(&reach, &last, &together);
        let singular = self.singular(&reach, &there, &together);
        Look { ends: self.ends(&here, &together), reach, last, slides, dt: self.dt, speeds, planes, singular }
    }

    /// The least and largest steps: each joint's room, and less of it where a joint could not stay on the way while
    /// it stops before the end of its range.
    fn ends(&self, here: &Joints, together: &Together) -> [Ends; MAX_JOINTS] {
        let nothing = Binding::Singularity;
        let mut all = [Ends { low: 0.0, high: 0.0, low_by: nothing, high_by: nothing }; MAX_JOINTS];
        let (limits, slow) = (self.limiter.limits(), self.slow());
        for (joint, ends) in all.iter_mut().enumerate() {
            let (Some(room), Some(at)) = (self.limiter.room(joint), here.iter().nth(joint)) else { break };
            let by = |bound: JointBound| Binding::Joint { joint, bound };
            let (low_by, high_by) = (by(room.low_by), by(room.high_by));
            *ends = Ends { low: room.low - at, high: room.high - at, low_by, high_by };
            let mut axis = Joints::zeros(here.len());
            axis[joint] = 1.0;
            let upward = |distance: f64| together.least(&axis, distance);
            ends.raise(upward(at - limits.lower[joint]), by(JointBound::Position));
            let most = slow.map(|slow| slow * limits.velocity[joint] * self.dt);
            // No distance at all gives the brake's own step: it is not asked for more than that.
            ends.raise(most.and_then(|most| Some(upward(-1.0)?.min(-most))), Binding::Singularity);
            axis[joint] = -1.0;
            let downward = |distance: f64| together.least(&axis, distance).map(|least| -least);
            ends.lower(downward(limits.upper[joint] - at), by(JointBound::Position));
            ends.lower(most.and_then(|most| Some(downward(-1.0)?.max(most))), Binding::Singularity);
        }
        all
    }

    /// The part of their speed that the joints may have near a singularity.
    fn slow(&self) -> Option<f64> {
        let least = self.settings.least_singular;
        let part = (self.weakest.value() - least) / ((SLOW_SINGULAR - 1.0) * least);
        (part < 1.0).then(|| part.max(SLOWEST))
    }

    fn planes(&self, reach: &Reach, last: &Joints, together: &Together) -> [Option<Near>; PLANES] {
        let mut nearest = [None; PLANES];
        for (number, plane) in self.settings.workspace.planes().iter().enumerate() {
            let inward = plane.inward.vector();
            let mut row = Joints::zeros(reach.jacobian.len());
            for joint in 0..row.len() {
                row[joint] = reach.jacobian.column(joint).fixed_rows::<3>(0).dot(&inward);
            }
            let ahead = row.zip(last, |row, step| row * step).iter().sum::<f64>();
            let distance = Near::distance(plane, &reach.position) - ahead - self.settings.margin_m;
            if let Some(least) = together.least(&row, distance) {
                Near::keep(&mut nearest, Near { number, inward, least });
            }
        }
        nearest
    }

    fn singular(&self, reach: &Reach, there: &Joints, together: &Together) -> Option<(Joints, f64)> {
        let room = self.weakest.value() - self.settings.least_singular;
        let brakes_over = NEAR_BRAKE * self.weakest.fell() * together.ticks();
        if room > brakes_over.max((NEAR_SINGULAR - 1.0) * self.settings.least_singular) {
            return None;
        }
        let at = |joints: &Joints| self.model.reach(joints, &self.flange_from_probe).jacobian;
        let grows = self.weakest.gradient(there, &reach.jacobian, at);
        together.least(&grows, room).map(|least| (grows, least))
    }

    /// Where a redundant arm would like to go; nowhere with six joints.
    fn pull(&mut self, look: &Look, freedom: f64) -> Joints {
        let here = *self.limiter.position();
        if here.len() <= LEAST_JOINTS {
            return Joints::zeros(here.len());
        }
        let grows = look.singular.as_ref().map(|(grows, _)| grows);
        let part = if freedom.is_finite() { freedom.clamp(0.0, 1.0) } else { 0.0 };
        self.posture.pull(&here, self.limiter.limits(), grows, part, self.dt)
    }

    /// What may still be left between the probe and its way after the next tick: nothing when it was tiny; else what
    /// three equal poles make of it and its change, slow enough for the joints' jerk.
    fn left_next(&self, left: &[Vector6; 3]) -> Vector6 {
        if left.iter().all(|left| left.amax() < TINY) {
            return Vector6::zeros();
        }
        let dt = self.dt;
        let (v, before) = ((left[0] - left[1]) / dt, (left[1] - left[2]) / dt);
        let a = (v - before) / dt;
        let jerk = BACK_SHARE * self.limiter.limits().jerk.iter().fold(f64::INFINITY, f64::min);
        let size =
            |x: &Vector6| (x.fixed_rows::<3>(0).norm() / REACH_M).max(x.fixed_rows::<3>(3).norm()) / jerk;
        let slowest = size(&left[0]).cbrt().max((3.0 * size(&v)).sqrt()).max(3.0 * size(&a));
        let w = (1.0 / slowest).clamp(BACK_RAD_S.0, BACK_RAD_S.1);
        let jerk = -(left[0] * w.powi(3) + v * (3.0 * w * w) + a * (3.0 * w));
        left[0] + (v + (a + jerk * dt) * dt) * dt
    }

    /// Takes away what the first order left, where the room allows it: the joints, and what is then left.
    fn refined(&self, look: &Look, position: &Joints, off: &Vector6, keep: &Vector6) -> (Joints, Vector6) {
        let more = off - keep;
        let Some(step) = least_step(&look.reach.jacobian, &more, 0.0) else { return (*position, *off) };
        let here = self.limiter.position();
        let better = position.zip(&step, |q, step| q + step);
        let fits = (0..better.len()).all(|joint| {
            let step = better[joint] - here[joint];
            step >= look.ends[joint].low && step <= look.ends[joint].high
        });
        // The Jacobian of before the step is as good as that of after it for what is left: the product of both steps.
        if fits { (better, *keep) } else { (*position, *off) }
    }

    /// Remembers a step as sent; or brakes, if that step would not let the arm come to rest inside the workspace and
    /// away from singularities: what is linear in the program is exact here.
    fn sent_unless_unsafe(
        &mut self,
        look: &Look,
        answer: &Answer,
        position: Joints,
        off: Vector6,
    ) -> Stepped {
        let mut after = self.limiter;
        let Ok(limited) = after.limit(&position) else { return self.braked(None) };
        if let Some(binding) = self.unsafe_after(look, &after) {
            return self.braked(Some(binding));
        }
        let before = self.left.unwrap_or([off; 3]);
        (self.limiter, self.left) = (after, Some([off, before[0], before[1]]));
        let off = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
        let part = if answer.part > WHOLE { 1.0 } else { answer.part };
        let held = part < 1.0 || off.0 > 1e-7 || off.1 > 1e-7;
        Stepped { position: limited.position, part, binding: answer.binding.filter(|_| held), off }
    }

    fn unsafe_after(&self, look: &Look, after: &Limiter) -> Option<Binding> {
        let near = look.planes.iter().any(Option::is_some);
        // On its way it stays there: the joints' limits hold, and what it could leave its way for is behind it soon.
        let singular = look.slides
            && look.singular.is_some()
            && self.weakest.value() < 1.5 * self.settings.least_singular;
        if !near && !singular {
            return None;
        }
        let rest = self.model.reach(&after.brakes_at(), &self.flange_from_probe);
        let beyond = |plane: &Plane| {
            let (then, now) =
                (Near::distance(plane, &rest.position), Near::distance(plane, &look.reach.position));
            then < now.min(0.0)
        };
        if let Some(number) = self.settings.workspace.planes().iter().position(beyond) {
            return Some(Binding::Plane { number });
        }
        let weaker = || {
            let then = rest.jacobian.smallest_singular_value();
            then < self.weakest.value().min(self.settings.least_singular)
        };
        (singular && weaker()).then_some(Binding::Singularity)
    }

    /// Brakes, for want of a step.
    fn braked(&mut self, binding: Option<Binding>) -> Stepped {
        self.left = None;
        let position = self.limiter.brake();
        Stepped { position, part: 0.0, binding, off: (0.0, 0.0) }
    }
}

/// What is missing from where the probe is to a pose.
fn to(reach: &Reach, goal: &Isometry3<f64>) -> Vector6 {
    missing(reach, goal, goal.rotation.to_rotation_matrix().matrix())
}

#[cfg(test)]
mod tests;
