//! What keeps a reconstruction from being made at all; one image without a lumen is no error
//! ([`NoLumen`](crate::NoLumen)).

use thiserror::Error;

/// Why there is no reconstruction.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ReconError {
    /// No images at all.
    #[error("there are no images to reconstruct from")]
    NoImages,
    /// A setting that makes no sense.
    #[error("setting {name} = {value} {must}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// What it was.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// Pixels without a size, or a pose that is not finite.
    #[error("image {number}: {what} is not usable (not finite, zero or negative)")]
    Image {
        /// The B-scan's number.
        number: u64,
        /// What is wrong.
        what: &'static str,
    },
    /// Too few images show a lumen.
    #[error(
        "a lumen was seen in {seen} of {images} images, at least {needed} are needed (most frequent reason: \
         {reason}); give a seed point, or check depth, gain and contact"
    )]
    TooFew {
        /// Images with a lumen.
        seen: usize,
        /// Images in all.
        images: usize,
        /// The least that makes a surface.
        needed: usize,
        /// Why most of the others were refused.
        reason: String,
    },
    /// The images are all in one place, so they make no length of vessel.
    #[error("the images with a lumen span {span_mm:.2} mm of vessel, at least {needed_mm:.1} mm are needed")]
    NoLength {
        /// Length between the first and the last.
        span_mm: f64,
        /// The least.
        needed_mm: f64,
    },
    /// The equations of a smooth fit have no solution.
    #[error("the {what} has no smooth fit: the images lie too far apart or on one another")]
    NoFit {
        /// What was being fitted.
        what: &'static str,
    },
}
