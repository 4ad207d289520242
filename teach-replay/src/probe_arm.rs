//! [`ProbeArm`]: an arm that holds a probe, as planning and moving see it.

use nalgebra::Isometry3;
use probepath_frames::{Base, Flange, Pose, Probe, Span};
use probepath_robot::{Joints, Model, MotionLimits};

/// An arm that holds a probe.
#[derive(Clone, Debug)]
pub struct ProbeArm {
    /// Its kinematics.
    pub model: Model,
    /// Where the probe is screwed on.
    pub flange_from_probe: Pose<Flange, Probe>,
    /// What its joints may do.
    pub limits: MotionLimits,
    /// The time between two ticks.
    pub period: Span,
}

impl ProbeArm {
    /// Where the probe is.
    pub fn probe(&self, joints: &Joints) -> Pose<Base, Probe> {
        self.model.forward(joints) * self.flange_from_probe
    }

    /// The joints near `near` that put the probe there, one tick or a few millimetres away.
    pub fn joints(&self, base_from_probe: &Pose<Base, Probe>, near: &Joints) -> Option<Joints> {
        self.model.refine(base_from_probe, &self.flange_from_probe, near)
    }

    /// How far from a singularity: the smallest singular value of the probe's Jacobian (m, rad).
    pub fn distance_to_singularity(&self, joints: &Joints) -> f64 {
        self.model.jacobian(joints, &self.flange_from_probe).smallest_singular_value()
    }
}

/// The pose `metres` further along its own z axis: into the tissue.
pub(crate) fn along_z(pose: &Pose<Base, Probe>, metres: f64) -> Pose<Base, Probe> {
    // FRAMES: the probe, moved along its own z axis, is the probe where it would be then.
    *pose * Pose::<Probe, Probe>::assume(Isometry3::translation(0.0, 0.0, metres))
}
