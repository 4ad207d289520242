//! Dots: the echoes of wires in a B-scan, found without knowing the phantom.
//!
//! ```
//! use probepath_us_capture::dots::{DotFinder, DotSettings, Mask};
//!
//! let mut image = vec![0_u8; 120 * 90];
//! for (dx, dy) in (-3_i32..=3).flat_map(|dx| (-2_i32..=2).map(move |dy| (dx, dy))) {
//!     image[((40 + dy) * 120 + 60 + dx) as usize] = (250 - 20 * (dx * dx + 2 * dy * dy).min(12)) as u8;
//! }
//! let mut finder = DotFinder::new(DotSettings::default(), &Mask::whole(), 120, 90).unwrap();
//! let dots = finder.find(&image).unwrap();
//! assert!((dots[0].at_px[0] - 60.0).abs() < 0.1 && (dots[0].at_px[1] - 40.0).abs() < 0.1);
//! ```
//!
//! The nouns: a [`DotFinder`] looks at images of one size through a [`Mask`], with [`DotSettings`], and gives [`Dot`]s.
//!
//! How it looks. A floor is laid under the image, block by block, from the grey levels that are common there. Pixels
//! above it are taken from the brightest down and joined to their neighbours (the tree of all thresholds at once), so
//! that each summit knows the level at which it drowns in a higher one, or grows longer than any dot: a summit that
//! stands far above that level is a dot, whatever its size; one on a bar, on text or in speckle is not.
//!
//! What it does not do: say which wire made a dot, or whether a wire made it at all. That is [`crate::label`]'s.

mod clutter;
mod error;
mod finder;
mod floor;
mod mask;
mod region;
mod settings;
mod shrink;
mod summits;
#[cfg(test)]
mod tests;

use nalgebra::Matrix2;

pub use error::BadDots;
pub use finder::DotFinder;
pub use mask::Mask;
pub use settings::DotSettings;

/// The echo of a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Its centre (column, row), in pixels of the MF image; (0, 0) is the centre of the first.
    pub at_px: [f64; 2],
    /// How uncertain the centre is (px²).
    pub covariance_px2: Matrix2<f64>,
    /// Its shape: second moments of its brightness (px²).
    pub spread_px2: Matrix2<f64>,
    /// How bright its brightest pixel is (0 to 255).
    pub peak: f64,
    /// Sum of its brightness over what lies around it.
    pub mass: f64,
    /// Cut by the edge of the image, the region of interest or the fan: its centre is not to be trusted.
    pub cut: bool,
}
