//! What a joint's *commanded* position may do from tick to tick: [`MotionLimits`], and [`Limiter`], which has the
//! last word on every command.
//!
//! Velocity, acceleration and jerk are the backward finite differences of the commanded positions at the tick,
//! `v = Δq/dt`, `a = Δv/dt`, `j = Δa/dt`: exactly what anybody can read back from an exam file, starts, stops and
//! brakes included. A command that is within the limits goes through to the bit; a command beyond them is replaced
//! by the nearest one that is within, and from which the joint can still come to rest within them (the look-ahead
//! of libfranka's `rate_limiting.h`, made exact for the tick's own arithmetic in the private module `axis`).

pub(crate) mod axis;
mod room;

use probepath_frames::Span;
use thiserror::Error;

use crate::{Joints, Model};
use axis::{Bounds, Motion};
pub use room::{JointBound, Room};

/// How far inside the limits the limiter stays, as a fraction: room for the rounding of the third difference of
/// positions of some radians (7e-8 of 50 rad/s³ at 1 kHz).
const INSIDE: f64 = 1e-6;

/// What the commanded position of each joint may do, in rad (or m) and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Lowest position; minus infinity where a joint turns for ever.
    pub lower: Joints,
    /// Highest position; infinity where a joint turns for ever.
    pub upper: Joints,
    /// Largest speed.
    pub velocity: Joints,
    /// Largest acceleration.
    pub acceleration: Joints,
    /// Largest jerk.
    pub jerk: Joints,
}

/// Limits that no motion can keep, or a command that cannot be limited.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LimitsError {
    /// The five lists differ in length, or do not fit the arm.
    #[error("limits for {found} joints, the arm has {joints}: give one number per joint in every list")]
    Joints {
        /// How many came.
        found: usize,
        /// How many were wanted.
        joints: usize,
    },
    /// A lower limit that is not below the upper, or NaN.
    #[error("joint {joint}: the lower limit {lower} is not below the upper limit {upper}")]
    Range {
        /// The joint, counted from zero.
        joint: usize,
        /// Lower limit (rad, m).
        lower: f64,
        /// Upper limit (rad, m).
        upper: f64,
    },
    /// A rate that is not a positive, finite number.
    #[error("joint {joint}: the {what} limit is {value}; it must be positive and finite")]
    Rate {
        /// The joint, counted from zero.
        joint: usize,
        /// Which rate.
        what: &'static str,
        /// The number found.
        value: f64,
    },
    /// A joint that takes longer to brake than anybody can look ahead.
    #[error(
        "joint {joint} takes {ticks:.0} ticks to brake, more than {most}: raise its acceleration and jerk"
    )]
    SlowBrake {
        /// The joint, counted from zero.
        joint: usize,
        /// How long it takes.
        ticks: f64,
        /// The most allowed.
        most: usize,
    },
    /// A tick that takes no time, or more than a second.
    #[error("a tick of {period_s} s: it must be longer than zero and at most 1 s")]
    Period {
        /// The period (s).
        period_s: f64,
    },
    /// A command that is NaN or infinite: refused, never clamped.
    #[error("joint {joint} was commanded to {value}: a command must be finite")]
    NotFinite {
        /// The joint, counted from zero.
        joint: usize,
        /// The number found.
        value: f64,
    },
}

impl MotionLimits {
    /// A model's ranges and speeds, with accelerations and jerks, which no URDF has.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn of_model(model: &Model, acceleration: Joints, jerk: Joints) -> Result<Self, LimitsError> {
        let joints = model.joints();
        let mut limits = Self {
            lower: Joints::zeros(joints),
            upper: Joints::zeros(joints),
            velocity: Joints::zeros(joints),
            acceleration,
            jerk,
        };
        for (joint, limit) in model.limits().iter().take(limits.joints()).enumerate() {
            limits.lower[joint] = limit.lower;
            limits.upper[joint] = limit.upper;
            limits.velocity[joint] = limit.velocity;
        }
        limits.check()?;
        Ok(limits)
    }

    /// How many joints.
    pub const fn joints(&self) -> usize {
        self.velocity.len()
    }

    /// The same limits, where every rate is multiplied by `fraction` (above 0, at most 1).
    pub fn scaled(&self, fraction: f64) -> Self {
        let slower = |rates: &Joints| rates.map(|rate| rate * fraction);
        Self {
            lower: self.lower,
            upper: self.upper,
            velocity: slower(&self.velocity),
            acceleration: slower(&self.acceleration),
            jerk: slower(&self.jerk),
        }
    }

    /// Whether a motion can keep them.
    ///
    /// # Errors
    /// When the lists differ in length, a range is empty or a rate is not positive and finite.
    pub fn check(&self) -> Result<(), LimitsError> {
        let joints = self.joints();
        let lists = [&self.lower, &self.upper, &self.acceleration, &self.jerk];
        if let Some(other) = lists.iter().find(|list| list.len() != joints) {
            return Err(LimitsError::Joints { found: other.len(), joints });
        }
        for joint in 0..joints {
            let (lower, upper) = (self.lower[joint], self.upper[joint]);
            // NaN compares as nothing, so the question is put positively.
            if lower.is_nan() || upper.is_nan() || lower >= upper {
                return Err(LimitsError::Range { joint, lower, upper });
            }
            let rates = [
                ("velocity", self.velocity[joint]),
                ("acceleration", self.acceleration[joint]),
                ("jerk", self.jerk[joint]),
            ];
            if let Some((what, value)) =
                rates.into_iter().find(|(_, rate)| !(rate.is_finite() && *rate > 0.0))
            {
                return Err(LimitsError::Rate { joint, what, value });
            }
        }
        Ok(())
    }

    /// Joint `joint` in units of one tick, a little inside.
    fn bounds(&self, joint: usize, dt: f64) -> Bounds {
        let within = 1.0 - INSIDE;
        Bounds {
            lower: self.lower[joint],
            upper: self.upper[joint],
            velocity: self.velocity[joint] * dt * within,
            acceleration: self.acceleration[joint] * dt * dt * within,
            jerk: self.jerk[joint] * dt * dt * dt * within,
        }
    }
}

