//! [`ReplaySettings`]: how the skin is touched and the force held.

use probepath_robot::step::StepError;
use probepath_robot::{ContactError, ContactSettings};
use thiserror::Error;

/// How the skin is touched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplaySettings {
    /// The force to hold (N).
    pub force_n: f64,
    /// Above it the motion along the path waits until the force has been given way to (N).
    pub soft_limit_n: f64,
    /// Speed of the descent through the air, and of the lift (m/s).
    pub air_speed: f64,
    /// Speed of the descent where the skin may be (m/s).
    pub touch_speed: f64,
    /// How far before the path's own height the skin may be (m).
    pub skin_within: f64,
    /// Contact begins above it (N).
    pub touch_n: f64,
    /// Rate at which the force is raised to the one to hold (N/s).
    pub ramp_n_s: f64,
    /// Contact is lost below it (N) ...
    pub lost_below_n: f64,
    /// ... for so long (s).
    pub lost_after: f64,
    /// How long the force may take to settle (s).
    pub settle_within: f64,
    /// Speed of the probe at first after a pause (m/s).
    pub resume_speed: f64,
    /// The law that holds the force; its lowest and highest offset come from the plan.
    pub law: ContactSettings,
}

impl Default for ReplaySettings {
    fn default() -> Self {
        Self {
            force_n: 5.0,
            soft_limit_n: 10.0,
            air_speed: 0.02,
            touch_speed: 0.006,
            skin_within: 0.02,
            touch_n: 0.8,
            ramp_n_s: 4.0,
            lost_below_n: 0.4,
            lost_after: 0.03,
            settle_within: 10.0,
            resume_speed: 0.01,
            law: ContactSettings::default(),
        }
    }
}

/// A replay that cannot begin.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ReplayError {
    /// A setting that cannot be.
    #[error("{name} = {value} cannot be: {why}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it has to be.
        why: &'static str,
    },
    /// The contact's law refuses its settings.
    #[error("{0}")]
    Law(#[from] ContactError),
    /// The arm's step cannot be made.
    #[error("{0}")]
    Step(#[from] StepError),
}

impl ReplaySettings {
    /// The force (N) that is held while it is above the soft limit: as far below the usual one as the limit is above.
    pub(super) fn yielding_n(&self) -> f64 {
        (2.0 * self.force_n - self.soft_limit_n).max(0.4 * self.force_n)
    }

    pub(super) fn check(&self) -> Result<(), ReplayError> {
        let numbers = [
            ("force_n", self.force_n, 0.1, 30.0, "0.1 to 30 N"),
            ("soft_limit_n", self.soft_limit_n, self.force_n, 60.0, "above force_n, at most 60 N"),
            ("air_speed", self.air_speed, 1e-4, 0.1, "0.0001 to 0.1 m/s"),
            ("touch_speed", self.touch_speed, 1e-4, 0.02, "0.0001 to 0.02 m/s"),
            ("skin_within", self.skin_within, 0.0, 0.1, "0 to 0.1 m"),
            ("touch_n", self.touch_n, 0.05, self.force_n, "0.05 N to force_n"),
            ("ramp_n_s", self.ramp_n_s, 0.1, 100.0, "0.1 to 100 N/s"),
            ("lost_below_n", self.lost_below_n, 0.0, self.touch_n, "0 N to touch_n"),
            ("lost_after", self.lost_after, 0.002, 1.0, "0.002 to 1 s"),
            ("settle_within", self.settle_within, 0.5, 60.0, "0.5 to 60 s"),
            ("resume_speed", self.resume_speed, 1e-4, 0.02, "0.0001 to 0.02 m/s"),
        ];
        let bad = numbers.into_iter().find(|(_, value, least, most, _)| !(value >= least && value <= most));
        bad.map_or(Ok(()), |(name, value, _, _, why)| Err(ReplayError::Setting { name, value, why }))
    }
}
