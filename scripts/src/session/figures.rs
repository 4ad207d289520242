//! What a scan is judged by: the contact force while the path was followed, and how far the probe was from it.

use nalgebra::Vector3;
use probepath_frames::{Base, Pose, Probe, Stamp};
use probepath_robot::Tick;
use probepath_robot::motion::follow::{Curve, PoseCurve};

use super::recorder::Stand;
use crate::report::ForceFigures;

/// The servo lags by less than this (m).
const REACH: f64 = 0.002;

/// Sums over the ticks of one replay.
pub(super) struct Figures {
    curve: PoseCurve,
    set_n: f64,
    followed: u64,
    force_squares: f64,
    path_squares: f64,
    /// Largest pressing force before the path was followed (N).
    touch_most_n: f64,
    most_n: f64,
    span: Option<(Stamp, Stamp)>,
}

impl Figures {
    /// Nothing seen yet, of a replay along `curve` at `set_n`.
    pub(super) const fn new(curve: PoseCurve, set_n: f64) -> Self {
        Self {
            curve,
            set_n,
            followed: 0,
            force_squares: 0.0,
            path_squares: 0.0,
            touch_most_n: 0.0,
            most_n: 0.0,
            span: None,
        }
    }

    /// One tick of the replay.
    pub(super) fn tick(&mut self, tick: &Tick, stand: &Stand, base_from_probe: &Pose<Base, Probe>) {
        let pressing = -tick.state.wrench.force.z;
        self.most_n = self.most_n.max(pressing);
        if matches!(stand.phase, "descend" | "settle") {
            self.touch_most_n = self.touch_most_n.max(pressing);
        }
        let (Some(along), "follow") = (stand.along_m, stand.phase) else { return };
        self.followed += 1;
        let stamp = tick.state.stamp;
        self.span = Some((self.span.map_or(stamp, |(first, _)| first), stamp));
        self.force_squares += (pressing - self.set_n).powi(2);
        self.path_squares += self.beside(along, base_from_probe).powi(2);
    }

    /// Distance of the probe's origin to the path (m), across the probe's axis: along it the force decides, and along
    /// the path the servo's lag is time, not error.
    fn beside(&self, along: f64, base_from_probe: &Pose<Base, Probe>) -> f64 {
        let here = base_from_probe.origin().vector();
        let (mut at, mut beside) = (along, 0.0);
        for _ in 0..4 {
            let point = self.curve.at(at);
            let axis = point.base_from_probe.z_axis().vector();
            let across = |v: Vector3<f64>| v - axis * v.dot(&axis);
            let off = across(here - point.base_from_probe.origin().vector());
            let forward = across(point.origin[0]);
            let step = off.dot(&forward) / forward.norm_squared().max(1e-12);
            beside = (off - forward * step).norm();
            at = (at + step).clamp(along - REACH, along + REACH);
        }
        beside
    }

    /// When the path was followed: first and last tick.
    pub(super) const fn followed(&self) -> Option<(Stamp, Stamp)> {
        self.span
    }

    /// How the force was held (N).
    pub(super) fn force(&self) -> ForceFigures {
        ForceFigures {
            set: self.set_n,
            rms_error: (self.force_squares / self.followed.max(1) as f64).sqrt(),
            overshoot: (self.touch_most_n - self.set_n).max(0.0),
            max: self.most_n,
        }
    }

    /// RMS distance to the path (mm).
    pub(super) fn path_rms_mm(&self) -> f64 {
        1e3 * (self.path_squares / self.followed.max(1) as f64).sqrt()
    }
}
