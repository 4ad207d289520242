//! Why there is no cell.

use probepath_robot::{ModelError, NoInverse};
use probepath_us_capture::phantom::BadPhantom;
use thiserror::Error;

use crate::ultrasound::ImagingError;

/// Why a simulated cell could not be built.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CellError {
    /// A number of the configuration that nothing can have.
    #[error("the cell's {field} is {value}; it may be {low} to {high}")]
    Config {
        /// Which field.
        field: String,
        /// What it is.
        value: f64,
        /// The least it may be.
        low: f64,
        /// The most it may be.
        high: f64,
    },
    /// The arm's true chain, which is its model with small errors, is no model.
    #[error("the simulated arm's true chain cannot be built: choose a smaller arm.kinematic_error")]
    Model(#[from] ModelError),
    /// The arm's URDF could not be read or written.
    #[error("the simulated arm's URDF cannot be changed: {why}")]
    Urdf {
        /// The cause, in words.
        why: String,
    },
    /// The ultrasound machine's pictures cannot be made as machine.imaging says.
    #[error("the cell's machine.imaging cannot be")]
    Imaging(#[from] ImagingError),
    /// There is no such wire phantom.
    #[error(
        "the cell's wire phantom is named {named:?}; name one that ships ({shipped}) or a phantom's file"
    )]
    Phantom {
        /// What the configuration says.
        named: String,
        /// What ships.
        shipped: String,
        /// Why it could not be read.
        source: Box<BadPhantom>,
    },
    /// The start posture over the table, or one with the pointer in a landmark, is not reached.
    #[error("the arm does not reach where it has to over the table")]
    Start(#[from] NoInverse),
}

impl CellError {
    pub(crate) fn urdf(error: &urdf_rs::UrdfError) -> Self {
        Self::Urdf { why: error.to_string() }
    }
}
