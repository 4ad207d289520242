//! [`UrSettings`]: what is known of the arm before it is connected.

use std::time::Duration;

use nalgebra::Vector3;
use probepath_frames::{Flange, Pose, Probe, Span};

use super::UrError;
use super::script::Parameters;
use crate::Model;

/// What is known of an arm before it is connected.
#[derive(Clone, Debug)]
pub struct UrSettings {
    /// The arm's model; the controller is asked whether it agrees about where the flange is.
    pub model: Model,
    /// Where the probe is on the flange.
    pub flange_from_probe: Pose<Flange, Probe>,
    /// What the flange carries: probe, holder, a part of the cable (kg).
    pub payload_kg: f64,
    /// Its centre of gravity from the flange, in the flange's axes (m).
    pub centre_of_gravity_m: Vector3<f64>,
    /// How long our script waits for the next command of a moving arm until it stops it.
    pub watchdog: Span,
    /// How long we wait for the controller's next package.
    pub silence: Span,
    /// servoj's lookahead (s), 0.03 to 0.2: shorter lags less and smooths less.
    pub lookahead_s: f64,
    /// servoj's gain, 100 to 2000: higher follows harder.
    pub gain: f64,
    /// How far (m) the model's flange may be from where the controller says it is. A controller knows its own arm's
    /// deviations from the drawing, a model does not: some millimetres are normal.
    pub model_within_m: f64,
    /// The same as an angle (rad).
    pub model_within_rad: f64,
    /// Whether the controller's clock is moved by our packages, as a simulated one's may be: then nothing is ever
    /// late, and every [`age`](crate::State::age) is zero.
    pub stepped: bool,
}

/// The heaviest load of the largest arm (kg).
const HEAVIEST_KG: f64 = 35.0;
/// How far from the flange a centre of gravity is believed (m).
const FURTHEST_M: f64 = 1.0;
/// One tick.
pub(super) const TICK: Span = Span::from_milliseconds(2);

impl UrSettings {
    /// The usual settings for an arm with this model and tool.
    pub fn new(
        model: Model,
        flange_from_probe: Pose<Flange, Probe>,
        payload_kg: f64,
        centre_of_gravity_m: Vector3<f64>,
    ) -> Self {
        Self {
            model,
            flange_from_probe,
            payload_kg,
            centre_of_gravity_m,
            watchdog: Span::from_milliseconds(40),
            silence: Span::from_milliseconds(100),
            lookahead_s: 0.03,
            gain: 300.0,
            model_within_m: 0.02,
            model_within_rad: 0.035,
            stepped: false,
        }
    }

    /// That everything can be.
    pub(super) fn check(&self) -> Result<(), UrError> {
        let joints = self.model.joints();
        let centre = self.centre_of_gravity_m.norm();
        let within = [
            ("the number of the model's joints", joints as f64, 6.0, 6.0, "a UR arm has 6"),
            ("payload_kg", self.payload_kg, 0.0, HEAVIEST_KG, "no UR arm carries that; is it in kg?"),
            ("centre_of_gravity_m", centre, 0.0, FURTHEST_M, "that is far from the flange; is it in metres?"),
            ("lookahead_s", self.lookahead_s, 0.03, 0.2, "servoj takes 0.03 to 0.2"),
            ("gain", self.gain, 100.0, 2000.0, "servoj takes 100 to 2000"),
            ("model_within_m", self.model_within_m, 1e-4, 0.2, "it is between 0.1 mm and 200 mm"),
            ("model_within_rad", self.model_within_rad, 1e-4, 0.5, "it is between 0.0001 and 0.5"),
            ("watchdog in s", self.watchdog.seconds(), 0.01, 0.2, "it is between 10 and 200 ms"),
        ];
        for (name, value, low, high, why) in within {
            // Written so that NaN is refused too.
            if !(value >= low && value <= high) {
                return Err(UrError::Setting { name, value, why });
            }
        }
        if self.silence <= Span::ZERO {
            return Err(UrError::Time { name: "silence", value: self.silence });
        }
        if !self.flange_from_probe.is_finite() {
            return Err(UrError::Setting {
                name: "flange_from_probe",
                value: f64::NAN,
                why: "it is not finite",
            });
        }
        Ok(())
    }

    /// What is written into the script.
    pub(super) fn parameters(&self) -> Parameters {
        Parameters {
            watchdog_ticks: u32::try_from(self.watchdog.nanoseconds() / TICK.nanoseconds()).unwrap_or(1),
            watchdog_hz: 10.0,
            lookahead_s: self.lookahead_s,
            gain: self.gain,
            mass_kg: self.payload_kg,
            centre_of_gravity_m: self.centre_of_gravity_m,
        }
    }

    /// How long the next package is waited for.
    pub(super) fn patience(&self) -> Duration {
        if self.stepped {
            super::link::PATIENCE
        } else {
            Duration::from_nanos(self.silence.nanoseconds().unsigned_abs())
        }
    }
}
