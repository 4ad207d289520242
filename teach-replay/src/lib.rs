//! Teaching a path by hand, cleaning it, planning it and replaying it at constant force.

mod error;
mod hand_guide;
mod lift_off;
mod path;
mod plan;
mod probe_arm;
mod recorder;
mod recording;
mod replay;

pub use error::PathError;
pub use hand_guide::{GiveWay, GuideError, HandGuide};
pub use lift_off::LiftOff;
pub use path::{
    Bridge, Cleaning, CleaningReport, ContactSign, Label, Listed, Path, PathPoint, Side, TaughtForce,
};
pub use plan::{Place, Plan, PlanError, PlanReport, PlanSettings, Refusal};
pub use probe_arm::ProbeArm;
pub use recorder::Recorder;
pub use recording::{Recording, Sample};
pub use replay::{Replay, ReplayEnding, ReplayError, ReplayPhase, ReplaySettings, ReplayStatus, ReplayWatch};
