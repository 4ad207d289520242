//! From B-scans that know where they were: the lumen of an artery, its surface, its measures; and volumes.
//!
//! ```no_run
//! use probepath_recon::{Fit, LumenSettings, Mesh, compare, reconstruct_lumen};
//! use probepath_us_capture::PlacedBScan;
//!
//! fn measure(sweep: &[PlacedBScan]) -> Result<(), Box<dyn std::error::Error>> {
//!     let found = reconstruct_lumen(sweep, &LumenSettings::default())?;
//!     for stenosis in &found.stenoses {
//!         println!("{:.0} % of the area at {:.0} mm", stenosis.percent_area, stenosis.at_mm);
//!     }
//!     let mesh = found.surface.mesh();
//!     mesh.write("lumen.stl".as_ref())?;
//!     let beside = compare(&mesh, &Mesh::read("gold.stl".as_ref())?, Fit::Rigid)?;
//!     println!("{:.2} mm from the gold standard", beside.error.mean_mm);
//!     Ok(())
//! }
//! ```
//!
//! The nouns: a [`Contour`] is the lumen's border in one image, or [`NoLumen`] says why there is none; a
//! [`LumenSurface`] is what all of them make; a [`Section`] is normal to its [`Centreline`]; a [`Stenosis`] is measured
//! against a named [`Reference`].
//!
//! What it does not do: hear of robots, or invent a lumen where none is seen.

mod centreline;
mod compare;
mod error;
pub mod fast_marching;
mod follow_up;
mod live;
mod lumen;
pub mod measures;
mod mesh;
mod patch;
mod reconstruct;
mod section;
mod settings;
mod spline;
mod stenosis;
mod surface;
mod uncertainty;
mod vessel;
pub mod volume;

#[cfg(test)]
mod phantom_contours;
#[cfg(test)]
mod phantom_images;
#[cfg(test)]
mod phantom_scans;

pub use centreline::{Centreline, CentrelinePoint};
pub use compare::{
    AreaPair, Closest, CompareError, CompareWarning, Comparison, DistanceStatistics, Fit, Nearest, Unrolled,
    compare, unrolled,
};
pub use error::ReconError;
pub use follow_up::{
    AreaChange, ChangedStretch, FALSE_ALARM, FollowUp, FollowUpError, StenosisChange, follow_up,
};
pub use live::{AreaSoFar, LiveLumen, VesselSoFar, View};
pub use lumen::{Contour, ImageLumen, LumenFinder, NoLumen, Tracker, segment};
pub use mesh::{Mesh, MeshError, PointScalars};
pub use probepath_us_capture::point_spread::PointSpread;
pub use reconstruct::{
    ImageCounts, LumenReconstruction, ReconWarning, check_sweep, reconstruct_from, reconstruct_lumen,
};
pub use section::{NotMeasured, Section, SectionMeasure};
pub use settings::{LumenSettings, SeedPoint};
pub use stenosis::{Reference, ReferenceChoice, ReferenceSide, Stenosis};
pub use surface::LumenSurface;
pub use uncertainty::{ErrorBudget, Tracking};
pub use vessel::{Leaves, Vessel};
