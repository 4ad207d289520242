//! The force sensor between the flange and the probe's holder.

use std::collections::VecDeque;

use nalgebra::Vector3;
use probepath_frames::{Probe, Wrench};
use serde::{Deserialize, Serialize};

use crate::random::Stream;

/// How the sensor errs. It feels whatever is beyond it: the skin, and the hand that grips the probe's holder. The
/// tool's weight is taken off without error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorConfig {
    /// Noise of each force axis at every tick, one standard deviation (N).
    pub force_noise_n: f64,
    /// Noise of each torque axis at every tick, one standard deviation (N m).
    pub torque_noise_n_m: f64,
    /// Fastest drift of a force axis (N/min); each drifts steadily at a rate and sign of its own.
    pub drift_n_min: f64,
    /// How much later than the joints the wrench is (ms), in whole ticks.
    pub latency_ms: f64,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self { force_noise_n: 0.08, torque_noise_n_m: 0.004, drift_n_min: 0.05, latency_ms: 4.0 }
    }
}

/// The sensor of one seed.
#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    config: SensorConfig,
    noise: Stream,
    drift_n_s: Vector3<f64>,
    underway: VecDeque<Wrench<Probe>>,
}

impl Sensor {
    /// A sensor that is `config.latency_ms` late, with a tick of `seconds`.
    pub(crate) fn new(config: &SensorConfig, seconds: f64, seed: u64) -> Self {
        let mut fate = Stream::new(seed, "sensor drift");
        let mut rate = || fate.uniform(-1.0, 1.0) * config.drift_n_min / 60.0;
        let drift_n_s = Vector3::new(rate(), rate(), rate());
        let late = (config.latency_ms * 1e-3 / seconds).round() as usize;
        let underway = std::iter::repeat_n(Wrench::zero(), late).collect();
        Self { config: config.clone(), noise: Stream::new(seed, "sensor noise"), drift_n_s, underway }
    }

    /// What it reads `elapsed_s` after its bias was taken off, while `truth` acts.
    pub(crate) fn read(&mut self, truth: Wrench<Probe>, elapsed_s: f64) -> Wrench<Probe> {
        let noise = Wrench::new(
            self.noise.normal3() * self.config.force_noise_n,
            self.noise.normal3() * self.config.torque_noise_n_m,
        );
        let drift = Wrench::new(self.drift_n_s * elapsed_s, Vector3::zeros());
        self.underway.push_back(truth + noise + drift);
        self.underway.pop_front().unwrap_or(truth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_late_by_its_latency_and_noisy_as_said() {
        let config = SensorConfig { force_noise_n: 0.1, drift_n_min: 0.0, ..SensorConfig::default() };
        let mut sensor = Sensor::new(&config, 0.002, 9);
        let press = Wrench::new(Vector3::new(0.0, 0.0, -5.0), Vector3::zeros());
        let read: Vec<f64> = (0..5002).map(|_| sensor.read(press, 0.0).force.z).collect();
        assert!(read[0].abs() < 1e-12 && read[1].abs() < 1e-12 && read[2] < -4.0);
        let (mean, sd) = crate::arm::error::mean_and_deviation(&read[2..]);
        assert!((mean + 5.0).abs() < 0.01 && (sd - 0.1).abs() < 0.01, "{mean} {sd}");
    }

    #[test]
    fn it_drifts_no_faster_than_said() {
        let config =
            SensorConfig { force_noise_n: 0.0, drift_n_min: 0.6, latency_ms: 0.0, ..SensorConfig::default() };
        for seed in 0..50 {
            let read = Sensor::new(&config, 0.002, seed).read(Wrench::zero(), 60.0).force;
            assert!(read.amax() <= 0.6 && read.norm() > 1e-3, "{read}");
        }
    }
}
