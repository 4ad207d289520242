//! Timing along a path: the fastest motion that keeps every joint's limits, and its clock.
//!
//! With joints `q(s)` over the length `s` of the path, and `'` for `d/ds`:
//!
//! ```text
//! velocity      q' v
//! acceleration  q' a + q'' v^2
//! jerk          q' j + 3 q'' v a + q''' v^3
//! ```
//!
//! [`PathLimits`] finds the fastest speed over the distance within the joints' limits and those of the path itself
//! (the private module `fastest`), and holds it against the limits everywhere, between the postures too (`check`).
//! [`PathClock`] follows that motion tick by tick, no heap in a step. Slower, pause and resume scale its time: `s`
//! never goes back, what is commanded lies on the path, and no limit is crossed on the way (`clock`).

mod bands;
mod check;
mod clock;
mod fastest;
mod grid;
mod profile;
mod ramp;
mod way;

use thiserror::Error;

pub use clock::PathClock;

use crate::{Joints, MotionLimits};
use fastest::{Fastest, Start};
use profile::{Launch, Profile};
use ramp::{Bounds, Rate};
use way::Way;

/// Part of the joints' accelerations and jerks that the motion uses: what is left lets an operator slow it down
/// wherever it is.
const RESERVE: (f64, f64) = (0.995, 0.98);
/// How often the fastest motion is looked for again, with what the check found taken off where it found it.
const ROUNDS: usize = 3;
/// A cell this near to its limits needs no further look.
const NEAR: f64 = 1.001;
/// How much more than what was found is taken off.
const EAGER: f64 = 1.3;
/// On line the path is slowed down with up to so many times its own acceleration and jerk: a stop should be quick.
const BRAKE: (f64, f64) = (5.0, 10.0);
/// The same where no joints are known that would say when it is too much.
const BRAKE_UNIFORM: f64 = 2.0;

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

/// The shares of limits that a motion uses.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MotionBounds {
    velocity: f64,
    acceleration: f64,
    jerk: f64,
}

impl MotionBounds {
    const ONE: Self = Self { velocity: 1.0, acceleration: 1.0, jerk: 1.0 };

    const fn max(&self, other: &Self) -> Self {
        Self {
            velocity: self.velocity.max(other.velocity),
            acceleration: self.acceleration.max(other.acceleration),
            jerk: self.jerk.max(other.jerk),
        }
    }

    /// How many times slower the motion would have to be to keep them.
    fn slower(&self) -> f64 {
        self.velocity.max(self.acceleration.sqrt()).max(self.jerk.cbrt())
    }

    /// Limits that were found crossed here are asked to be kept by as much more; others are left.
    fn tighten(&mut self, found: &Self) {
        let more = |share: f64| if share > 1.0 { 1.0 + EAGER * (share - 1.0) } else { 1.0 };
        self.velocity *= more(found.velocity);
        self.acceleration *= more(found.acceleration);
        self.jerk *= more(found.jerk);
    }
}

/// How fast the path is driven: the fastest motion from rest to rest along it.
#[derive(Clone, Debug, PartialEq)]
pub struct PathLimits {
    step: f64,
    /// Highest steady speed at each posture (m/s).
    speeds: Vec<f64>,
    wanted: PathSpeed,
    /// What slowing down on line may use.
    brake: PathSpeed,
    way: Way,
    profile: Profile,
}

impl PathLimits {
    /// From the `postures` along the path, `step` metres apart, the joints' limits, and the path's own.
    ///
    /// # Errors
    /// When there are fewer than four postures, one does not fit the limits, or a number is not above zero.
    pub fn new(
        step: f64,
        postures: &[Joints],
        limits: &MotionLimits,
        wanted: PathSpeed,
    ) -> Result<Self, TimingError> {
        let way = checked(step, postures, limits, &wanted)?;
        let speeds = (0..postures.len()).map(|i| {
            let piece = i.min(postures.len() - 2);
            way.steady(&way.on(piece, step * (i - piece) as f64), wanted.speed)
        });
        let speeds: Vec<f64> = speeds.collect();
        let profile = fastest(&way.within(RESERVE), &wanted, &speeds);
        let PathSpeed { speed, acceleration, jerk } = wanted;
        let brake = PathSpeed { speed, acceleration: BRAKE.0 * acceleration, jerk: BRAKE.1 * jerk };
        Ok(Self { step, speeds, wanted, brake, way, profile })
    }

