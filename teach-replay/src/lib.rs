//! Teaching a path by hand, cleaning it, planning it and replaying it at constant force.

mod error;
mod path;
mod recording;

pub use error::PathError;
pub use path::{Bridge, Cleaning, CleaningReport, ContactSign, Label, Path, PathPoint, Side, TaughtForce};
pub use recording::{Recording, Sample};
