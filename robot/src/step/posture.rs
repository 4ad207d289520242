//! [`Posture`]: where a redundant arm moves its joints while the probe does what it is told.

use crate::{Joints, MotionLimits};

/// How quickly a joint leaves its limit (1/s), for the whole of half its range.
const RATE: f64 = 0.5;
/// How quickly the smallest singular value is made to grow (rad/s for a slope of 1).
const CLIMB: f64 = 0.5;
/// The most of a joint's speed that is used.
const SHARE: f64 = 0.1;
/// How quickly the pull itself changes (rad/s of its filter): it must not jerk.
const SMOOTH: f64 = 5.0;

/// A velocity of the joints that changes smoothly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posture {
    velocity: Joints,
    acceleration: Joints,
}

impl Posture {
    pub(super) const fn at_rest(joints: usize) -> Self {
        Self { velocity: Joints::zeros(joints), acceleration: Joints::zeros(joints) }
    }

    /// The velocity (rad/s, m/s) that the joints would have if the probe were free: away from their limits, steeply
    /// near them, and from singularities; `part` of it.
    pub(super) fn pull(
        &mut self,
        here: &Joints,
        limits: &MotionLimits,
        grows: Option<&Joints>,
        part: f64,
        dt: f64,
    ) -> Joints {
        let w = SMOOTH * dt;
        for joint in 0..here.len() {
            let half = (limits.upper[joint] - limits.lower[joint]) / 2.0;
            let off = (here[joint] - limits.lower[joint]) / half - 1.0;
            // A joint that turns for ever has nothing to keep away from.
            let back = if half.is_finite() { -RATE * half * off.powi(3) } else { 0.0 };
            let most = SHARE * limits.velocity[joint];
            let wanted = (back + grows.map_or(0.0, |grows| CLIMB * grows[joint])).clamp(-most, most);
            let (v, a) = (self.velocity[joint], self.acceleration[joint] * dt);
            let change = (a + w * w * (part * wanted - v)) / (1.0 + 2.0 * w + w * w);
            self.acceleration[joint] = change / dt;
            self.velocity[joint] = v + change;
        }
        self.velocity
    }
}
