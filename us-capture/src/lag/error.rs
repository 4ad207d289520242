//! Why there is no line, or no lag.

use thiserror::Error;

/// Why an image shows no plane.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NoLine {
    /// Pixels that do not make the picture.
    #[error("{bytes} pixels do not make a picture of {width} x {height}")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels that came.
        bytes: usize,
    },
    /// Nothing stands out in enough columns.
    #[error(
        "only {columns} columns show anything {contrast_grey:.0} grey levels over what lies around it, \
         {needed} are needed: raise the gain, or let the plane reach further across the image"
    )]
    Dark {
        /// Columns with an echo.
        columns: usize,
        /// Columns needed.
        needed: usize,
        /// The contrast asked for.
        contrast_grey: f64,
    },
    /// What stands out lies on no common line.
    #[error(
        "no straight line: the best one passes through {on_it} of {columns} columns that show an echo; \
         mask what is not the plane"
    )]
    Scattered {
        /// Columns on the best line.
        on_it: usize,
        /// Columns with an echo.
        columns: usize,
    },
    /// Two lines are as bright.
    #[error(
        "two lines are as bright: at rows {first_row:.0} and {second_row:.0} in the middle column; mask one of them"
    )]
    TwoLines {
        /// Row of the first in the image's middle column.
        first_row: f64,
        /// Row of the second.
        second_row: f64,
    },
}

impl NoLine {
    /// The reason as one word, for counting.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Size { .. } => "wrong_size",
            Self::Dark { .. } => "no_echo",
            Self::Scattered { .. } => "no_line",
            Self::TwoLines { .. } => "two_lines",
        }
    }
}

/// Why there is no lag.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NoLag {
    /// A number that is none.
    #[error(
        "the plane's position at {at_s:.3} s is not a finite number, or its standard deviation is negative"
    )]
    NotFinite {
        /// The image's stamp.
        at_s: f64,
    },
    /// Too few images.
    #[error("{images} images show the plane, {needed} are needed: record longer")]
    TooFewImages {
        /// Images with a position.
        images: usize,
        /// Images needed.
        needed: usize,
    },
    /// Too few poses.
    #[error("{poses} poses are in the track, {needed} are needed")]
    TooFewPoses {
        /// Poses.
        poses: usize,
        /// Poses needed.
        needed: usize,
    },
    /// Images and poses of different times.
    #[error(
        "images ({images_from_s:.3} to {images_until_s:.3} s) and poses ({poses_from_s:.3} to {poses_until_s:.3} s) \
         share too little time with lags up to {most_lag_s} s: record both together, stamped by one clock"
    )]
    NoOverlap {
        /// First image.
        images_from_s: f64,
        /// Last image.
        images_until_s: f64,
        /// First pose.
        poses_from_s: f64,
        /// Last pose.
        poses_until_s: f64,
        /// Lags tried.
        most_lag_s: f64,
    },
    /// The probe hardly moved.
    #[error(
        "the probe moved only {moved_mm:.3} mm (root mean square), {least_mm:.1} are needed: \
         move it up and down over the plane by 10 mm and more"
    )]
    ProbeStill {
        /// How far it moved.
        moved_mm: f64,
        /// How far it has to.
        least_mm: f64,
    },
    /// The plane hardly moved in the image.
    #[error(
        "the plane moved only {moved_px:.2} pixels in the image, {least_px} are needed: \
         move the probe toward it and away from it"
    )]
    PlaneStill {
        /// How far, 5th to 95th percentile.
        moved_px: f64,
        /// How far it has to.
        least_px: f64,
    },
    /// Pose and image have nothing to do with each other.
    #[error(
        "the pose explains the plane's position with a correlation of {correlation:.2} at best, {least} are needed: \
         is it the transform of this probe, and does the line stand still in the room?"
    )]
    Unrelated {
        /// The best of all lags.
        correlation: f64,
        /// The least that is believed.
        least: f64,
    },
    /// The best lag is the last one tried.
    #[error("the best lag is the last one tried, {lag_s:.3} s: try lags beyond {most_lag_s} s")]
    AtTheEnd {
        /// The lag.
        lag_s: f64,
        /// Lags tried.
        most_lag_s: f64,
    },
    /// Another lag is as good.
    #[error(
        "lags of {lag_s:.3} and {other_s:.3} s explain the images as well as each other, as they do when the motion \
         repeats itself: vary its speed and its reach, or try fewer lags"
    )]
    Ambiguous {
        /// The best.
        lag_s: f64,
        /// The next.
        other_s: f64,
    },
    /// Any shift in time looks like a change of place.
    #[error(
        "the motion is too uniform: what a lag changes looks like another place or direction of the plane \
         ({told_apart:.2} of it can be told apart from noise, {least} are needed); stop and reverse"
    )]
    TooUniform {
        /// Part of the velocity's power that is neither explained otherwise nor noise.
        told_apart: f64,
        /// What is needed.
        least: f64,
    },
    /// Found, but of no use.
    #[error(
        "the lag ({lag_s:.3} s) has a standard error of {standard_error_s:.4} s, {worst_s} is the limit: \
         move faster and further, with stops and reversals, or record longer"
    )]
    TooUncertain {
        /// The lag.
        lag_s: f64,
        /// Its standard error.
        standard_error_s: f64,
        /// The limit.
        worst_s: f64,
    },
}
