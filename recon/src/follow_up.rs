//! Two exams of one leg: laid on one another along the vessel, and compared section by section.
//!
//! The leg never lies as it lay before, and a scan begins where it begins. What both exams have in common is the
//! vessel: how its radius changes along it, and how it bends. The shift along the vessel and the rigid motion that
//! bring both together best are found from these ([`FollowUp::shift_mm`], [`FollowUp::earlier_from_later`]); then areas
//! are compared where both measured. A difference counts when it is larger than both exams' errors together explain:
//! what each left open at random, what each shared over its scan, and the shift's own error. So many sections are
//! looked at that some would differ by chance: the limit is set such that two exams of an unchanged leg show any
//! change in at most [`FALSE_ALARM`] of the cases.

mod change;
mod profile;
mod register;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use change::{AreaChange, ChangedStretch, StenosisChange};
use profile::Profile;

use crate::Section;

/// Two exams of a leg in which nothing changed show a change in at most this part of the cases.
pub const FALSE_ALARM: f64 = 0.05;
/// The exams have to share this much vessel (mm).
const LEAST_MM: f64 = 20.0;

/// A later exam beside an earlier one.
#[derive(Clone, Debug, PartialEq)]
pub struct FollowUp {
    /// A place of the later exam is this much farther along the earlier one (mm).
    pub shift_mm: f64,
    /// Standard deviation of the shift (mm); large where the vessel looks the same everywhere.
    pub shift_sd_mm: f64,
    /// How the leg lies now, against how it lay: brings the later exam's points to the earlier one's World.
    pub earlier_from_later: Isometry3<f64>,
    /// Root mean square distance of the centrelines after that (mm).
    pub centrelines_apart_mm: f64,
    /// Where both measured, in the earlier exam's places (mm).
    pub overlap_mm: [f64; 2],
    /// Every section of the overlap.
    pub areas: Vec<AreaChange>,
    /// A difference of this many standard deviations is a change.
    pub limit: f64,
    /// Stretches whose area changed, along the vessel.
    pub changed: Vec<ChangedStretch>,
    /// Stenoses that both have, or one.
    pub stenoses: Vec<StenosisChange>,
    /// Mean change of the area (%), and its 95 % interval.
    pub mean_percent: f64,
    /// That interval.
    pub mean_percent_interval: [f64; 2],
}

/// What keeps two exams from being compared.
#[derive(Clone, Debug, Error, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum FollowUpError {
    /// Too little was measured in one of them.
    #[error(
        "the {which} exam measured {measured_mm:.0} mm of vessel; {} mm are needed to find the place again",
        LEAST_MM
    )]
    Short {
        /// Earlier or later.
        which: String,
        /// What was measured (mm).
        measured_mm: f64,
    },
    /// No shift brings them together.
    #[error(
        "the exams do not look like the same vessel: at best their radii are {apart_mm:.2} mm apart where their errors \
         explain {expected_mm:.2} mm"
    )]
    Unlike {
        /// Median difference of the radii (mm).
        apart_mm: f64,
        /// What would be usual (mm).
        expected_mm: f64,
    },
}

/// Compares a later exam's sections with an earlier one's.
///
/// # Errors
/// When one of them is too short, or they are not of the same vessel.
pub fn follow_up(earlier: &[Section], later: &[Section]) -> Result<FollowUp, FollowUpError> {
    let before = Profile::of(earlier, "earlier")?;
    let after = Profile::of(later, "later")?;
    let found = register::register(&before, &after)?;
    let areas = change::areas(&before, &after, &found);
    let limit = change::limit(&areas);
    let [mean_percent, sd] = change::mean_percent(&areas);
    let reach = crate::section::TWO_SIDED_95 * sd;
    let ends = areas.first().zip(areas.last());
    Ok(FollowUp {
        shift_mm: found.shift,
        shift_sd_mm: found.shift_sd,
        earlier_from_later: found.pose,
        centrelines_apart_mm: found.apart_mm,
        overlap_mm: ends.map_or([0.0; 2], |(first, last)| [first.at_mm, last.at_mm]),
        changed: change::stretches(&areas, limit),
        stenoses: change::stenoses([earlier, later], &found),
        areas,
        limit,
        mean_percent,
        mean_percent_interval: [mean_percent - reach, mean_percent + reach],
    })
}

#[cfg(test)]
mod tests;
