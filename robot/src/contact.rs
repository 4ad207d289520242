//! [`ContactLaw`]: holds the force along the probe's z by moving the probe along it; [`TouchDown`]: finds the skin.
//!
//! Pressing force in, offset along the probe's z out (positive into the tissue), every output jerk-limited.
//!
//! The law is a speed for each newton that is missing, and an acceleration for each: `v = g e + h ∫e dt`, smoothed by
//! one filter on the force and two on the speed. On a skin of stiffness `k` the loop is `k g (s + h/g) / s²` with a
//! few lags (servo, two ticks, the filters: 43 ms at most). Two facts make one pair of gains do for skins that
//! differ tenfold:
//!
//! - *Accuracy does not depend on `k`.* Slowly (below the crossover) the error is `k a / (k h) = a / h`, where `a` is
//!   the acceleration of the skin under the probe: a bump of ±5 mm over 40 mm at 10 mm/s has 12 mm/s², which costs
//!   0.2 N at its peak with `h` = 60 mm/s²/N.
//! - *Stability needs only the stiffest.* With a servo lag of 16 ms the loop crosses at 22.8 rad/s on 3 N/mm, with
//!   17° of phase and a factor of 1.6 of gain to spare (28° and 2.2 at 6 ms). Softer skin crosses lower, where the lags
//!   cost less and the integral more: 29° on 1 N/mm, 20° on 0.3 N/mm, with a factor of 5 and more of gain.
//!
//! An estimate of the stiffness from the probe's own motion was tried and left out: under a skin that is followed
//! well the force hardly changes while the probe moves, so the estimate falls to zero just when the loop works, and
//! with enough excitation to be trusted (a loop that already oscillates) it came too late to help.
//!
//! On skin much stiffer than 4 N/mm (bone right under the probe) these gains oscillate, and the guard's force limit ends
//! it; [`ContactSettings::for_stiffest`] trades accuracy for such places.

pub(crate) mod pressure;
mod touch_down;

use probepath_frames::Span;
use thiserror::Error;

use crate::limits::axis::{self, Bounds, Motion};
pub use touch_down::{TouchDown, TouchDownPhase, TouchDownSettings};

/// What the contact law may do, and how it does it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Largest speed along the probe's z (m/s). 0.03.
    pub speed_m_s: f64,
    /// Largest acceleration along it (m/s²). 0.5.
    pub acceleration_m_s2: f64,
    /// Largest jerk along it (m/s³). 20.
    pub jerk_m_s3: f64,
    /// How far the offset may go against the path, out of the tissue (m, negative). -0.04.
    pub lowest_m: f64,
    /// How far the offset may go into the tissue (m); 5 N on skin of 0.3 N/mm is 17 mm. 0.04.
    pub highest_m: f64,
    /// Speed for each newton that is missing (m/s/N). 0.008.
    pub gain: f64,
    /// Acceleration for each newton that is missing (m/s²/N): follows a skin that rises steadily. 0.06.
    pub integral_gain: f64,
    /// Time constant of the filter on the force (s). 0.005.
    pub filter_s: f64,
    /// Angular frequency of the second-order filter on the speed (rad/s). 120.
    pub smooth_rad_s: f64,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            speed_m_s: 0.03,
            acceleration_m_s2: 0.5,
            jerk_m_s3: 20.0,
            lowest_m: -0.04,
            highest_m: 0.04,
            gain: 0.008,
            integral_gain: 0.06,
            filter_s: 0.005,
            smooth_rad_s: 120.0,
        }
    }
}

/// The skin the default gains are made for (N/m): the stiffest of FIELD.md section 8.
const STIFFEST: f64 = 3000.0;

impl ContactSettings {
    /// The default, with gains for another stiffest skin (N/m): stiffer is slower.
    pub fn for_stiffest(stiffness_n_m: f64) -> Self {
        let by = STIFFEST / stiffness_n_m;
        let default = Self::default();
        Self { gain: default.gain * by, integral_gain: default.integral_gain * by, ..default }
    }
}

/// Settings that no contact can be held with.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("the contact setting {what} is {value}; {wanted}")]
pub struct ContactError {
    /// Which setting.
    pub what: &'static str,
    /// The number found.
    pub value: f64,
    /// What it has to be.
    pub wanted: &'static str,
}

/// Force in, offset out.
#[derive(Clone, Copy, Debug)]
pub struct ContactLaw {
    settings: ContactSettings,
    bounds: Bounds,
    dt: f64,
    /// The offset and its differences, per tick.
    motion: Motion,
    /// The filtered pressing force (N), once one has come.
    force: Option<f64>,
    /// The integral's share of the speed (m/s).
    integral: f64,
}

