//! [`DisturbanceConfig`]: what a living leg does under the probe, and what goes wrong beside it. All off by default.
//!
//! The whole leg moves: skin, vessels and what the B-scans show of them. Where the truth gives a vessel's place, it is
//! that of the leg at rest. A bump and a harder, drier stretch belong to the skin, and move with it.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Probe, Stamp, World};
use serde::{Deserialize, Serialize};

/// How long breathing takes to reach its full depth (s): nobody starts in the middle of a breath.
const SWELL_S: f64 = 2.0;
/// Length of the edge of a harder stretch (m).
const EDGE_M: f64 = 0.001;
/// Less than this is none at all.
const NOTHING: f64 = 1e-12;

/// What disturbs the contact. Every number has its unit in its name; zero is none of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DisturbanceConfig {
    /// When it begins (s of the cell's time).
    pub from_s: f64,
    /// The leg goes up and down by this much to either side (mm) ...
    pub breathing_mm: f64,
    /// ... so often a second.
    pub breathing_hz: f64,
    /// The leg is moved up by this much (mm), and down again the next time ...
    pub leg_moves_mm: f64,
    /// ... within so long (s), without a jump in acceleration ...
    pub leg_moves_over_s: f64,
    /// ... so often: this long after the last (s).
    pub leg_moves_every_s: f64,
    /// Height of a bump that was not there when the path was taught (mm) ...
    pub bump_mm: f64,
    /// ... its length along the leg (mm) ...
    pub bump_length_mm: f64,
    /// ... and the distance from one to the next (mm).
    pub bump_every_mm: f64,
    /// How much stiffer every other stretch of the leg is, as a factor.
    pub stiffer_by: f64,
    /// How much more it rubs there, the gel being dry, as a factor.
    pub drier_by: f64,
    /// Length of such a stretch (mm).
    pub stretch_mm: f64,
    /// How fast the sensor's pressing force drifts (N/min), beside the drift it has anyway.
    pub sensor_drift_n_min: f64,
}

impl Default for DisturbanceConfig {
    fn default() -> Self {
        Self {
            from_s: 0.0,
            breathing_mm: 0.0,
            breathing_hz: 0.25,
            leg_moves_mm: 0.0,
            leg_moves_over_s: 0.5,
            leg_moves_every_s: 7.0,
            bump_mm: 0.0,
            bump_length_mm: 10.0,
            bump_every_mm: 60.0,
            stiffer_by: 1.0,
            drier_by: 1.0,
            stretch_mm: 30.0,
            sensor_drift_n_min: 0.0,
        }
    }
}

impl DisturbanceConfig {
    /// Breathing: 5 mm to either side, every four seconds.
    pub fn breathing() -> Self {
        Self { breathing_mm: 5.0, ..Self::default() }
    }

    /// A leg that is moved by 10 mm within half a second, up and down again.
    pub fn moving_leg() -> Self {
        Self { leg_moves_mm: 10.0, ..Self::default() }
    }

    /// A bump of 5 mm over 10 mm, every 60 mm.
    pub fn bump() -> Self {
        Self { bump_mm: 5.0, ..Self::default() }
    }

    /// A sensor that drifts by half a newton a minute, along the probe's axis.
    pub fn drifting_sensor() -> Self {
        Self { sensor_drift_n_min: 0.5, ..Self::default() }
    }

    /// Every other 30 mm are half as stiff again within a millimetre, and rub five times as much: the gel ran dry.
    pub fn hard_and_dry() -> Self {
        Self { stiffer_by: 1.5, drier_by: 5.0, ..Self::default() }
    }

