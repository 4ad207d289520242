//! [`Room`]: where a joint may be commanded next, and what stops it there.

use std::fmt;

use super::axis::{self, Bounds, Motion};

/// Which of a joint's limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointBound {
    /// Its range.
    Position,
    /// Its speed.
    Velocity,
    /// Its acceleration.
    Acceleration,
    /// Its jerk.
    Jerk,
}

impl fmt::Display for JointBound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
        })
    }
}

/// The next positions of one joint (rad, m) that keep every limit, now and for ever after: whatever lies between goes
/// through the [`Limiter`](super::Limiter) as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// The lowest.
    pub low: f64,
    /// The highest.
    pub high: f64,
    /// What forbids to go lower.
    pub low_by: JointBound,
    /// What forbids to go higher.
    pub high_by: JointBound,
}

/// Rounding of a position (parts of it): the room is so much narrower, so that no rounding leaves it.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The room of a joint. What `limit` gives for wishes far beyond is its ends, so they agree by construction.
pub(super) fn of(m: &Motion, b: &Bounds) -> Room {
    let (low, high) = axis::choices(m, b);
    let (mut room, least, most) = (rates(m, b, low, high), axis::safe(m, b, low), axis::safe(m, b, high));
    if least > low {
        room.low_by = JointBound::Position;
    }
    if most < high {
        room.high_by = JointBound::Position;
    }
    let (low, high) = (m.after(least).position, m.after(most).position);
    let inward = ROUNDING * m.position.abs().max(1.0);
    if high - low > 2.0 * inward {
        (room.low, room.high) = (low + inward, high - inward);
    } else {
        (room.low, room.high) = ((low + high) / 2.0, (low + high) / 2.0);
    }
    room
}

/// Which rate is the nearest at either end.
fn rates(m: &Motion, b: &Bounds, low: f64, high: f64) -> Room {
    // A thousandth of the jerk: far above rounding.
    let near = |a: f64, bound: f64| (a - bound).abs() <= 1e-3 * b.jerk;
    let which = |a: f64, acceleration: f64, jerk: f64| {
        if near(a, jerk) {
            JointBound::Jerk
        } else if near(a, acceleration) {
            JointBound::Acceleration
        } else {
            JointBound::Velocity
        }
    };
    Room {
        low,
        high,
        low_by: which(low, -b.acceleration, m.acceleration - b.jerk),
        high_by: which(high, b.acceleration, m.acceleration + b.jerk),
    }
}