impl ContactLaw {
    /// At rest at offset zero.
    ///
    /// # Errors
    /// When a setting is not finite or has the wrong sign.
    pub fn new(settings: ContactSettings, period: Span) -> Result<Self, ContactError> {
        let dt = period.seconds();
        let s = &settings;
        let positive = [
            ("speed", s.speed_m_s),
            ("acceleration", s.acceleration_m_s2),
            ("jerk", s.jerk_m_s3),
            ("highest offset", s.highest_m),
            ("lowest offset, negated", -s.lowest_m),
            ("gain", s.gain),
            ("integral gain", s.integral_gain),
            ("filter", s.filter_s),
            ("smoothing", s.smooth_rad_s),
            ("period", dt),
        ];
        if let Some((what, value)) =
            positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
        {
            return Err(ContactError { what, value, wanted: "it must be positive and finite" });
        }
        let bounds = Bounds {
            lower: s.lowest_m,
            upper: s.highest_m,
            velocity: s.speed_m_s * dt,
            acceleration: s.acceleration_m_s2 * dt * dt,
            jerk: s.jerk_m_s3 * dt * dt * dt,
        };
        let motion = Motion { position: 0.0, velocity: 0.0, acceleration: 0.0 };
        Ok(Self { settings, bounds, dt, motion, force: None, integral: 0.0 })
    }

    /// One tick: the pressing force (N, positive; minus the wrench's force along the probe's z) and the force to hold
    /// give the next offset (m). A force that is not finite counts as the one before.
    pub fn step(&mut self, pressing_n: f64, set_n: f64) -> f64 {
        let missing = set_n - self.filtered(pressing_n);
        let wanted = self.settings.gain * missing + self.integral;
        self.follow(wanted);
        self.integrate(missing, wanted);
        self.motion.position
    }

    /// One tick at a given speed (m/s, positive into the tissue) instead of a force, as smoothly: the descent before
    /// contact, the lift after.
    pub fn step_at(&mut self, speed_m_s: f64, pressing_n: f64) -> f64 {
        self.filtered(pressing_n);
        self.integral = 0.0;
        self.follow(speed_m_s);
        self.motion.position
    }

    /// The offset now (m).
    pub const fn offset_m(&self) -> f64 {
        self.motion.position
    }

    /// The offset's speed now (m/s).
    pub fn speed_m_s(&self) -> f64 {
        self.motion.velocity / self.dt
    }

    /// The pressing force it believes (N), filtered.
    pub fn force_n(&self) -> f64 {
        self.force.unwrap_or(0.0)
    }

    /// What it may do.
    pub const fn settings(&self) -> &ContactSettings {
        &self.settings
    }

    fn filtered(&mut self, pressing_n: f64) -> f64 {
        let before = self.force.unwrap_or(if pressing_n.is_finite() { pressing_n } else { 0.0 });
        let share = self.dt / (self.settings.filter_s + self.dt);
        let force = if pressing_n.is_finite() { before + share * (pressing_n - before) } else { before };
        self.force = Some(force);
        force
    }

    /// Moves toward a speed, as a critically damped filter of second order does, within the bounds.
    fn follow(&mut self, speed_m_s: f64) {
        let w = self.settings.smooth_rad_s * self.dt;
        let speed = speed_m_s.clamp(-self.settings.speed_m_s, self.settings.speed_m_s) * self.dt;
        let m = &self.motion;
        // Solved for the end of the tick, so that it is stable at any frequency.
        let acceleration = (m.acceleration + w * w * (speed - m.velocity)) / (1.0 + 2.0 * w + w * w);
        let wanted = m.position + (m.velocity + acceleration);
        let position = axis::limit(m, &self.bounds, wanted);
        let velocity = position - m.position;
        self.motion = Motion { position, velocity, acceleration: velocity - m.velocity };
    }

    /// The integral stops where the speed or the offset is at its limit, unless it leads back.
    fn integrate(&mut self, missing: f64, wanted: f64) {
        let s = &self.settings;
        let full = wanted.abs() >= s.speed_m_s
            || (wanted > 0.0 && self.motion.position > s.highest_m - 1e-4)
            || (wanted < 0.0 && self.motion.position < s.lowest_m + 1e-4);
        if !full || missing * wanted < 0.0 {
            self.integral += s.integral_gain * missing * self.dt;
        }
    }
}

#[cfg(test)]
mod tests;