/// A command after the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limited {
    /// The joint positions that may be sent (rad, m).
    pub position: Joints,
    /// How far the joint that was changed most is from what was wanted (rad, m); zero when the command went through.
    pub changed: f64,
    /// Which joint that is.
    pub joint: usize,
}

/// Remembers the last three commanded positions, which is all that the finite differences need, and limits the next.
#[derive(Clone, Copy, Debug)]
pub struct Limiter {
    limits: MotionLimits,
    dt: f64,
    /// The last commanded position, the one before, and the one before that.
    last: [Joints; 3],
}

impl Limiter {
    /// For an arm at rest at `position`.
    ///
    /// # Errors
    /// When the limits cannot be kept, the period is no period, or the position does not fit.
    pub fn at_rest(limits: MotionLimits, period: Span, position: Joints) -> Result<Self, LimitsError> {
        limits.check()?;
        let dt = period.seconds();
        if dt <= 0.0 || dt > 1.0 {
            return Err(LimitsError::Period { period_s: dt });
        }
        finite(&position, limits.joints())?;
        for joint in 0..limits.joints() {
            let ticks = limits.bounds(joint, dt).ticks_to_brake();
            if ticks > axis::LONGEST_BRAKE as f64 {
                return Err(LimitsError::SlowBrake { joint, ticks, most: axis::LONGEST_BRAKE });
            }
        }
        Ok(Self { limits, dt, last: [position; 3] })
    }

    /// The nearest command to `wanted` that may be sent, and which is then remembered as sent.
    ///
    /// # Errors
    /// When a number is NaN or infinite, or the number of joints is wrong; nothing is remembered then.
    pub fn limit(&mut self, wanted: &Joints) -> Result<Limited, LimitsError> {
        finite(wanted, self.limits.joints())?;
        let mut limited = Limited { position: *wanted, changed: 0.0, joint: 0 };
        for joint in 0..wanted.len() {
            let bounds = self.limits.bounds(joint, self.dt);
            let position = axis::limit(&self.motion(joint), &bounds, wanted[joint]);
            let changed = (position - wanted[joint]).abs();
            limited.position[joint] = position;
            if changed > limited.changed {
                (limited.changed, limited.joint) = (changed, joint);
            }
        }
        self.remember(limited.position);
        Ok(limited)
    }

    /// The next command on the way to rest, remembered as sent: every joint brakes as hard as its limits allow.
    pub fn brake(&mut self) -> Joints {
        let mut next = self.last[0];
        for joint in 0..next.len() {
            let motion = self.motion(joint);
            next[joint] = motion.after(axis::brake(&motion, &self.limits.bounds(joint, self.dt))).position;
        }
        self.remember(next);
        next
    }

    /// Where each joint would come to rest if it braked from here.
    pub fn brakes_at(&self) -> Joints {
        let mut end = self.last[0];
        for joint in 0..end.len() {
            end[joint] = axis::rest(&self.motion(joint), &self.limits.bounds(joint, self.dt)).at;
        }
        end
    }

    /// Where `joint` may be commanded next; `None` for a joint that is not there.
    pub fn room(&self, joint: usize) -> Option<Room> {
        let there = joint < self.limits.joints();
        there.then(|| room::of(&self.motion(joint), &self.limits.bounds(joint, self.dt)))
    }

    /// Whether the last three commanded positions are the same.
    pub fn is_at_rest(&self) -> bool {
        self.last[0] == self.last[1] && self.last[1] == self.last[2]
    }

    /// The last commanded position (rad, m).
    pub const fn position(&self) -> &Joints {
        &self.last[0]
    }

    /// The commanded velocity (rad/s, m/s).
    pub fn velocity(&self) -> Joints {
        self.last[0].zip(&self.last[1], |now, before| (now - before) / self.dt)
    }

    /// The commanded acceleration (rad/s², m/s²).
    pub fn acceleration(&self) -> Joints {
        let before = self.last[1].zip(&self.last[2], |now, before| (now - before) / self.dt);
        self.velocity().zip(&before, |now, before| (now - before) / self.dt)
    }

    /// The limits that it holds.
    pub const fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    fn motion(&self, joint: usize) -> Motion {
        let [now, before, earlier] = [self.last[0][joint], self.last[1][joint], self.last[2][joint]];
        Motion { position: now, velocity: now - before, acceleration: (now - before) - (before - earlier) }
    }

    const fn remember(&mut self, sent: Joints) {
        self.last = [sent, self.last[0], self.last[1]];
    }
}

/// Whether a command fits and is finite.
fn finite(position: &Joints, joints: usize) -> Result<(), LimitsError> {
    if position.len() != joints {
        return Err(LimitsError::Joints { found: position.len(), joints });
    }
    match position.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((joint, value)) => Err(LimitsError::NotFinite { joint, value }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
