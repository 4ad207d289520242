//! A world to scan, from one seed, in simulated time: legs and phantoms whose lumen is known exactly, and the
//! B-scans that an ultrasound machine would make of them.
//!
//! ```
//! use probepath_sim::{Leg, LegConfig};
//!
//! let leg = Leg::new(&LegConfig::default(), 1);
//! let stenosis = leg.main().stenoses()[0];
//! let (skin, outward) = leg.skin_over(stenosis.at_m);
//! assert!(leg.surface(skin.moved(outward, 0.01)).0 > 0.0099);
//! assert_eq!(leg.segment(leg.main().centre(stenosis.at_m)).map(|name| name.code()), Some("SFA proximal"));
//! ```
//!
//! The nouns: a [`Vessel`] is a tube with an exact lumen; a [`Leg`] or a [`VascularPhantom`] is skin and vessels;
//! [`Tissue`] is what the beam meets.
//!
//! What it does not do: know any algorithm under test. It leans on none, and its truth goes to tests and reports only.

mod leg;
mod phantom;
mod spline;
mod tissue;
mod vessel;

pub use leg::{Leg, LegConfig, Side};
pub use phantom::{PhantomConfig, VascularPhantom};
pub use tissue::{Homogeneous, Reflector, Tissue};
pub use vessel::{Calibre, Segment, SegmentName, Stenosis, SurfaceGrid, Vessel};
