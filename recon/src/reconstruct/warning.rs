//! What a reconstruction has to say of itself.

use serde::Serialize;
use thiserror::Error;

/// What does not spoil a reconstruction, but has to be said with it.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[non_exhaustive]
pub enum ReconWarning {
    /// No image shows the lumen along a stretch.
    #[error("no lumen was seen from {from_mm:.1} to {to_mm:.1} mm: nothing is measured there")]
    Gap {
        /// Where it begins (mm).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
    },
    /// The dark region runs on into another vessel.
    #[error(
        "near {from_mm:.1} to {to_mm:.1} mm the lumen runs on into a branch or a vein: areas there are less sure"
    )]
    Branch {
        /// Where it begins (mm).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
    },
    /// Sweeps over the same stretch lie apart.
    #[error(
        "two sweeps over {from_mm:.1} to {to_mm:.1} mm lie {by_mm:.1} mm apart: the probe's pose or the leg has moved \
         between them"
    )]
    SweepsDisagree {
        /// By how much (mm).
        by_mm: f64,
        /// Where the stretch begins (mm).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
    },
    /// A branch that does not come near another vessel.
    #[error("vessel {vessel} was not seen to leave another one: its surface stands by itself")]
    NotJoined {
        /// Its number.
        vessel: usize,
    },
    /// A branch of too few contours.
    #[error("vessel {vessel} has no surface: {why}")]
    NoBranch {
        /// Its number.
        vessel: usize,
        /// What was missing.
        why: String,
    },
    /// The vessel bends more sharply than it is wide.
    #[error(
        "from {from_mm:.1} to {to_mm:.1} mm sections normal to the vessel would cross inside it: not all are measured"
    )]
    Crossing {
        /// Where it begins (mm).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
    },
    /// The chosen reference is not there.
    #[error(
        "the chosen reference, {from_mm:.1} to {to_mm:.1} mm, holds no 2 mm that are measured: no stenosis is judged"
    )]
    NoReference {
        /// Where it begins (mm).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
    },
    /// The probe pressed hard.
    #[error(
        "from {from_mm:.1} to {to_mm:.1} mm the probe pressed with up to {most_n:.1} N: the artery may be flattened"
    )]
    Pressed {
        /// Where it begins (mm).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
        /// The largest force (N).
        most_n: f64,
    },
    /// The lumen is flatter where the probe pressed harder.
    #[error(
        "the lumen is flatter where the probe pressed harder: its smallest width falls by {percent_per_n:.1} % of the \
         largest for each newton (forces {least_n:.1} to {most_n:.1} N)"
    )]
    Flattened {
        /// How much flatter for each newton (%).
        percent_per_n: f64,
        /// The least force (N).
        least_n: f64,
        /// The largest (N).
        most_n: f64,
    },
    /// Many images without a lumen.
    #[error("no lumen was seen in {percent:.0} % of the images")]
    ManyWithout {
        /// Their part (%).
        percent: f64,
    },
}
