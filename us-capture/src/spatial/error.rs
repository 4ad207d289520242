//! Why an image is not used, and why there is no calibration.

use std::collections::BTreeMap;
use std::fmt;

use thiserror::Error;

use crate::dots::BadDots;
use crate::fit::FitError;
use crate::label::Refusal;
use crate::sequence::SkipReason;

/// Why an image is not used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Reason {
    /// There is no picture, or not one that may be used.
    #[error("{0}")]
    Image(SkipReason),
    /// Its dots could not be given wires.
    #[error(transparent)]
    Labels(#[from] Refusal),
}

impl Reason {
    /// A short name that stays the same from version to version, for tables and programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Image(SkipReason::NoPicture) => "no_picture",
            Self::Image(_) => "image_invalid",
            Self::Labels(refusal) => refusal.code(),
        }
    }
}

/// How often images were refused for each reason, with the first one's words.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Refused(pub BTreeMap<&'static str, (usize, String)>);

impl Refused {
    /// Counts reasons.
    pub fn count<'a>(reasons: impl IntoIterator<Item = &'a Reason>) -> Self {
        let mut counted = BTreeMap::new();
        for reason in reasons {
            counted.entry(reason.code()).or_insert_with(|| (0, reason.to_string())).0 += 1;
        }
        Self(counted)
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (code, (count, why))) in self.0.iter().enumerate() {
            let comma = if index > 0 { "; " } else { "" };
            write!(f, "{comma}{count} x {code} (the first: {why})")?;
        }
        Ok(())
    }
}

/// A calibration that cannot be made.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SpatialError {
    /// A mask or setting of the dots is no use.
    #[error(transparent)]
    Dots(#[from] BadDots),
    /// Too few images show the phantom.
    #[error(
        "{labelled} of {images} images show phantom {phantom}, {needed} are needed. Why the others were refused: \
         {refused}"
    )]
    TooFewImages {
        /// Images with labels.
        labelled: usize,
        /// Images.
        images: usize,
        /// Images that would do.
        needed: usize,
        /// The phantom.
        phantom: String,
        /// Why the others have none.
        refused: Refused,
    },
    /// The images show something, but not one phantom from one probe.
    #[error(transparent)]
    NoAgreement(Refusal),
    /// The probe stood still.
    #[error(
        "the probe moved {moved_mm:.2} mm and turned {turned_deg:.2} degrees in {images} images: poses that do not move \
         calibrate nothing. Is this the probe's transform, and did the tracker see it?"
    )]
    StoodStill {
        /// Images.
        images: usize,
        /// Farthest from the first pose (mm).
        moved_mm: f64,
        /// Farthest turned from the first pose (degrees).
        turned_deg: f64,
    },
    /// One calibration repeats nothing.
    #[error("{calibrations} calibrations have no spread: ask for two or more")]
    NothingToCompare {
        /// How many were asked for.
        calibrations: usize,
    },
    /// The fit.
    #[error(transparent)]
    Fit(#[from] FitError),
}
