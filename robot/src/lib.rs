//! Arms: their model, the traits that hardware and simulation share, the one loop that moves them, the limits with
//! the last word, the guard, and the motions.
//!
//! It never hears of images or of files of scans.

mod arm;
mod joints;
mod model;
pub mod motion;

pub use arm::{Arm, ArmFault, Command, Controller, State};
pub use joints::{Joints, MAX_JOINTS, WrongJoints};
pub use model::{
    InverseOptions, Jacobian, JointLimit, Mesh, Model, ModelError, ModelWarning, NoInverse, PANDA_URDF,
    UR5E_URDF, Value, Vector6, manipulability,
};
