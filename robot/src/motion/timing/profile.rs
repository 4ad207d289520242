//! [`Profile`]: the distance along the path over time, exactly, cell by cell.
//!
//! In a cell the acceleration is linear in the distance and in time, `s''' = bend s' + jerk` with constants: a
//! quadratic `b(s) = s'^2` (then `bend = b'' / 2`), or a constant jerk. Both have a closed form, so that place, speed
//! and acceleration are continuous to rounding and their finite differences at the tick are averages of what was
//! checked.

use super::fastest::basis;
use super::way::Motion;

/// A stretch of the motion, with what holds at its beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    /// When it begins (s).
    pub(super) time: f64,
    /// Where (m).
    pub(super) place: f64,
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) bend: f64,
    pub(super) jerk: f64,
}

/// A motion from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Profile {
    pub(super) cells: Vec<Cell>,
    pub(super) duration: f64,
    pub(super) length: f64,
}

/// The first or the last stretch: from rest at a constant jerk, for so long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Launch {
    pub(super) jerk: f64,
    pub(super) lasts: f64,
}

impl Launch {
    pub(super) fn way(&self) -> f64 {
        self.jerk * self.lasts.powi(3) / 6.0
    }

    pub(super) fn speed(&self) -> f64 {
        0.5 * self.jerk * self.lasts * self.lasts
    }

    pub(super) fn acceleration(&self) -> f64 {
        self.jerk * self.lasts
    }
}

impl Profile {
    /// From the control points of `b` over `nodes`, with a launch before and one, reversed, behind.
    pub(super) fn new(nodes: &[f64], control: &[f64], launch: Launch, landing: Launch) -> Self {
        let first =
            Cell { time: 0.0, place: 0.0, speed: 0.0, acceleration: 0.0, bend: 0.0, jerk: launch.jerk };
        let mut cells = Vec::with_capacity(nodes.len() + 1);
        cells.push(first);
        let mut time = launch.lasts;
        for (k, pair) in nodes.windows(2).enumerate() {
            let three = &control[k..k + 3];
            let [b, slope, bend] =
                basis(nodes, k, 0.0).map(|row| row[0] * three[0] + row[1] * three[1] + row[2] * three[2]);
            let h = pair[1] - pair[0];
            let end = b + h * (slope + 0.5 * h * bend);
            let (speed, after) = (b.max(0.0).sqrt(), end.max(0.0).sqrt());
            let (acceleration, bend) = (0.5 * slope, 0.5 * bend);
            cells.push(Cell { time, place: pair[0], speed, acceleration, bend, jerk: 0.0 });
            time += lasts(h, speed + after, bend);
        }
        let end = nodes.last().copied().unwrap_or_default();
        cells.push(Cell {
            time,
            place: end,
            speed: landing.speed(),
            acceleration: -landing.acceleration(),
            bend: 0.0,
            jerk: landing.jerk,
        });
        Self { cells, duration: time + landing.lasts, length: end + landing.way() }
    }

    /// The fastest from rest to rest over `length` with nothing but bounds along it: up to seven constant jerks.
    pub(super) fn uniform(length: f64, speed: f64, acceleration: f64, jerk: f64) -> Self {
        let parts = |speed: f64| {
            let peak = acceleration.min((speed * jerk).sqrt());
            (peak / jerk, speed / peak - peak / jerk)
        };
        let ramp = |speed: f64| speed * (2.0 * parts(speed).0 + parts(speed).1);
        let mut top = speed;
        if ramp(speed) > length {
            let (mut low, mut high) = (0.0, speed);
            for _ in 0..200 {
                top = 0.5 * (low + high);
                if ramp(top) > length { high = top } else { low = top }
            }
            top = low.max(f64::MIN_POSITIVE);
        }
        let (rise, hold) = parts(top);
        let cruise = ((length - ramp(top)) / top).max(0.0);
        let phases = [
            (jerk, rise),
            (0.0, hold),
            (-jerk, rise),
            (0.0, cruise),
            (-jerk, rise),
            (0.0, hold),
            (jerk, rise),
        ];
        let mut at = Cell { time: 0.0, place: 0.0, speed: 0.0, acceleration: 0.0, bend: 0.0, jerk: 0.0 };
        let mut cells = Vec::with_capacity(phases.len());
        for (jerk, lasts) in phases {
            at.jerk = jerk;
            cells.push(at);
            let (place, motion) = at.after(lasts);
            let Motion { speed, acceleration, .. } = motion;
            at = Cell { time: at.time + lasts, place, speed, acceleration, ..at };
        }
        Self { cells, duration: at.time, length }
    }

