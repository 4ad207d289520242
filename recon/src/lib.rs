//! From B-scans that know where they were: the lumen of an artery, its surface, its measures.
//!
//! It never hears of robots.

mod centreline;
mod compare;
mod error;
pub mod fast_marching;
mod lumen;
mod mesh;
mod patch;
mod reconstruct;
mod section;
mod settings;
mod spline;
mod stenosis;
mod surface;
pub mod volume;

#[cfg(test)]
mod phantom_images;

pub use centreline::{Centreline, CentrelinePoint};
pub use compare::{AreaPair, Closest, CompareError, Comparison, DistanceStatistics, Fit, Nearest, compare};
pub use error::ReconError;
pub use lumen::{Contour, ImageLumen, NoLumen, segment};
pub use mesh::{Mesh, MeshError};
pub use reconstruct::{ImageCounts, LumenReconstruction, ReconWarning, reconstruct_lumen};
pub use section::{Section, SectionMeasure};
pub use settings::{LumenSettings, PointSpread, SeedPoint};
pub use stenosis::{Reference, ReferenceSide, Stenosis};
pub use surface::LumenSurface;