    /// Every number with the bounds it has to keep.
    pub(crate) const fn numbers(&self) -> [(&'static str, f64, f64, f64); 13] {
        [
            ("disturbance.from_s", self.from_s, 0.0, 1e6),
            ("disturbance.breathing_mm", self.breathing_mm, 0.0, 50.0),
            ("disturbance.breathing_hz", self.breathing_hz, 0.01, 5.0),
            ("disturbance.leg_moves_mm", self.leg_moves_mm, -100.0, 100.0),
            ("disturbance.leg_moves_over_s", self.leg_moves_over_s, 0.01, 100.0),
            ("disturbance.leg_moves_every_s", self.leg_moves_every_s, self.leg_moves_over_s, 1e6),
            ("disturbance.bump_mm", self.bump_mm, -20.0, 20.0),
            ("disturbance.bump_length_mm", self.bump_length_mm, 1.0, 1000.0),
            ("disturbance.bump_every_mm", self.bump_every_mm, self.bump_length_mm, 1e4),
            ("disturbance.stiffer_by", self.stiffer_by, 0.01, 100.0),
            ("disturbance.drier_by", self.drier_by, 0.0, 100.0),
            ("disturbance.stretch_mm", self.stretch_mm, 5.0, 1000.0),
            ("disturbance.sensor_drift_n_min", self.sensor_drift_n_min, -100.0, 100.0),
        ]
    }
}

/// A disturbance that has a beginning.
#[derive(Clone, Debug)]
pub(crate) struct Disturbance {
    config: DisturbanceConfig,
    since: Stamp,
}

impl Disturbance {
    pub(crate) const fn new(config: DisturbanceConfig, since: Stamp) -> Self {
        Self { config, since }
    }

    fn elapsed_s(&self, now: Stamp) -> f64 {
        (now - self.since).seconds() - self.config.from_s
    }

    /// How far the leg is lifted off where it was drawn (m), and how fast it rises (m/s).
    pub(crate) fn lift(&self, now: Stamp) -> (f64, f64) {
        let t = self.elapsed_s(now);
        if t <= 0.0 {
            return (0.0, 0.0);
        }
        let ((a, a_rate), (b, b_rate)) = (self.breath(t), self.shift(t));
        (a + b, a_rate + b_rate)
    }

    fn breath(&self, t: f64) -> (f64, f64) {
        let (depth, w) = (self.config.breathing_mm * 1e-3, TAU * self.config.breathing_hz);
        let (swell, rate) = ease(t / SWELL_S);
        (depth * swell * (w * t).sin(), depth * (swell * w * (w * t).cos() + rate / SWELL_S * (w * t).sin()))
    }

    fn shift(&self, t: f64) -> (f64, f64) {
        let c = &self.config;
        let (height, turn) = (c.leg_moves_mm * 1e-3, (t / c.leg_moves_every_s).floor());
        let (part, rate) = ease((t - turn * c.leg_moves_every_s) / c.leg_moves_over_s);
        // It waits once before it goes up the first time; then it goes down, up, down.
        let sign = if turn as u64 % 2 == 1 { 1.0 } else { -1.0 };
        let before = if sign > 0.0 { 0.0 } else { 1.0 };
        if turn < 1.0 {
            return (0.0, 0.0);
        }
        (height * (before + sign * part), height * sign * rate / c.leg_moves_over_s)
    }

    /// How far the skin stands out beyond its usual bumps at `z` along the leg (m).
    pub(crate) fn bump(&self, z: f64) -> f64 {
        let c = &self.config;
        if c.bump_mm.abs() < NOTHING {
            return 0.0;
        }
        let every = c.bump_every_mm * 1e-3;
        let off = z.rem_euclid(every) - every / 2.0;
        let length = c.bump_length_mm * 1e-3;
        if off.abs() >= length / 2.0 { 0.0 } else { c.bump_mm * 5e-4 * (1.0 + (TAU * off / length).cos()) }
    }

    /// How much stiffer the skin is, and how much more it rubs, at `z` along the leg.
    pub(crate) fn factors(&self, z: f64) -> (f64, f64) {
        let c = &self.config;
        if (c.stiffer_by - 1.0).abs().max((c.drier_by - 1.0).abs()) < NOTHING {
            return (1.0, 1.0);
        }
        let stretch = c.stretch_mm * 1e-3;
        let along = z.rem_euclid(2.0 * stretch);
        let share = (along / EDGE_M).min((stretch - along) / EDGE_M).clamp(0.0, 1.0);
        (1.0 + (c.stiffer_by - 1.0) * share, 1.0 + (c.drier_by - 1.0) * share)
    }

