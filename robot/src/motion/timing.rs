//! Timing along a path: how fast, where, so that every joint keeps its limits.
//!
//! With joints `q(s)` over the length `s` of the path, and `'` for `d/ds`:
//!
//! ```text
//! velocity      q' v
//! acceleration  q' a + q'' v^2
//! jerk          q' j + 3 q'' v a + q''' v^3
//! ```
//!
//! [`PathLimits`] turns the joints' limits into a highest speed at every place and one acceleration and jerk of `s`
//! for the whole path; [`PathClock`] moves `s` as fast as these allow, tick by tick, and looks ahead only as far as it
//! takes to slow down: local, deterministic, no heap in a step. Slowing down, pausing and resuming change the speed
//! along the path, nothing else: `s` never goes back, and what is commanded lies on the path.

mod ramp;

use thiserror::Error;

use crate::{Joints, MotionLimits};
use ramp::{Bounds, Rate};

/// Parts of a joint's limit: of the acceleration, for `q'' v^2` and `q' a`; of the jerk, for its three terms.
const HALF: f64 = 0.5;
const THIRD: f64 = 1.0 / 3.0;
/// Part of the velocity limit: between two postures the slope is a little more than at either (measured: 0.4 %).
const INSIDE: f64 = 0.98;
/// How the path is to be driven, besides the joints' limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSpeed {
    /// Speed along the path (m/s).
    pub speed: f64,
    /// Largest acceleration along it (m/s^2).
    pub acceleration: f64,
    /// Largest jerk along it (m/s^3).
    pub jerk: f64,
}

impl PathSpeed {
    /// `speed` (m/s), gently: 0.2 m/s^2 and 4 m/s^3.
    pub const fn gentle(speed: f64) -> Self {
        Self { speed, acceleration: 0.2, jerk: 4.0 }
    }
}

/// Why a path has no timing.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TimingError {
    /// Too few postures.
    #[error("{found} postures give no timing: at least 4 are needed")]
    TooFew {
        /// How many came.
        found: usize,
    },
    /// A number that cannot be.
    #[error("{name} = {value} cannot be: it has to be finite and above zero")]
    NotPositive {
        /// What it is.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A posture with another number of joints than the limits, or with a number that is not finite.
    #[error("posture {index} does not fit the limits: wrong number of joints, or one is not finite")]
    Posture {
        /// Counted from zero.
        index: usize,
    },
}

/// How fast the path may be driven, place by place.
#[derive(Clone, Debug, PartialEq)]
pub struct PathLimits {
    step: f64,
    /// Highest speed at each posture (m/s).
    speeds: Vec<f64>,
    bounds: (f64, f64),
}

impl PathLimits {
    /// From the `postures` along the path, `step` metres apart, and the joints' limits.
    ///
    /// The derivatives are differences of neighbouring postures, the largest of three neighbours, because between
    /// postures they may be larger than at them.
    ///
    /// # Errors
    /// When there are fewer than four postures, one does not fit the limits, or a number is not above zero.
    pub fn new(
        step: f64,
        postures: &[Joints],
        limits: &MotionLimits,
        wanted: PathSpeed,
    ) -> Result<Self, TimingError> {
        let PathSpeed { speed, acceleration, jerk } = wanted;
        for (name, value) in
            [("step", step), ("speed", speed), ("acceleration", acceleration), ("jerk", jerk)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(TimingError::NotPositive { name, value });
            }
        }
        if postures.len() < 4 {
            return Err(TimingError::TooFew { found: postures.len() });
        }
        let fits = |q: &Joints| q.len() == limits.velocity.len() && q.is_finite();
        if let Some(index) = postures.iter().position(|q| !fits(q)) {
            return Err(TimingError::Posture { index });
        }
        Ok(Self::of(step, &slopes(step, postures), limits, wanted))
    }

    /// The same speed over `length`, whatever moves along it: for the time of a motion that is already planned, in
    /// seconds for metres.
    ///
    /// # Errors
    /// When a number is not above zero.
    pub fn uniform(length: f64, wanted: PathSpeed) -> Result<Self, TimingError> {
        let still = Joints::zeros(0);
        let limits =
            MotionLimits { lower: still, upper: still, velocity: still, acceleration: still, jerk: still };
        Self::new(length / 3.0, &[still; 4], &limits, wanted)
    }

    fn of(step: f64, slopes: &[Slope], limits: &MotionLimits, wanted: PathSpeed) -> Self {
        let steepest = slopes.iter().fold(wanted, |least, slope| PathSpeed {
            acceleration: least.acceleration.min(HALF * least_of(&limits.acceleration, &slope[0])),
            jerk: least.jerk.min(THIRD * least_of(&limits.jerk, &slope[0])),
            ..least
        });
        let PathSpeed { acceleration, jerk, .. } = steepest;
        let speeds = slopes.iter().map(|slope| {
            let bends = |power: f64, part: f64, limit: &Joints, slope: &Joints| {
                (part * least_of(limit, slope)).powf(1.0 / power)
            };
            wanted
                .speed
                .min(INSIDE * least_of(&limits.velocity, &slope[0]))
                .min(bends(2.0, HALF, &limits.acceleration, &slope[1]))
                .min(bends(3.0, THIRD, &limits.jerk, &slope[2]))
                // 3 q'' v a <= jerk / 3
                .min(THIRD * THIRD * least_of(&limits.jerk, &slope[1]) / acceleration)
        });
        Self { step, speeds: speeds.collect(), bounds: (acceleration, jerk) }
    }

    /// The path's length (m).
    pub fn length(&self) -> f64 {
        self.step * (self.speeds.len() - 1) as f64
    }

    /// The highest speed at `s` (m/s): the lower of the two neighbours'.
    pub fn speed_at(&self, s: f64) -> f64 {
        let place = s.max(0.0) / self.step;
        let (below, above) = (place.floor() as usize, place.ceil() as usize);
        self.at(below).min(self.at(above))
    }

    /// The slowest place, as distance along the path (m) and speed there (m/s).
    pub fn slowest(&self) -> (f64, f64) {
        let first = (0.0, f64::INFINITY);
        let of = self.speeds.iter().enumerate().map(|(i, v)| (i as f64 * self.step, *v));
        of.fold(first, |least, here| if here.1 < least.1 { here } else { least })
    }

    /// Acceleration (m/s^2) and jerk (m/s^3) along the path.
    pub const fn acceleration_and_jerk(&self) -> (f64, f64) {
        self.bounds
    }

    /// Past the last posture there is nowhere to go.
    fn at(&self, index: usize) -> f64 {
        self.speeds.get(index).copied().unwrap_or(0.0)
    }
}

