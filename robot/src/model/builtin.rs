//! The two arms that ship with the project.

use super::Model;

/// The URDF behind [`Model::ur5e`]; its header gives the published source of every number.
pub const UR5E_URDF: &str = include_str!("../../models/ur5e.urdf");

/// The URDF behind [`Model::seven_joint`]; its header gives the published source of every number.
pub const PANDA_URDF: &str = include_str!("../../models/panda.urdf");

impl Model {
    /// The UR5e (6 joints), `base_link` to `tool0`. `base_link` is turned 180 degrees about z against the
    /// controller's own base (FIELD.md section 7).
    pub fn ur5e() -> Self {
        built_in(UR5E_URDF, "models/ur5e.urdf", "base_link", "tool0")
    }

    /// A 7-joint arm, `panda_link0` to `panda_link8`: the kinematics of the Franka Emika Panda from its published DH
    /// parameters and limits.
    pub fn seven_joint() -> Self {
        built_in(PANDA_URDF, "models/panda.urdf", "panda_link0", "panda_link8")
    }
}

#[allow(clippy::expect_used, reason = "the text is part of the binary, not input; a test reads both arms")]
fn built_in(text: &str, source: &str, base_link: &str, tip_link: &str) -> Model {
    Model::from_urdf(text, source, base_link, tip_link).expect("a built-in URDF is good").0
}
