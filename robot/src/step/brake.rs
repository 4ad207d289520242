//! [`Together`]: the brake in which all joints slow down in the same ratio, so that the probe comes to rest on its way.

use crate::limits::axis::{self, Bounds, Motion};
use crate::{Joints, Limiter};

/// The least and, when the probe may leave its direction, the whole part of what the joints could do toward one
/// direction that its brake counts on.
const LEAST: f64 = 0.2;

/// How the arm moves, and how it may brake; in ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Together {
    /// The last step of each joint (rad, m), and its change.
    step: Joints,
    change: Joints,
    /// Share of the joints' acceleration and jerk.
    acceleration: Joints,
    jerk: Joints,
    /// How fast the ratio of all joints may change: acceleration and jerk.
    ratio: (f64, f64),
    /// Whether the probe may leave its direction.
    slides: bool,
}

impl Together {
    /// From what was commanded last, at this share of the joints' acceleration and jerk: what is left serves to stay
    /// on the path.
    pub(super) fn of(limiter: &Limiter, share: f64, dt: f64, slides: bool) -> Self {
        let (step, change) =
            (limiter.velocity().map(|v| v * dt), limiter.acceleration().map(|a| a * dt * dt));
        let acceleration = limiter.limits().acceleration.map(|most| share * most * dt * dt);
        let jerk = limiter.limits().jerk.map(|most| share * most * dt * dt * dt);
        let least = |most: &Joints| {
            most.zip(&step, |most, step| most / step.abs().max(1e-15)).iter().fold(f64::INFINITY, f64::min)
        };
        let ratio = (least(&acceleration), least(&jerk));
        Self { step, change, acceleration, jerk, ratio, slides }
    }

    /// No fewer ticks than all joints need to come to rest together.
    pub(super) fn ticks(&self) -> f64 {
        let (acceleration, jerk) = self.ratio;
        1.0 / acceleration + acceleration / jerk
    }

    /// The least value of `row · step` from which `distance + row · (way to rest)` is not below zero; never more than
    /// the brake itself reaches. `None` where the distance is out of question.
    pub(super) fn least(&self, row: &Joints, distance: f64) -> Option<f64> {
        let along = |of: &Joints| row.zip(of, |row, x| row * x).iter().sum::<f64>();
        let reach = |of: &Joints| row.zip(of, |row, x| row.abs() * x).iter().sum::<f64>();
        let now = Motion { position: 0.0, velocity: along(&self.step), acceleration: along(&self.change) };
        let rate = |ratio: f64, most: f64| {
            let part = if self.slides { most } else { now.velocity.abs() * ratio };
            part.clamp(LEAST * most, most).max(f64::MIN_POSITIVE)
        };
        let bounds = Bounds {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            velocity: f64::INFINITY,
            acceleration: rate(self.ratio.0, reach(&self.acceleration)),
            jerk: rate(self.ratio.1, reach(&self.jerk)),
        };
        if distance > farthest(&now, &bounds) {
            return None;
        }
        let chosen = axis::brake(&now, &bounds);
        let rests = |chosen: f64| axis::rest(&now.after(chosen), &bounds).at;
        let until = rests(chosen);
        // The slope, by a change that the next tick can still make.
        let gain = ((rests(chosen + bounds.jerk) - until) / bounds.jerk).max(1.0);
        let brakes = now.velocity + chosen;
        Some((brakes - (distance + until) / gain).min(brakes))
    }
}

/// Further than this a motion does not come, however it goes on for a tick: generous.
fn farthest(m: &Motion, b: &Bounds) -> f64 {
    let a = m.acceleration.abs() + b.jerk;
    let speed = m.velocity.abs() + a + a * a / b.jerk;
    speed * (a / b.jerk + speed / b.acceleration + b.acceleration / b.jerk + 5.0)
}