/// The largest first three derivatives of every joint around one posture.
type Slope = [Joints; 3];

fn slopes(step: f64, postures: &[Joints]) -> Vec<Slope> {
    let last = postures.len() - 1;
    // Ends are repeated, as they are at rest.
    let at = |i: isize| &postures[i.clamp(0, last as isize) as usize];
    let combine = |terms: &[(isize, f64)], i: isize, scale: f64| {
        let zero = Joints::zeros(postures[0].len());
        terms
            .iter()
            .fold(zero, |sum, (off, w)| sum.zip(at(i + off), |a, b| a + w * b))
            .map(|x| (x / scale).abs())
    };
    // Four postures at least: there is always room from one after the first to two before the last.
    let edge = |i: isize, room: isize| i.clamp(1, last as isize - room);
    let own: Vec<Slope> = (0..=last as isize)
        .map(|i| {
            [
                combine(&[(-1, -1.0), (1, 1.0)], edge(i, 1), 2.0 * step),
                combine(&[(-1, 1.0), (0, -2.0), (1, 1.0)], edge(i, 1), step * step),
                combine(&[(-1, -1.0), (0, 3.0), (1, -3.0), (2, 1.0)], edge(i, 2), step.powi(3)),
            ]
        })
        .collect();
    (0..=last)
        .map(|i| {
            let around = &own[i.saturating_sub(1)..=(i + 1).min(last)];
            let largest = |order: usize| {
                around.iter().fold(Joints::zeros(postures[0].len()), |most, s| most.zip(&s[order], f64::max))
            };
            [largest(0), largest(1), largest(2)]
        })
        .collect()
}

/// The least of `limit / slope` over the joints; infinite where nothing moves.
fn least_of(limit: &Joints, slope: &Joints) -> f64 {
    limit
        .zip(slope, |limit, slope| if slope > 0.0 { limit / slope } else { f64::INFINITY })
        .iter()
        .fold(f64::INFINITY, f64::min)
}

/// One speed that follows a wanted one as quickly as its bounds on acceleration and jerk allow, in closed form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedRamp {
    rate: Rate,
    bounds: Bounds,
}

impl SpeedRamp {
    /// At rest. Bounds (1/s^2 and 1/s^3 of the way's unit) that are not above zero let nothing move.
    pub fn at_rest(acceleration: f64, jerk: f64) -> Self {
        let positive = |bound: f64| if bound > 0.0 { bound } else { f64::MIN_POSITIVE };
        let bounds = Bounds { acceleration: positive(acceleration), jerk: positive(jerk) };
        Self { rate: Rate::default(), bounds }
    }

    /// Toward `wanted` for one tick of `dt` seconds; the mean speed of the tick. A wish that is not finite is rest.
    pub fn step(&mut self, wanted: f64, dt: f64) -> f64 {
        let target = if wanted.is_finite() { wanted } else { 0.0 };
        let (way, rate) = ramp::after(&self.rate, target, &self.bounds, dt);
        self.rate = rate;
        way / dt
    }
}