    /// The same speed over `length`, whatever moves along it: for the time of a motion that is already planned, in
    /// seconds for metres. Slowing down on line may take up to twice the acceleration and jerk.
    ///
    /// # Errors
    /// When a number is not above zero.
    pub fn uniform(length: f64, wanted: PathSpeed) -> Result<Self, TimingError> {
        let still = Joints::zeros(0);
        let limits =
            MotionLimits { lower: still, upper: still, velocity: still, acceleration: still, jerk: still };
        let step = length / 3.0;
        let way = checked(step, &[still; 4], &limits, &wanted)?;
        let PathSpeed { speed, acceleration, jerk } = wanted;
        let profile = Profile::uniform(length, speed, acceleration, jerk);
        let brake =
            PathSpeed { speed, acceleration: BRAKE_UNIFORM * acceleration, jerk: BRAKE_UNIFORM * jerk };
        Ok(Self { step, speeds: vec![speed; 4], wanted, brake, way, profile })
    }

    /// The path's length (m).
    pub fn length(&self) -> f64 {
        self.step * (self.speeds.len() - 1) as f64
    }

    /// How long the motion takes at full speed (s).
    pub const fn duration_s(&self) -> f64 {
        self.profile.duration
    }

    /// The highest steady speed at `s` (m/s), the lower of the two neighbours': what the limits allow there when the
    /// speed does not change. Just before and after a slower place the motion is slower than that.
    pub fn speed_at(&self, s: f64) -> f64 {
        let place = s.max(0.0) / self.step;
        let (below, above) = (place.floor() as usize, place.ceil() as usize);
        self.at(below).min(self.at(above))
    }

    /// The place of the lowest steady speed, as distance along the path (m) and speed there (m/s).
    pub fn slowest(&self) -> (f64, f64) {
        let first = (0.0, f64::INFINITY);
        let of = self.speeds.iter().enumerate().map(|(i, v)| (i as f64 * self.step, *v));
        of.fold(first, |least, here| if here.1 < least.1 { here } else { least })
    }

    /// The path's own limits.
    pub const fn wanted(&self) -> &PathSpeed {
        &self.wanted
    }

    /// Past the last posture there is nowhere to go.
    fn at(&self, index: usize) -> f64 {
        self.speeds.get(index).copied().unwrap_or(0.0)
    }
}

/// The joints' way, when all the numbers can be.
fn checked(
    step: f64,
    postures: &[Joints],
    limits: &MotionLimits,
    wanted: &PathSpeed,
) -> Result<Way, TimingError> {
    let PathSpeed { speed, acceleration, jerk } = *wanted;
    for (name, value) in [("step", step), ("speed", speed), ("acceleration", acceleration), ("jerk", jerk)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(TimingError::NotPositive { name, value });
        }
    }
    let too_few = TimingError::TooFew { found: postures.len() };
    if postures.len() < 4 {
        return Err(too_few);
    }
    let fits = |q: &Joints| q.len() == limits.velocity.len() && q.is_finite();
    if let Some(index) = postures.iter().position(|q| !fits(q)) {
        return Err(TimingError::Posture { index });
    }
    let rates = [("velocity", limits.velocity), ("acceleration", limits.acceleration), ("jerk", limits.jerk)];
    for (name, rate) in rates {
        if let Some(value) = rate.iter().find(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(TimingError::NotPositive { name, value });
        }
    }
    Way::through(step, postures, limits).ok_or(too_few)
}

/// The fastest motion, checked: where the check finds a limit crossed between the places that were asked, it is
/// looked for again with that limit tightened there; what is left is taken off the whole motion's speed, which keeps
/// every limit, because velocity, acceleration and jerk fall with its first, second and third power.
fn fastest(way: &Way, wanted: &PathSpeed, speeds: &[f64]) -> Profile {
    let grid = grid::Grid::new(way, wanted, speeds);
    let mut tight = vec![MotionBounds::ONE; grid.nodes.len() - 1];
    let slow = Profile::new(&grid.nodes, &grid.control, grid.launch, grid.landing);
    let mut best = (slower(&check::used(way, &slow, wanted)), slow);
    let (mut control, mut start) = (grid.control.clone(), Start::Cold);
    for _ in 0..=ROUNDS {
        control = Fastest::new(&grid.nodes, way, wanted, &tight, control, start).solve();
        start = Start::Warm;
        let profile = Profile::new(&grid.nodes, &control, grid.launch, grid.landing);
        let used = check::used(way, &profile, wanted);
        let by = slower(&used);
        // What is no number is no motion.
        if profile.duration * by < best.0 * best.1.duration {
            best = (by, profile);
        }
        if by < NEAR {
            break;
        }
        for (cell, used) in tight.iter_mut().zip(&used[1..]) {
            cell.tighten(used);
        }
    }
    let (by, mut profile) = best;
    profile.scale(1.0 / by);
    profile
}

/// How many times slower a motion would have to be.
fn slower(used: &[MotionBounds]) -> f64 {
    let worse = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
    used.iter().fold(0.0, |most, used| worse(most, used.slower()))
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

#[cfg(test)]
mod tests;
