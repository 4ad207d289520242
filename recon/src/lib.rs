//! From B-scans that know where they were: the lumen of an artery, its surface, its measures.
//!
//! It never hears of robots.

mod error;
pub mod fast_marching;
mod lumen;
mod patch;
mod settings;

#[cfg(test)]
mod phantom_images;

pub use error::ReconError;
pub use lumen::{Contour, ImageLumen, NoLumen, segment};
pub use settings::{LumenSettings, PointSpread, SeedPoint};
