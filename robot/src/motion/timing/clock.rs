//! [`PathClock`]: the motion along the path, tick by tick, and its time scaled on line.
//!
//! The clock's own time runs at a pace `r` between 0 and 1. With `s(t)` the fastest motion and `r' = dr/dt`,
//!
//! ```text
//! speed s' r     acceleration s'' r^2 + s' r'     jerk s''' r^3 + 3 s'' r r' + s' r''
//! ```
//!
//! so a pace that does not change keeps every limit that the fastest motion keeps. A change of pace is looked through
//! to its end before it begins, at the ticks it will make: only when it keeps every limit is it taken, the quickest
//! first; then it is carried out whatever comes, unless a better one is found that keeps every limit too. So there is
//! always a way on that is known to be good: the rest of the change, and then the pace it led to.

use super::ramp;
use super::way::Motion;
use super::{Bounds, PathLimits, PathSpeed, Rate};

/// A change of pace from here on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    target: f64,
    bounds: Bounds,
    /// Which of the [`LEVELS`] it is; 0 is the quickest.
    level: u8,
}

/// From one level to the next a change is this much gentler, in `r'` and in `r''`.
const GENTLER: (f64, f64) = (2.0, 2.5);
const LEVELS: u8 = 12;
/// So many levels are tried in a tick.
const TRIES: u8 = 3;
/// A change is looked through at every tick, so many at most; one that takes longer is made in parts that take this
/// part of them.
const LOOKS: usize = 100;
const PART: f64 = 0.8;
/// Part of the limits of acceleration and jerk that a change may use: where the motion's jerk jumps it may be a little
/// more just before than at the half ticks that are looked at.
const WITHIN: (f64, f64) = (0.9995, 0.99);

/// Where along the path the motion is; moved on by one tick at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct PathClock {
    limits: PathLimits,
    /// The motion's own time (s), and the cell it is in.
    time: f64,
    cell: usize,
    s: f64,
    speed: f64,
    /// The pace, and how fast it changes.
    pace: Rate,
    change: Change,
    /// The level that is tried next.
    next: u8,
    hold: f64,
}

impl PathClock {
    /// At rest at the start.
    pub const fn new(limits: PathLimits) -> Self {
        let bounds = Bounds { acceleration: 1.0, jerk: 1.0 };
        let pace = Rate { speed: 0.0, acceleration: 0.0 };
        let change = Change { target: 0.0, bounds, level: 0 };
        Self { limits, time: 0.0, cell: 0, s: 0.0, speed: 0.0, pace, change, next: 0, hold: 1.0 }
    }

    /// Moves on by one tick of `dt` seconds and gives the distance along the path (m). `wanted` is the speed (m/s)
    /// where nothing but the path's own highest speed limits it: the whole motion is slowed down in that proportion
    /// (zero: to rest, and wait). Speeds below zero, and NaN, count as zero.
    pub fn step(&mut self, wanted: f64, dt: f64) -> f64 {
        let share = wanted / self.limits.wanted.speed;
        let target = if share > 0.0 { share.min(self.hold) } else { 0.0 };
        if self.time <= 0.0 {
            // At rest at the start any pace will do.
            self.pace = Rate { speed: target, acceleration: 0.0 };
            self.change = Change { target, ..self.change };
        } else if !self.has_arrived() {
            self.choose(target, dt);
        }
        let (way, pace) = ramp::after(&self.pace, self.change.target, &self.change.bounds, dt);
        // Rounding must not turn it round.
        self.time = (self.time + way.max(0.0)).min(self.limits.profile.duration);
        self.pace = Rate { speed: pace.speed.clamp(0.0, 1.0), ..pace };
        let (place, motion) = self.limits.profile.at(self.time, &mut self.cell);
        self.s = place.max(self.s);
        self.speed = motion.speed * self.pace.speed;
        self.s
    }

    /// From the next tick on no faster than `scale` (0 to 1) of the motion's speed: for whoever finds on line that the
    /// joints cannot follow. What is no number holds it back to rest.
    pub const fn hold_back(&mut self, scale: f64) {
        self.hold = if scale.is_nan() { 0.0 } else { scale.clamp(0.0, 1.0) };
    }

