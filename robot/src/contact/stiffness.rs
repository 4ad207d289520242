//! [`Stiffness`]: how stiff the skin is, and how sure that is.
//!
//! Force `f = k (x - w)`, where `x` is how far the probe is in and `w` where the skin begins, which moves and is not
//! known. The plain ratio of force to motion fails just when the loop works: `x` then goes with `w`, and the force hardly
//! changes. Two things help. `x` is reckoned from the commands, without noise, and the sensor's noise of now has not
//! moved the probe yet: so the little motion that the noise makes is an honest question to the skin at all times. And
//! what the skin's own motion makes is at right angles to it where the loop is a quarter of a period late: `x = T w` with
//! `T` at -90° adds nothing to `Sxf / Sxx = k (1 - Re 1/T)`. A little above that frequency it makes the skin seem
//! stiffer than it is, which is slow and safe. So force and offset are compared in one narrow band there.

/// How long is looked back (s).
const MEMORY_S: f64 = 0.6;
/// How fast the estimate rises, and falls (s) when it is sure: too stiff is slow, too soft is unstable.
const UP_S: f64 = 0.06;
const DOWN_S: f64 = 0.4;
/// The estimate is held so much stiffer than the skin seems.
const MARGIN: f64 = 1.35;
/// A deviation of this part of the estimate is half sure.
const HALF_SURE: f64 = 0.25;
/// The estimate goes this far toward what the skin seems, at most, as a logarithm.
const FAR: f64 = 0.7;

/// What is known of the skin's stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinEstimate {
    /// The stiffness that the law reckons with (N/m): a little on the stiff side.
    pub stiffness_n_m: f64,
    /// What the skin seemed during the last half second (N/m); before it was touched, the stiffest.
    pub seems_n_m: f64,
    /// One standard deviation of that (N/m), from the sensor's noise and how little the probe moved; infinite when it
    /// did not.
    pub deviation_n_m: f64,
}

/// A band-pass of second order and quality 1 (trapezoidal rule).
#[derive(Clone, Copy, Debug)]
struct Stage {
    first: f64,
    second: f64,
}

/// Three of them: what is slow and large must not leak in.
#[derive(Clone, Copy, Debug)]
struct Band([Stage; 3]);

impl Stage {
    fn step(&mut self, value: f64, half: f64) -> f64 {
        let high = (value - (1.0 + half) * self.first - self.second) / (1.0 + half + half * half);
        let band = self.first + half * high;
        self.first = band + half * high;
        self.second += 2.0 * half * band;
        band
    }
}

impl Band {
    const fn from(value: f64) -> Self {
        let rest = Stage { first: 0.0, second: 0.0 };
        Self([Stage { first: 0.0, second: value }, rest, rest])
    }

    fn step(&mut self, value: f64, half: f64) -> f64 {
        self.0.iter_mut().fold(value, |value, stage| stage.step(value, half))
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Stiffness {
    softest: f64,
    stiffest: f64,
    dt: f64,
    estimate: SkinEstimate,
    bands: Option<(Band, Band)>,
    /// Averages of offset times offset, and offset times force, in the band.
    xx: f64,
    xf: f64,
    /// The sensor's own noise: the two last forces, and the average square of their second difference.
    last: (f64, f64),
    rough: f64,
}

impl Stiffness {
    /// Nothing known but the bounds (N/m).
    pub(super) const fn new(softest: f64, stiffest: f64, dt: f64) -> Self {
        let (seems_n_m, stiffness_n_m) = (stiffest, stiffest * MARGIN);
        let estimate = SkinEstimate { stiffness_n_m, seems_n_m, deviation_n_m: f64::INFINITY };
        Self { softest, stiffest, dt, estimate, bands: None, xx: 0.0, xf: 0.0, last: (0.0, 0.0), rough: 0.0 }
    }

    /// The stiffness to reckon with (N/m).
    pub(super) const fn now(&self) -> f64 {
        self.estimate.stiffness_n_m
    }

    pub(super) const fn estimate(&self) -> SkinEstimate {
        self.estimate
    }

    /// Off the skin: what comes next is other skin.
    pub(super) fn forget(&mut self) {
        *self = Self::new(self.softest, self.stiffest, self.dt);
    }

    /// One tick on the skin: how far the probe was in (m) when this force (N) was felt; compared around `at_rad_s`.
    pub(super) fn learn(&mut self, x: f64, force: f64, at_rad_s: f64) {
        if self.bands.is_none() {
            self.last = (force, force);
        }
        let half = 0.5 * at_rad_s * self.dt;
        let (at, felt) = self.bands.get_or_insert((Band::from(x), Band::from(force)));
        let (x, f) = (at.step(x, half), felt.step(force, half));
        let bend = force - 2.0 * self.last.0 + self.last.1;
        self.last = (force, self.last.0);
        let share = self.dt / MEMORY_S;
        let average = |of: &mut f64, value: f64| *of += share * (value - *of);
        average(&mut self.xx, x * x);
        average(&mut self.xf, x * f);
        // White noise of variance v bends by 6 v; the band leaves 3/8 of `half` of it.
        average(&mut self.rough, bend * bend / 6.0 * 0.375 * half);
        self.judge(at_rad_s);
    }

    fn judge(&mut self, at_rad_s: f64) {
        if self.xx <= 0.0 {
            return;
        }
        let pairs = 3.0 / 16.0 * MEMORY_S * at_rad_s;
        let seems = self.xf / self.xx;
        let deviation = (self.rough / (pairs * self.xx)).sqrt();
        let now = self.now();
        let wanted = MARGIN * seems.max(self.softest / MARGIN);
        let far = (wanted / now).ln().clamp(-FAR, FAR);
        let unsure = 1.0 + (deviation / (HALF_SURE * now)).powi(2);
        let over = unsure * if far > 0.0 { UP_S } else { DOWN_S };
        let next = now * (far * self.dt / over).exp();
        self.estimate = SkinEstimate {
            stiffness_n_m: next.clamp(self.softest, self.stiffest * MARGIN),
            seems_n_m: seems,
            deviation_n_m: deviation,
        };
    }
}
