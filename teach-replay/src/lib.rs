//! Teaching a path by hand, cleaning it, planning it and replaying it at constant force.
//!
//! ```
//! use probepath_frames::{Pose, Span, nalgebra::Isometry3};
//! use probepath_robot::{Joints, Model, MotionLimits, Operator};
//! use probepath_teach_replay::{Path, Plan, PlanSettings, ProbeArm, Replay, ReplaySettings};
//!
//! # fn replay(path: &Path) -> Result<Replay, Box<dyn std::error::Error>> {
//! let model = Model::ur5e();
//! let limits = MotionLimits::of_model(&model, Joints::splat(6, 10.0), Joints::splat(6, 200.0))?;
//! // FRAMES: the holder's drawing: the probe's face 150 mm in front of the flange.
//! let flange_from_probe = Pose::assume(Isometry3::translation(0.0, 0.0, 0.15));
//! let arm = ProbeArm { model, flange_from_probe, limits, period: Span::from_milliseconds(2) };
//!
//! let start = Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0])?;
//! let plan = Plan::new(path, &arm, &start, &PlanSettings::default())?; // refused with the place and the reason
//! let replay = Replay::new(plan, ReplaySettings::default(), Operator::new())?; // 5 N; for `probepath_robot::run`
//! # Ok(replay)
//! # }
//! ```
//!
//! - [`HandGuide`] is the controller that gives way to the hand, while a [`Recorder`] keeps every state; [`Freedrive`]
//!   leaves that to the arm's own means.
//! - [`Path`] is what was taught, cleaned of approach, lifts, pauses, doubling back and tremor: poses at uniform spacing.
//! - [`Plan`] is the whole replay tried out before anything moves: reach, limits, singularities, workspace, speed.
//! - [`Replay`] is the controller that follows a plan at constant force; [`LiftOff`] takes the probe off after a stop.
//! - [`Round`] is the controller that goes from stop to stop in free air or water and rests at each.
//!
//! It knows nothing of ultrasound, and does not find its way on skin that moved since it was taught further than the
//! plan's offset along the probe's axis.

mod error;
mod freedrive;
mod hand_guide;
mod lift_off;
mod path;
mod plan;
mod probe_arm;
mod recorder;
mod recording;
mod replay;
mod round;

pub use error::PathError;
pub use freedrive::Freedrive;
pub use hand_guide::{GiveWay, GuideError, HandGuide};
pub use lift_off::LiftOff;
pub use path::{
    Bridge, Cleaning, CleaningReport, ContactSign, Label, Listed, Path, PathPoint, Side, TaughtForce, Tube,
};
pub use plan::{Place, Plan, PlanError, PlanReport, PlanSettings, Refusal};
pub use probe_arm::ProbeArm;
pub use recorder::Recorder;
pub use recording::{Recording, Sample};
pub use replay::{Replay, ReplayEnding, ReplayError, ReplayPhase, ReplaySettings, ReplayStatus, ReplayWatch};
pub use round::{Round, RoundPhase, RoundStatus, RoundWatch, Stop};
