//! Why an image has no lumen.

use serde::Serialize;
use thiserror::Error;

/// Why no lumen is given for an image. It is counted and reported, never invented.
#[derive(Clone, Copy, Debug, Error, PartialEq, Serialize)]
#[non_exhaustive]
pub enum NoLumen {
    /// The whole picture is dark.
    #[error("the picture is dark ({mean_db:.0} dB under full scale): no contact, add gel or lower the probe")]
    Dark {
        /// Mean echo of the brighter half (dB).
        mean_db: f64,
    },
    /// Nothing dark and round with a bright border.
    #[error("nothing dark and round with a bright wall was found between {from_mm:.0} and {to_mm:.0} mm")]
    NothingRound {
        /// Depth searched from (mm).
        from_mm: f64,
        /// Depth searched to (mm).
        to_mm: f64,
    },
    /// Where the vessel should be is outside the picture.
    #[error("the vessel would lie outside the picture, at {x_mm:.1}, {y_mm:.1} mm")]
    OutsidePicture {
        /// Right of the first column (mm).
        x_mm: f64,
        /// Below the first row (mm).
        y_mm: f64,
    },
    /// The seed is hardly darker than what surrounds it.
    #[error("the seed is only {contrast_db:.1} dB darker than what surrounds it")]
    NoContrast {
        /// By how much it is darker (dB).
        contrast_db: f64,
    },
    /// The region ran out of the window: an open wall or a shadow.
    #[error("the dark region has no end ({area_mm2:.0} mm2): an open wall or a shadow")]
    NoBorder {
        /// How far it got (mm2).
        area_mm2: f64,
    },
    /// The wall is seen over too little of the circumference.
    #[error("a wall is seen over {percent:.0} % of the circumference only")]
    NoWall {
        /// The part where it is seen (%).
        percent: f64,
    },
    /// The radius is out of the range asked for.
    #[error("the radius would be {radius_mm:.2} mm")]
    Radius {
        /// What it would be (mm).
        radius_mm: f64,
    },
    /// It is too far from where the images before and after have it.
    #[error("it would lie {by_mm:.1} mm from where its neighbours have the vessel")]
    Jump {
        /// How far (mm).
        by_mm: f64,
    },
    /// A wall round a lumen is not what the picture shows there.
    #[error(
        "the picture is {times:.1} times as far from a wall round a lumen as speckle makes it: a shadow or a fold"
    )]
    Misfit {
        /// Mean square residual over the expected one.
        times: f64,
    },
    /// The image says too little about where the border runs.
    #[error("the border could be {sd_mm:.2} mm off where it is least sure: a shadow, or too little contrast")]
    Unsure {
        /// Standard deviation of the least sure point (mm).
        sd_mm: f64,
    },
    /// A contour that something else found is none.
    #[error("the contour {what}")]
    BadContour {
        /// What is wrong with it.
        what: &'static str,
    },
    /// Whatever took the finder's place says that there is none.
    #[error("the finder in the place of ours gave none")]
    Declined,
    /// The fit of the wall did not settle.
    #[error("the fit of the wall did not settle")]
    Unsettled,
}

impl NoLumen {
    /// The reason without its numbers, for counting.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Dark { .. } => "no contact",
            Self::NothingRound { .. } => "nothing round",
            Self::OutsidePicture { .. } => "outside the picture",
            Self::NoContrast { .. } => "no contrast",
            Self::NoBorder { .. } => "no border",
            Self::NoWall { .. } => "no wall",
            Self::Radius { .. } => "radius out of range",
            Self::Jump { .. } => "away from its neighbours",
            Self::Misfit { .. } => "no wall round a lumen",
            Self::Unsure { .. } => "border unsure",
            Self::BadContour { .. } => "no closed contour",
            Self::Declined => "none found",
            Self::Unsettled => "fit did not settle",
        }
    }
}
