//! Why there is no calibration.

use thiserror::Error;

/// A fit that cannot be made, or whose answer is none.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FitError {
    /// An option that makes no sense.
    #[error("option {field} is {found}; it has to be {wanted}")]
    Option {
        /// The option.
        field: &'static str,
        /// What it is.
        found: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// A dot of a wire that the phantom has not.
    #[error("image {image}: a dot is labelled wire {wire}, the phantom has {wires} (0 to {})", wires.saturating_sub(1))]
    NoSuchWire {
        /// The image.
        image: usize,
        /// The label.
        wire: usize,
        /// How many there are.
        wires: usize,
    },
    /// A dot that is no number, or whose covariance is none.
    #[error("image {image}: the dot of wire {wire} has {what}")]
    Dot {
        /// The image.
        image: usize,
        /// Its label.
        wire: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// Too little was seen.
    #[error(
        "{dots} labelled dots in {images} images cannot determine {parameters} parameters: at least {needed} dots \
         in 3 images are needed; capture more images over the phantom"
    )]
    TooFew {
        /// Dots that could take part.
        dots: usize,
        /// Images that could take part.
        images: usize,
        /// What is to be found.
        parameters: usize,
        /// Dots that would do.
        needed: usize,
    },
    /// The track does not cover the images.
    #[error(
        "the track has a pose for {inside} of {images} images at lag {lag_s:.3} s: images and poses are of other \
         times, or of other clocks"
    )]
    OutsideTrack {
        /// Images with a pose.
        inside: usize,
        /// Images.
        images: usize,
        /// The lag that was tried.
        lag_s: f64,
    },
    /// No start was found.
    #[error("no start for the fit: {why}")]
    NoStart {
        /// Why, and what to do.
        why: String,
    },
    /// The linear solution is not rigid.
    #[error(
        "the linear solution is no rigid image: columns and rows are {shear_deg:.1} degrees from a right angle, a pixel \
         is {column:.3} x {row:.3} times as large as said; the phantom's file, the poses' names or the pixel spacing \
         is wrong"
    )]
    NotRigid {
        /// Angle between columns and rows, less 90 degrees.
        shear_deg: f64,
        /// Length of a column's step over the nominal one.
        column: f64,
        /// Length of a row's step over the nominal one.
        row: f64,
    },
    /// The fit ended at a pixel of negative size.
    #[error(
        "the image is mirrored: its pixels come out as {column:.3} x {row:.3} times the size said; flip the images, or \
         correct their orientation"
    )]
    Mirrored {
        /// Factor of the columns.
        column: f64,
        /// Factor of the rows.
        row: f64,
    },
    /// Dots and poses leave something open.
    #[error("{parameter} is not determined by these images: {advice}")]
    Undetermined {
        /// The parameter that dominates what is open.
        parameter: &'static str,
        /// What to do.
        advice: String,
    },
    /// The lag ran out of what was allowed.
    #[error(
        "the lag comes out at {lag_s:.3} s, beyond {from_s:.3} to {to_s:.3} s: allow more, or see whether images and \
         poses are of the same clock"
    )]
    LagBeyond {
        /// Where it ran.
        lag_s: f64,
        /// The earliest allowed.
        from_s: f64,
        /// The latest allowed.
        to_s: f64,
    },
    /// The fit ran into numbers that are none.
    #[error("the fit does not converge from this start: the labels or the start are wrong")]
    Diverged,
}
