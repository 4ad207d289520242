//! Arms: their model, the traits that hardware and simulation share, the one loop that moves them, the limits with
//! the last word, the guard, and the motions.
//!
//! It never hears of images or of files of scans.

mod arm;
mod black_box;
mod contact;
mod guard;
mod joints;
mod limits;
mod model;
pub mod motion;
mod observer;
mod operator;
mod recorded;
mod run;

pub use arm::{Arm, ArmFault, Command, Controller, State};
pub use black_box::BlackBox;
pub use contact::{ContactError, ContactLaw, ContactSettings, TouchDown, TouchDownPhase, TouchDownSettings};
pub use guard::{
    Ceiling, Guard, GuardLimits, Phase, Plane, ProbePlace, Trip, Verdict, Watch, Workspace, probe_place,
};
pub use joints::{Joints, MAX_JOINTS, WrongJoints};
pub use limits::{Limited, Limiter, LimitsError, MotionLimits};
pub use model::{
    InverseOptions, Jacobian, JointLimit, Mesh, Model, ModelError, ModelWarning, NoInverse, PANDA_URDF,
    UR5E_URDF, Value, Vector6, manipulability,
};
pub use motion::{Brake, Hold, NoMove, PointToPoint};
pub use observer::{Observer, Tick, Wish};
pub use operator::{Asked, Operator};
pub use recorded::{RecordedArm, Row};
pub use run::{Ending, Finished, RunError, StopReason, run};