    /// A better change of pace, if there is one: the quickest toward `target` that keeps every limit. A few are looked
    /// through in a tick, the others in the next ones.
    fn choose(&mut self, target: f64, dt: f64) {
        let aimed = (self.change.target - target).abs() <= f64::EPSILON;
        let done = self.pace == Rate { speed: self.change.target, acceleration: 0.0 };
        match (aimed, done) {
            (true, true) => self.next = 0,
            (true, false) if self.change.level == 0 => {}
            (true, false) => {
                self.take(target, self.change.level - 1, dt);
            }
            (false, _) => {
                let mut levels = self.next..self.next + TRIES;
                let found = levels.any(|level| self.take(target, level, dt));
                self.next = if found || self.next + TRIES >= LEVELS { 0 } else { self.next + TRIES };
            }
        }
    }

    /// Takes the change, or the part of it that can be looked through, when it keeps every limit to its end.
    fn take(&mut self, wish: f64, level: u8, dt: f64) -> bool {
        let most = self.most(wish);
        let gentle = |by: f64| by.powi(-i32::from(level));
        let bounds = Bounds {
            acceleration: most.acceleration / most.speed * gentle(GENTLER.0),
            jerk: most.jerk / most.speed * gentle(GENTLER.1),
        };
        let within = LOOKS as f64 * dt;
        let mut target = wish;
        if ramp::lasts(&self.pace, target, &bounds) > within {
            let far = ramp::reach(&bounds, PART * within);
            target = self.pace.speed + (wish - self.pace.speed).clamp(-far, far);
        }
        let change = Change { target, bounds, level };
        let good = self.is_good(&change, &most, dt);
        if good {
            self.change = change;
        }
        good
    }

    /// The path's own limits for a change: slowing down may use more.
    fn most(&self, target: f64) -> PathSpeed {
        if target < self.pace.speed { self.limits.brake } else { self.limits.wanted }
    }

    /// Whether the change keeps every limit at every half tick until its end.
    fn is_good(&self, change: &Change, most: &PathSpeed, dt: f64) -> bool {
        let Change { target, bounds, .. } = change;
        let looks = (ramp::lasts(&self.pace, *target, bounds) / dt).ceil() as usize + 1;
        if looks > LOOKS + 1 {
            return false;
        }
        let half = 0.5 * dt;
        let mut cell = self.cell;
        let mut bend = ramp::jerk_at(&self.pace, *target, bounds, 0.5 * half);
        (0..=2 * looks).all(|k| {
            let seconds = half * k as f64;
            let (way, pace) = ramp::after(&self.pace, *target, bounds, seconds);
            let (place, motion) = self.limits.profile.at(self.time + way, &mut cell);
            let after = ramp::jerk_at(&self.pace, *target, bounds, seconds + 0.5 * half);
            let good = self.keeps(place, &motion, &pace, [bend, after], most);
            bend = after;
            good
        })
    }

    /// Whether the limits are kept at a tick, with what bends the pace before it and after it.
    fn keeps(&self, place: f64, motion: &Motion, pace: &Rate, bends: [f64; 2], most: &PathSpeed) -> bool {
        let way = &self.limits.way;
        let slopes = way.at(place);
        let both = bends.map(|bend| scaled(motion, pace, bend));
        let within = (-1e-9..=1.0 + 1e-9).contains(&pace.speed);
        within
            && both.iter().take(if bends[0].to_bits() == bends[1].to_bits() { 1 } else { 2 }).all(|motion| {
                let [velocity, acceleration, jerk] = way.shares(&slopes, motion);
                velocity <= 1.0 && acceleration <= WITHIN.0 && jerk <= WITHIN.1 && motion.share(most) <= 1.0
            })
    }

    /// Distance along the path (m).
    pub const fn at(&self) -> f64 {
        self.s
    }

    /// Speed along the path (m/s).
    pub const fn speed(&self) -> f64 {
        self.speed
    }

    /// How fast the motion runs, as a share of its full speed.
    pub const fn pace(&self) -> f64 {
        self.pace.speed
    }

    /// Whether it rests.
    pub fn is_at_rest(&self) -> bool {
        self.pace == Rate::default() || self.time <= 0.0 || self.has_arrived()
    }

    /// Whether it has arrived: at rest, at the path's end.
    pub fn has_arrived(&self) -> bool {
        self.time >= self.limits.profile.duration
    }

    /// The limits it keeps.
    pub const fn limits(&self) -> &PathLimits {
        &self.limits
    }
}

/// The motion at a pace.
fn scaled(motion: &Motion, pace: &Rate, bend: f64) -> Motion {
    let Rate { speed: r, acceleration: rr } = *pace;
    let Motion { speed, acceleration, jerk } = *motion;
    Motion {
        speed: speed * r,
        acceleration: acceleration * r * r + speed * rr,
        jerk: jerk * r * r * r + 3.0 * acceleration * r * rr + speed * bend,
    }
}
