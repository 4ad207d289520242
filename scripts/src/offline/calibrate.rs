//! `probepath calibrate`: where the image is on the probe, when it was formed, and how sure that is.
//!
//! Nothing is decided here: the method is `us-capture`'s, the words and pictures are ours.

mod alone;
mod check;
mod document;
mod error;
mod error_map;
mod nominal;
mod options;
mod overlay;
mod pictures;
mod poses;
mod request;
mod spatial;
mod store;
mod subject;
mod temporal;
mod text;
mod wishes;

pub use check::{Checked, check};
pub use document::{Covariance, Depth, ImageDots, OverImage, PlusMatrices, RefusedImage, Section, Spatial};
pub use error::CalibrateError;
pub use request::{CheckRequest, SpatialRequest, SubjectRequest, TemporalRequest};
pub use spatial::spatial;
pub use temporal::{Temporal, temporal};
pub use wishes::{Fan, PhantomToReference, PixelMm, Place, Region, Scale, Stored};