    /// How far the sensor has drifted along the probe's z (N): it reads a press that is not there.
    pub(crate) fn drift_n(&self, now: Stamp) -> f64 {
        -self.config.sensor_drift_n_min / 60.0 * self.elapsed_s(now).max(0.0)
    }

    /// The probe as the leg has it: where it would be if the leg lay where it was drawn.
    pub(crate) fn on_leg(&self, world_from_probe: &Pose<World, Probe>, now: Stamp) -> Pose<World, Probe> {
        let (up, _) = self.lift(now);
        if up.abs() < NOTHING {
            return *world_from_probe;
        }
        // Up from the table is World's -y; a leg that went up sees the probe lower.
        // FRAMES: the leg's own motion is taken off, a translation of the World.
        Pose::<World, World>::assume(Isometry3::translation(0.0, up, 0.0)) * *world_from_probe
    }

    /// How fast the leg moves, in World's axes (m/s).
    pub(crate) fn velocity(&self, now: Stamp) -> Vector3<f64> {
        Vector3::new(0.0, -self.lift(now).1, 0.0)
    }
}

/// From 0 to 1 with no jump in acceleration, and its slope.
fn ease(s: f64) -> (f64, f64) {
    if s >= 1.0 {
        return (1.0, 0.0);
    }
    let s = s.max(0.0);
    (s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * s * s * (1.0 - s) * (1.0 - s))
}

#[cfg(test)]
mod tests {
    use probepath_frames::Span;

    use super::*;

    fn at(s: f64) -> Stamp {
        Stamp::ZERO + Span::from_seconds(s)
    }

    #[test]
    fn the_leg_moves_as_far_and_as_fast_as_said_and_its_speed_is_its_slope() {
        for (config, far) in
            [(DisturbanceConfig::breathing(), 0.005), (DisturbanceConfig::moving_leg(), 0.010)]
        {
            let disturbance = Disturbance::new(config, at(1.0));
            let (mut most, mut worst) = (0.0_f64, 0.0_f64);
            for i in 0..12_000 {
                let t = f64::from(i) * 0.002;
                let (up, speed) = disturbance.lift(at(t));
                let slope = (disturbance.lift(at(t + 1e-4)).0 - disturbance.lift(at(t - 1e-4)).0) / 2e-4;
                most = most.max(up);
                worst = worst.max((speed - slope).abs());
            }
            assert!((most - far).abs() < 1e-4, "{most}");
            assert!(worst < 1e-4, "{worst}");
            assert_eq!(disturbance.lift(at(0.9)), (0.0, 0.0));
        }
    }

    #[test]
    fn a_leg_that_rises_sees_the_probe_deeper() {
        let disturbance = Disturbance::new(DisturbanceConfig::moving_leg(), at(0.0));
        // FRAMES: any probe in the World.
        let probe = Pose::<World, Probe>::assume(Isometry3::translation(0.0, -0.1, 0.0));
        let seen = disturbance.on_leg(&probe, at(10.0)).origin().vector();
        assert!((seen.y - (-0.1 + 0.010)).abs() < 1e-12, "{seen}");
        assert_eq!(disturbance.on_leg(&probe, at(3.0)), probe);
    }

    #[test]
    fn a_bump_is_as_high_and_long_as_said_and_a_stretch_as_hard() {
        let bump = Disturbance::new(DisturbanceConfig::bump(), at(0.0));
        let heights: Vec<f64> = (-600..600).map(|i| bump.bump(f64::from(i) * 1e-4)).collect();
        assert!((heights.iter().copied().fold(0.0, f64::max) - 0.005).abs() < 1e-6);
        assert_eq!(heights.iter().filter(|h| **h > 0.0).count(), 2 * 99);
        let hard = Disturbance::new(DisturbanceConfig::hard_and_dry(), at(0.0));
        assert_eq!((hard.factors(0.015), hard.factors(0.045)), ((1.5, 5.0), (1.0, 1.0)));
    }
}
