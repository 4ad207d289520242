//! Why a replay is refused, and where.

use std::fmt;

use probepath_robot::motion::timing::TimingError;
use probepath_robot::{LimitsError, NoInverse, NoMove};
use thiserror::Error;

/// A replay that is refused: where, and why.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{place}: {refusal}")]
pub struct PlanError {
    /// Where.
    pub place: Place,
    /// Why.
    #[source]
    pub refusal: Refusal,
}

impl PlanError {
    pub(super) const fn new(place: Place, refusal: Refusal) -> Self {
        Self { place, refusal }
    }
}

/// Where in the replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Before anything moves.
    Start,
    /// On the way through the air; counted from 1: up, over, down.
    Approach {
        /// Which part.
        leg: usize,
    },
    /// Over the beginning of the path.
    Standoff,
    /// A stop of a round; counted from 1.
    Stop {
        /// Which.
        stop: usize,
    },
    /// On the path.
    Path {
        /// Distance along it (mm).
        at_mm: f64,
        /// Distance off it along the probe's axis (mm); into the tissue is positive.
        offset_mm: f64,
    },
}

impl Place {
    pub(super) const fn path(s: f64, offset: f64) -> Self {
        Self::Path { at_mm: s * 1e3, offset_mm: offset * 1e3 }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => write!(f, "before the start"),
            Self::Approach { leg } => write!(f, "approach, part {leg} of 3 (up, over, down)"),
            Self::Stop { stop } => write!(f, "stop {stop} of the round"),
            Self::Standoff => write!(f, "over the beginning of the path"),
            Self::Path { at_mm, offset_mm } if offset_mm.abs() < 1e-9 => {
                write!(f, "{at_mm:.1} mm along the path")
            }
            Self::Path { at_mm, offset_mm } => {
                write!(f, "{at_mm:.1} mm along the path, {offset_mm:+.1} mm along the probe's axis")
            }
        }
    }
}

/// Why a replay is refused.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// A setting that cannot be.
    #[error("{name} = {value} cannot be: it has to be above zero, at most {most}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The most it may be.
        most: f64,
    },
    /// The arm's limits contradict each other.
    #[error("{0}")]
    Limits(LimitsError),
    /// No posture reaches it.
    #[error("the arm cannot go there: {0}")]
    Unreachable(NoInverse),
    /// Only another posture reaches it.
    #[error(
        "the arm gets there only in another posture, {away:.2} rad away: it would have to leave the skin; \
         start from another posture, or trim the path"
    )]
    OtherPosture {
        /// The joint that differs the most (rad, m).
        away: f64,
    },
    /// A joint gets too near to its limit.
    #[error(
        "joint \"{joint}\" is {left:.3} (rad, m) from its limit, less than {least:.3}: move the base or the patient, or trim the path"
    )]
    JointLimit {
        /// Its name.
        joint: String,
        /// What is left (rad, m).
        left: f64,
        /// What has to be left (rad, m).
        least: f64,
    },
    /// Too near to a singularity.
    #[error(
        "the arm is too near to a singularity (smallest singular value {found:.4}, at least {least}): move the base or the patient"
    )]
    Singular {
        /// The smallest singular value there.
        found: f64,
        /// The least allowed.
        least: f64,
    },
    /// Outside the workspace.
    #[error(
        "the probe would be {beyond_mm:.1} mm beyond plane {plane} of the workspace: the table, a wall; trim the path"
    )]
    Workspace {
        /// The plane, counted from zero.
        plane: usize,
        /// How far beyond (mm).
        beyond_mm: f64,
    },
    /// No motion through the air.
    #[error("{0}")]
    NoMove(NoMove),
    /// No timing.
    #[error("{0}")]
    Timing(TimingError),
    /// The joints' limits allow next to no speed.
    #[error(
        "the joints allow only {speed_mm_s:.2} mm/s of the wanted {wanted_mm_s:.1} mm/s: the path bends too sharply there; teach it more smoothly"
    )]
    Crawl {
        /// What they allow (mm/s).
        speed_mm_s: f64,
        /// What is wanted (mm/s).
        wanted_mm_s: f64,
    },
}