/// Where along the path the motion is; moved on by one tick at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct PathClock {
    limits: PathLimits,
    s: f64,
    rate: Rate,
    bounds: Bounds,
    /// Slowing down for a place ahead: the speed there (m/s), and the place (m). Kept until the place is passed, so
    /// that the jerk does not alternate on the way.
    slowing: Option<(f64, f64)>,
}

impl PathClock {
    /// At rest at the start.
    pub const fn new(limits: PathLimits) -> Self {
        let bounds = Bounds { acceleration: limits.bounds.0, jerk: limits.bounds.1 };
        Self { limits, s: 0.0, rate: Rate { speed: 0.0, acceleration: 0.0 }, bounds, slowing: None }
    }

    /// Moves on by one tick of `dt` seconds, at `wanted` m/s where the path allows it (zero: slow down to rest, and
    /// wait), and gives the distance along the path (m). Speeds below zero, and NaN, count as zero.
    pub fn step(&mut self, wanted: f64, dt: f64) -> f64 {
        let wanted = if wanted > 0.0 { wanted } else { 0.0 };
        if self.slowing.is_some_and(|(_, place)| self.s >= place) {
            self.slowing = None;
        }
        let mut target = wanted.min(self.limits.speed_at(self.s));
        if let Some((speed, _)) = self.slowing {
            target = target.min(speed);
        }
        let (mut way, mut rate) = ramp::after(&self.rate, target, &self.bounds, dt);
        while let Some((speed, place)) = self.too_fast(self.s + way, &rate, target) {
            self.slowing = Some((speed, place));
            let slow = ramp::after(&self.rate, speed, &self.bounds, dt);
            (way, rate) = self.just_in_time((way, rate), slow, target.min(speed), place, dt);
            target = speed;
        }
        // Rounding must not turn it round.
        self.s = (self.s + way.max(0.0)).min(self.limits.length());
        self.rate = Rate { speed: rate.speed.max(0.0), ..rate };
        self.s
    }

    /// The latest tick from which the `place` ahead can still be slowed down for: between the `fast` one, which is too
    /// late, and the `slow` one. What lies between two ticks within the bounds is within them. A whole tick too early
    /// would stop more than a millimetre short of the end when driven hard.
    fn just_in_time(
        &self,
        fast: (f64, Rate),
        slow: (f64, Rate),
        speed: f64,
        place: f64,
        dt: f64,
    ) -> (f64, Rate) {
        let between = |part: f64| {
            let of = |slow: f64, fast: f64| slow + part * (fast - slow);
            let rate = Rate {
                speed: of(slow.1.speed, fast.1.speed),
                acceleration: of(slow.1.acceleration, fast.1.acceleration),
            };
            (of(slow.0, fast.0), rate)
        };
        // A nanometre is kept for rounding, and for the speed that a tick still has at the place.
        let in_time = |tick: &(f64, Rate)| {
            self.s + tick.0 + ramp::distance(&tick.1, speed, &self.bounds) + speed * dt < place - 1e-9
        };
        let (mut early, mut late) = (0.0, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (early + late);
            if in_time(&between(middle)) {
                early = middle;
            } else {
                late = middle;
            }
        }
        between(early)
    }

    /// The first place ahead that is slower than `target` and could not be slowed down for any more from `s` and
    /// `rate`: its speed and place.
    fn too_fast(&self, s: f64, rate: &Rate, target: f64) -> Option<(f64, f64)> {
        let stop = ramp::distance(rate, 0.0, &self.bounds);
        let from = (s / self.limits.step).ceil() as usize;
        let until = (((s + stop) / self.limits.step).ceil() as usize).min(self.limits.speeds.len() - 1);
        (from..=until).find_map(|k| {
            let place = k as f64 * self.limits.step;
            let end = k + 1 == self.limits.speeds.len();
            let speed = if end { 0.0 } else { self.limits.at(k) };
            let late = speed < target && ramp::distance(rate, speed, &self.bounds) > place - s;
            late.then_some((speed, place))
        })
    }

    /// Distance along the path (m).
    pub const fn at(&self) -> f64 {
        self.s
    }

    /// Speed along the path (m/s).
    pub const fn speed(&self) -> f64 {
        self.rate.speed
    }

    /// Whether it rests.
    pub fn is_at_rest(&self) -> bool {
        self.rate == Rate::default()
    }

    /// Whether it has arrived: at rest, after slowing down for the end, of which it stops short by less than 0.05 mm.
    pub fn has_arrived(&self) -> bool {
        let end = self.limits.length() - HALF * self.limits.step;
        self.is_at_rest()
            && (self.s >= self.limits.length() || self.slowing.is_some_and(|(_, place)| place > end))
    }

    /// The limits it keeps.
    pub const fn limits(&self) -> &PathLimits {
        &self.limits
    }
}

#[cfg(test)]
mod tests;
