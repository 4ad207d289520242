//! Arms: their model, the traits that hardware and simulation share, the one loop that moves them, the limits with
//! the last word, the guard, and the motions.
//!
//! ```
//! use probepath_frames::Span;
//! use probepath_robot::{Arm, Ending, Guard, GuardLimits, Joints, Model, MotionLimits, PointToPoint, run};
//!
//! # struct Echo(probepath_robot::State);
//! # impl Arm for Echo {
//! #     fn exchange(&mut self, command: &probepath_robot::Command)
//! #         -> Result<probepath_robot::State, probepath_robot::ArmFault> {
//! #         if let probepath_robot::Command::Position(q) = command {
//! #             (self.0.position, self.0.commanded) = (*q, *q);
//! #         }
//! #         self.0.tick += 1;
//! #         self.0.stamp = self.0.stamp + self.period();
//! #         Ok(self.0)
//! #     }
//! #     fn period(&self) -> Span { Span::from_milliseconds(2) }
//! #     fn joints(&self) -> usize { 6 }
//! # }
//! fn go_to(arm: &mut dyn Arm, from: &Joints, to: &Joints) -> Result<Ending, Box<dyn std::error::Error>> {
//!     let limits = MotionLimits::of_model(&Model::ur5e(), Joints::splat(6, 5.0), Joints::splat(6, 100.0))?;
//!     let mut there = PointToPoint::plan(from, to, &limits, arm.period())?;
//!     let mut guard = Guard::new(GuardLimits::default(), limits)?;
//!     Ok(run(arm, &mut there, &mut guard, &mut ())?.ending)
//! }
//! # let start = Joints::zeros(6);
//! # let mut arm = Echo(probepath_robot::State {
//! #     tick: 0, stamp: probepath_frames::Stamp::ZERO, position: start, velocity: start, commanded: start,
//! #     wrench: probepath_frames::Wrench::zero(), guiding: false, safety: Default::default(), age: Span::ZERO,
//! # });
//! # let to = Joints::splat(6, 0.5);
//! # assert_eq!(go_to(&mut arm, &start, &to).unwrap(), Ending::Done);
//! # assert_eq!(arm.0.commanded, to);
//! ```
//!
//! The nouns: an [`Arm`] exchanges a [`Command`] for the next [`State`], once a tick; a [`Controller`] decides the next
//! command; the [`Guard`] holds the limits that have the last word, and stops the arm; [`run`] is the one loop that
//! joins them, and leaves the arm at rest by whatever door it is left. A [`Model`] says where the probe is.
//!
//! It never hears of images or of files of scans.

mod arm;
mod black_box;
mod contact;
pub mod drivers;
mod guard;
mod joints;
mod limits;
mod model;
pub mod motion;
mod observer;
mod operator;
pub mod qp;
pub mod realtime;
mod recorded;
mod run;
pub mod step;
mod tool;

pub use arm::{Arm, ArmFault, Command, Controller, Safety, State};
pub use black_box::BlackBox;
pub use contact::pressure::{ContactWatch, Face, Pressure};
pub use contact::{ContactError, ContactLaw, ContactSettings, Patience, SkinEstimate};
pub use guard::{
    Allowance, Guard, GuardLimits, Phase, Plane, ProbePlace, Tilt, Trip, Verdict, Watch, Workspace,
    probe_place,
};
pub use joints::{Joints, MAX_JOINTS, WrongJoints};
pub use limits::{JointBound, Limited, Limiter, LimitsError, MotionLimits, Room};
pub use model::{
    InverseOptions, Jacobian, JointLimit, Mesh, Model, ModelError, ModelWarning, NoInverse, PANDA_URDF,
    UR5E_URDF, Value, Vector6, manipulability,
};
pub use motion::{Brake, Hold, NoMove, PointToPoint};
pub use observer::{Observer, Tick, Wish};
pub use operator::{Asked, Operator};
pub use recorded::{RecordedArm, Row};
pub use run::{Ending, Finished, RunError, StopReason, run};
pub use tool::{Air, Tool, ToolError, ToolFit, ToolReading, ZeroSettings, ZeroWatch, identify};
