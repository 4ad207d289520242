//! What a step keeps, and why none can be made.

use thiserror::Error;

use super::LEAST_JOINTS;
use crate::{LimitsError, MAX_JOINTS, Workspace};

/// What a step keeps besides the joints' limits.
#[derive(Clone, Debug, PartialEq)]
pub struct StepSettings {
    /// Where the probe's origin may be.
    pub workspace: Workspace,
    /// Room that is kept to every plane (m): what the arm may be off from where it was commanded.
    pub margin_m: f64,
    /// The smallest singular value of the probe's Jacobian that is gone to; from six times it on the joints slow down.
    pub least_singular: f64,
    /// Part of the joints' acceleration and jerk that slowing down along the way counts on; the rest keeps the way.
    pub brake_share: f64,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self { workspace: Workspace::new(), margin_m: 0.0005, least_singular: 0.01, brake_share: 0.5 }
    }
}

/// Settings or an arm that no step can be made with, or a goal that is no number.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// A setting that cannot be.
    #[error("the step's {name} is {value}; it must be finite and from {least} to {most}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The least it may be.
        least: f64,
        /// The most it may be.
        most: f64,
    },
    /// Too few joints for six directions, or another number than the limits have.
    #[error("the arm has {found} joints: a probe needs {LEAST_JOINTS} to {MAX_JOINTS}")]
    Joints {
        /// How many.
        found: usize,
    },
    /// The joints' limits cannot be kept.
    #[error("{0}")]
    Limits(#[from] LimitsError),
    /// A pose or a velocity that is not finite; nothing was moved.
    #[error("the {what} of the next step is not finite")]
    NotFinite {
        /// Which.
        what: &'static str,
    },
}

impl StepSettings {
    /// Whether every number can be.
    pub(super) fn check(&self) -> Result<(), StepError> {
        let numbers = [
            ("margin", self.margin_m, 0.0, 0.1),
            ("least singular value", self.least_singular, 1e-4, 1.0),
            ("share of the brake", self.brake_share, 0.05, 1.0),
        ];
        let bad = numbers.into_iter().find(|(_, value, least, most)| !(value >= least && value <= most));
        bad.map_or(Ok(()), |(name, value, least, most)| Err(StepError::Setting { name, value, least, most }))
    }
}
