//! [`Refusal`]: why an image, or a whole sequence, has no labels.

use thiserror::Error;

use super::Flipped;

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
    /// A sequence with too few images that can be labelled.
    #[error(
        "{labelled} of {images} images have enough dots and a pose, {needed} are needed: see why each image was \
         refused"
    )]
    TooFewImages {
        /// Images of the sequence.
        images: usize,
        /// Those with candidates and a pose.
        labelled: usize,
        /// Those needed.
        needed: usize,
    },
    /// No choice of wires goes with the probe's poses.
    #[error(
        "the wires seen do not move as the probe does: at best {support} of {images} images agree (within \
         {spread_mm:.1} mm), {needed} are needed; is it this phantom, do the poses belong to these images, and does \
         the chain end at the probe?"
    )]
    Disagree {
        /// Images with candidates and a pose.
        images: usize,
        /// Images that agree with the best choice.
        support: usize,
        /// Images needed.
        needed: usize,
        /// How far they are from each other (mm).
        spread_mm: f64,
    },
    /// The phantom stands somewhere else.
    #[error(
        "{support} of {images} images agree with each other, but the phantom is not where it is said to be: it is \
         {off_mm:.0} mm and {off_deg:.0} degrees from there, as far as these poses tell; check PhantomToReference \
         (its direction, its date), or leave the place open"
    )]
    WrongPlace {
        /// Images with candidates and a pose.
        images: usize,
        /// Images that agree with each other.
        support: usize,
        /// How far off it is (mm).
        off_mm: f64,
        /// How far it is turned (degrees).
        off_deg: f64,
    },
    /// The image is mirrored, or lies on the probe the wrong way.
    #[error(
        "{support} of {images} images agree, but as images that are {flipped}: give the sequence's true \
         orientation; or, where the probe did look at the phantom from the other side, say so (--any-side)"
    )]
    Mirrored {
        /// How.
        flipped: Flipped,
        /// Images with candidates and a pose.
        images: usize,
        /// Images that agree.
        support: usize,
    },
    /// The phantom's file is mirrored.
    #[error(
        "{support} of {images} images agree (within {spread_mm:.1} mm) only when one axis of the phantom is \
         reversed: a sign or the order of two coordinates in the phantom's file is wrong, or the tracker's axes are \
         left-handed"
    )]
    MirroredPhantom {
        /// Images with candidates and a pose.
        images: usize,
        /// Images that agree.
        support: usize,
        /// How far they are from each other (mm).
        spread_mm: f64,
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
            Self::TooFewImages { .. } => "too_few_images",
            Self::Disagree { .. } => "poses_disagree",
            Self::WrongPlace { .. } => "wrong_place",
            Self::Mirrored { .. } => "mirrored",
            Self::MirroredPhantom { .. } => "mirrored_phantom",
        }
    }
}