    /// The same motion, every speed multiplied by `factor`.
    pub(super) fn scale(&mut self, factor: f64) {
        for cell in &mut self.cells {
            cell.time /= factor;
            cell.speed *= factor;
            cell.acceleration *= factor * factor;
            cell.bend *= factor * factor;
            cell.jerk *= factor.powi(3);
        }
        self.duration /= factor;
    }

    /// Place and motion at a time; `near` is the cell to look from, and is moved on: time does not go back.
    pub(super) fn at(&self, time: f64, near: &mut usize) -> (f64, Motion) {
        if time >= self.duration {
            return (self.length, Motion::default());
        }
        while self.cells.get(*near + 1).is_some_and(|next| next.time <= time) {
            *near += 1;
        }
        let cell = &self.cells[*near];
        let (place, motion) = cell.after(time - cell.time);
        (place.min(self.length), Motion { speed: motion.speed.max(0.0), ..motion })
    }
}

impl Cell {
    /// Place and motion so long after its beginning.
    pub(super) fn after(&self, t: f64) -> (f64, Motion) {
        let Self { place, speed, acceleration, bend, jerk, .. } = *self;
        let [s, c, g] = kernels(bend, t);
        let grown = 1.0 + bend * c;
        let now = speed * grown + acceleration * s + jerk * c;
        let motion = Motion {
            speed: now,
            acceleration: acceleration * grown + (speed * bend + jerk) * s,
            jerk: bend * now + jerk,
        };
        (place + speed * s + acceleration * c + jerk * g, motion)
    }
}

/// `t`, `t^2 / 2` and `t^3 / 6` of a constant jerk, for `s''' = bend s'`: `sinh(w t) / w` and its integrals for
/// `bend = w^2`, and so on.
fn kernels(bend: f64, t: f64) -> [f64; 3] {
    let z = bend * t * t;
    if z.abs() < 0.05 {
        let s = 1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0 * (1.0 + z / 72.0)));
        let c = 1.0 + z / 12.0 * (1.0 + z / 30.0 * (1.0 + z / 56.0 * (1.0 + z / 90.0)));
        let g = 1.0 + z / 20.0 * (1.0 + z / 42.0 * (1.0 + z / 72.0 * (1.0 + z / 110.0)));
        return [t * s, t * t / 2.0 * c, t * t * t / 6.0 * g];
    }
    let w = bend.abs().sqrt();
    let s = if bend > 0.0 { (w * t).sinh() / w } else { (w * t).sin() / w };
    // 2 sinh^2(x / 2) is cosh(x) - 1 without the difference.
    let half = if bend > 0.0 { (0.5 * w * t).sinh() } else { (0.5 * w * t).sin() };
    [s, 2.0 * half * half / (w * w), (s - t) / bend]
}

/// How long a cell of `way` takes whose speeds at both ends add up to `speeds`: `tanh(w T / 2) / w = way / speeds`.
fn lasts(way: f64, speeds: f64, bend: f64) -> f64 {
    let x = way / speeds;
    let z = bend * x * x;
    if z.abs() < 1e-3 {
        return 2.0 * x * (1.0 + z * (1.0 / 3.0 + z * (0.2 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z / 11.0)))));
    }
    let w = bend.abs().sqrt();
    2.0 / w * if bend > 0.0 { (w * x).atanh() } else { (w * x).atan() }
}
