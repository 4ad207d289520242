//! Work without an arm: reconstruct an exam or a sequence once more, compare surfaces, convert files, ask a model, serve
//! a simulated cell.
//!
//! Each answer says itself twice: as text for people (`Display`) and as data for programs (`Serialize`).

mod arm;
pub mod calibrate;
mod compare;
mod convert;
mod follow_up;
mod reconstruct;
mod simulate;

use std::fmt::Display;
use std::path::Path;

pub use probepath_recon::volume::{Compounding, Weights};

pub use arm::{ArmAnswer, ArmError, ArmQuestion, arm};
pub use compare::{CompareError, CompareWish, Comparison, Fit, compare};
pub use convert::{ConvertError, Converted, convert};
pub use follow_up::{FollowedUp, FollowedUpError, followed_up};
pub use reconstruct::{
    FinderFault, FinderWish, ImagesOf, ReconstructError, ReconstructWish, Reconstructed, Timing, VolumeMade,
    VolumeOptions, reconstruct,
};
pub use simulate::{Served, ServedArm, ServedPort, SimulateError, SimulateRequest, Simulating, simulate};

/// What is wrong, after the file it is wrong in; most errors that open a file say its name themselves.
fn in_file(path: &Path, why: &impl Display) -> String {
    let (path, why) = (path.display().to_string(), why.to_string());
    if why.contains(&path) { why } else { format!("{path}: {why}") }
}
