//! [`BadDots`]: what stops a search for dots before it begins.

use thiserror::Error;

/// A search for dots that makes no sense.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BadDots {
    /// No pixels, or more than can be counted.
    #[error("an image of {width} x {height} pixels cannot be searched for dots: give 8 to 32768 of each")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The pixels given are not those of the size that was said.
    #[error(
        "{given} pixels were given for an image of {width} x {height}: make a DotFinder for each size of image"
    )]
    Pixels {
        /// How many were given.
        given: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A region of interest with no place in it.
    #[error(
        "a rectangle of {width} x {height} pixels at ({column}, {row}) is none: give finite numbers and a size above zero"
    )]
    Rectangle {
        /// Its first column.
        column: f64,
        /// Its first row.
        row: f64,
        /// Its columns.
        width: f64,
        /// Its rows.
        height: f64,
    },
    /// A fan with no place in it.
    #[error(
        "a fan from {near_px} to {far_px} pixels and {from_deg} to {to_deg} degrees is none: \
         give finite numbers in growing order, angles within -180 to 180"
    )]
    Fan {
        /// Inner radius (px).
        near_px: f64,
        /// Outer radius (px).
        far_px: f64,
        /// First angle (degrees).
        from_deg: f64,
        /// Last angle (degrees).
        to_deg: f64,
    },
    /// The mask leaves nothing of the image.
    #[error(
        "the mask leaves no pixel of a {width} x {height} image: its place is given in pixels of the MF image"
    )]
    Masked {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A setting outside its range.
    #[error("the setting {name} = {value} is out of range: {range}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
}
