//! [`Refusal`]: why an image, or a whole sequence, has no labels.

use thiserror::Error;

/// Why no wires could be given to the dots: what was found, and what to do about it.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// Nothing that looks like a wire.
    #[error(
        "no dot was found: the phantom is not in the image, or the gain is too low; move the probe over the wires"
    )]
    NoDots,
    /// Too few for any statement.
    #[error(
        "{found} dots were found and {needed} are needed: bring more wires of the phantom into the image, raise \
         the gain, or widen the region of interest"
    )]
    TooFewDots {
        /// Dots found.
        found: usize,
        /// Dots needed.
        needed: usize,
    },
    /// A number of a dot, of the pixel size or of the predicted pose is no number.
    #[error("{what} is not a finite number, or not positive: the image cannot be measured")]
    NotANumber {
        /// What it is.
        what: &'static str,
    },
    /// The dots do not lie as the wires of this phantom can.
    #[error(
        "no plane through phantom {phantom} explains the {dots} dots: the best explains {explained} of them and \
         misses {missing} wires that should be seen; is it this phantom, and is the pixel size \
         ({spacing_mm:.4} mm) right?"
    )]
    NothingFits {
        /// The phantom.
        phantom: String,
        /// Dots found.
        dots: usize,
        /// Dots that the best plane explains.
        explained: usize,
        /// Wires that the best plane should show and no dot is there.
        missing: usize,
        /// Mean pixel size the dots were measured with (mm).
        spacing_mm: f64,
    },
    /// The dots are where the prediction has no wire.
    #[error(
        "{explained} of {dots} dots lie within {gate_mm:.1} mm of where the wires were predicted, {needed} are \
         needed: the probe moved too fast for its poses, the image is off the phantom, or its dots were not found"
    )]
    NotNear {
        /// Dots found.
        dots: usize,
        /// Dots explained.
        explained: usize,
        /// Dots needed.
        needed: usize,
        /// How far a dot may be from its prediction (mm).
        gate_mm: f64,
    },
    /// Two choices explain the dots as well.
    #[error(
        "two choices of wires explain the dots equally well ({first} and {second} of {dots} dots): show more wires, \
         or give the poses of a whole sequence, which tell them apart"
    )]
    Ambiguous {
        /// Dots found.
        dots: usize,
        /// Dots explained by the first choice.
        first: usize,
        /// Dots explained by the second.
        second: usize,
    },
    /// The wires that are seen are cut by the edge.
    #[error(
        "{cut} of {dots} dots are cut by the edge of the image or of the region of interest: centre the phantom, or \
         widen the region"
    )]
    AtEdge {
        /// Dots found.
        dots: usize,
        /// Dots that are cut.
        cut: usize,
    },
}

impl Refusal {
    /// A short name that stays the same from version to version, for tables and programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::NoDots => "no_dots",
            Self::TooFewDots { .. } => "too_few_dots",
            Self::NotANumber { .. } => "not_a_number",
            Self::NothingFits { .. } => "nothing_fits",
            Self::NotNear { .. } => "not_near",
            Self::Ambiguous { .. } => "ambiguous",
            Self::AtEdge { .. } => "at_edge",
        }
    }
}
