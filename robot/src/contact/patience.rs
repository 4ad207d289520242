//! [`Patience`]: how fast the path may be followed while the force is held.
//!
//! Along the path the skin moves under the probe as fast as the path is followed, and the error of the force grows with
//! the square of that. So whoever cannot keep up has more time: the speed falls where the force is off, where the place to
//! go to moves fast, and where the force was off lately for how fast it went ([`unrest`]); and what the law needs of the
//! probe's speed the path leaves to it. It falls at once and rises slowly; the path's clock makes it smooth.
//!
//! How unsure the stiffness is does not count: reckoned with too high it only makes the law slow, and what comes of that
//! is seen in the force.

mod unrest;

use super::ContactLaw;
use unrest::Unrest;

/// The part of the speed that is always left.
const LEAST: f64 = 0.1;
/// Force errors (N) up to which the speed stays, and from which the least is left.
const OFF_N: (f64, f64) = (0.2, 0.7);
/// Speeds of the place to go to (m/s), likewise.
const RATE_M_S: (f64, f64) = (0.003, 0.015);
/// However restless the force was, at this speed (m/s) the law holds it, even when it reckons with skin ten times too
/// stiff.
const RESTLESS_M_S: f64 = 0.01;
/// Over how long force and rate are smoothed (s): longer than the sensor's noise.
const OVER_S: f64 = 0.02;
/// From nothing to the whole speed in so long (s), at least.
const RISES_IN_S: f64 = 0.5;
/// The speed told changes in steps of this part, so that the clock is not asked anew at every tick.
const STEP: f64 = 0.1;

/// Says how fast the path may be followed.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    dt: f64,
    /// The force's error (N) and the goal's speed (m/s), smoothed.
    off_n: f64,
    rate_m_s: f64,
    unrest: Unrest,
    /// The part of the speed that is left, and the one told last.
    share: f64,
    told: f64,
}

/// 1 up to `from`, `least` from `to` on, and a straight line between them.
fn falling(value: f64, (from, to): (f64, f64), least: f64) -> f64 {
    // What is no number leaves the least.
    1.0 - (1.0 - least)
        * ((value - from) / (to - from)).clamp(0.0, 1.0).max(f64::from(u8::from(value.is_nan())))
}

impl Patience {
    /// Slow at first. A step every `dt` seconds.
    pub const fn new(dt: f64) -> Self {
        let unrest = Unrest::new(dt);
        Self { dt, off_n: 0.0, rate_m_s: 0.0, unrest, share: LEAST, told: LEAST }
    }

    /// One tick, after the law's: how fast (m/s) a path may be followed that is `wanted` to be followed at some speed
    /// (m/s), while `set_n` (N) is held.
    pub fn step(&mut self, law: &ContactLaw, set_n: f64, wanted: f64) -> f64 {
        let new = self.dt / (OVER_S + self.dt);
        self.off_n += new * (law.raw - set_n - self.off_n);
        self.rate_m_s += new * (law.goal.1 - self.rate_m_s);
        self.unrest.see(law.raw - set_n, law.path_m_s);
        let kept = falling(self.off_n.abs(), OFF_N, LEAST);
        let calm = falling(self.rate_m_s.abs(), RATE_M_S, LEAST);
        let share = kept.min(calm).min(self.restful(wanted)).min(self.left(law, wanted));
        self.share = share.min(self.share + self.dt / RISES_IN_S);
        self.tell() * wanted
    }

    /// What the force's unrest leaves.
    fn restful(&self, wanted: f64) -> f64 {
        let most = self.unrest.speed_m_s().max(RESTLESS_M_S);
        if wanted > most { most / wanted } else { 1.0 }
    }

    /// What the law leaves of the speed that both have together.
    fn left(&self, law: &ContactLaw, wanted: f64) -> f64 {
        let taken = law.speed_m_s().abs().max(self.rate_m_s.abs());
        let left = law.settings().together_m_s - taken;
        if wanted > left { (left / wanted).max(LEAST) } else { 1.0 }
    }

    fn tell(&mut self) -> f64 {
        let ends = self.share >= 1.0 || self.share <= LEAST;
        if ends || (self.share - self.told).abs() >= STEP {
            self.told = self.share;
        }
        self.told
    }
}

#[cfg(test)]
mod tests {
    use probepath_frames::Span;

    use super::*;
    use crate::contact::ContactSettings;

    const DT: f64 = 0.002;

    /// A law on even skin of 1 N/mm that rises at `rise` m/s after a while, and what its patience told last of 20 mm/s.
    fn followed(rise: f64) -> (f64, ContactLaw) {
        let mut law = ContactLaw::new(ContactSettings::default(), Span::from_milliseconds(2)).unwrap();
        let (mut patience, mut force, mut told) = (Patience::new(DT), 5.0, 0.0);
        let mut late = [0.0; 8];
        for tick in 0..2000 {
            law.beside(told);
            let at = law.step(force, 5.0);
            late.rotate_right(1);
            late[0] = at;
            force = (5.0 + 1000.0 * (late[7] + rise * f64::from((tick - 1400).max(0)) * DT)).max(0.0);
            told = patience.step(&law, 5.0, 0.02);
        }
        (told, law)
    }

    #[test]
    fn skin_that_rests_is_passed_at_the_whole_speed_and_skin_that_moves_slowly() {
        let (told, law) = followed(0.0);
        assert!((told - 0.02).abs() < 1e-9, "{told} {:?}", law.skin());
        let (told, _) = followed(0.03);
        assert!((told - 0.002).abs() < 1e-9, "{told}");
    }

    #[test]
    fn what_the_law_needs_the_path_leaves() {
        let (_, law) = followed(0.038);
        let (mut patience, mut told) = (Patience::new(DT), 0.0);
        for _ in 0..1000 {
            told = patience.step(&law, law.raw, 0.02);
            assert!((0.002 - 1e-12..=0.02).contains(&told), "{told}");
        }
        let together = told + law.speed_m_s().abs();
        assert!(together <= law.settings().together_m_s + 1e-9, "{together} m/s");
    }

    #[test]
    fn no_number_leaves_the_least() {
        for (value, share) in [(f64::NAN, 0.1), (f64::INFINITY, 0.1), (0.0, 1.0), (1.5, 0.55)] {
            assert!((falling(value, (1.0, 2.0), 0.1) - share).abs() < 1e-12, "{value}");
        }
    }
}
