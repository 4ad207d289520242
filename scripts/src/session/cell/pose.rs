//! A pose as people measure it: millimetres and degrees, with the names of both systems.

use nalgebra::{UnitQuaternion, Vector3};
use probepath_frames::{Frame, NamedPose, Pose};
use serde::{Deserialize, Serialize};

use super::line::{Wrong, within};

/// No part of a cell is further away (mm).
const FURTHEST_MM: f64 = 10_000.0;

/// `of`, defined in `written_in`, in millimetres and degrees.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseFile {
    /// Name of the system that it is written in (`A` in `A_T_B`).
    pub written_in: String,
    /// Name of the system whose pose it is (`B` in `A_T_B`).
    pub of: String,
    /// Origin of `of` (mm).
    pub translation_mm: [f64; 3],
    /// Rotation vector: its direction is the axis, its length the angle (degrees).
    pub rotation_deg: [f64; 3],
}

impl PoseFile {
    /// A pose as it is written in a file.
    pub fn of<A: Frame, B: Frame>(pose: &Pose<A, B>) -> Self {
        let isometry = pose.isometry();
        Self {
            written_in: A::NAME.into(),
            of: B::NAME.into(),
            translation_mm: (isometry.translation.vector * 1e3).into(),
            rotation_deg: isometry.rotation.scaled_axis().map(f64::to_degrees).into(),
        }
    }

    /// The pose, when its names are those of `A` and `B` and its numbers can be.
    pub(super) fn pose<A: Frame, B: Frame>(&self, field: &str) -> Result<Pose<A, B>, Wrong> {
        for mm in self.translation_mm {
            within(&format!("{field}.translation_mm"), mm, (-FURTHEST_MM, FURTHEST_MM), "mm")?;
        }
        for deg in self.rotation_deg {
            within(&format!("{field}.rotation_deg"), deg, (-360.0, 360.0), "degrees")?;
        }
        let turn = Vector3::from(self.rotation_deg).map(f64::to_radians);
        let q = UnitQuaternion::from_scaled_axis(turn).coords;
        let named = NamedPose {
            written_in: self.written_in.clone(),
            of: self.of.clone(),
            translation_m: self.translation_mm.map(|mm| mm / 1e3),
            rotation_xyzw: [q.x, q.y, q.z, q.w],
        };
        named.check().map_err(|error| Wrong::new(field, format!("is no pose: {error}")))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3};
    use probepath_frames::{Base, Flange, Probe, World};

    use super::*;

    #[test]
    fn there_and_back_is_the_same_pose() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(1.2, -0.7, 2.1));
        let isometry = Isometry3::from_parts(Translation3::new(0.6, -0.01, -0.11), turn);
        // FRAMES: a made-up place of the base.
        let pose = Pose::<World, Base>::assume(isometry);
        let back = PoseFile::of(&pose).pose::<World, Base>("arm.world_from_base").unwrap();
        assert!(back.origin().distance(&pose.origin()) < 1e-12);
        assert!(back.isometry().rotation.angle_to(&turn) < 1e-7);
    }

    #[test]
    fn a_pose_of_other_systems_and_one_in_metres_of_another_world_are_refused() {
        // FRAMES: a made-up holder.
        let pose = PoseFile::of(&Pose::<Flange, Probe>::assume(Isometry3::translation(0.0, 0.0, 0.1)));
        let wrong = pose.pose::<World, Base>("arm.world_from_base").unwrap_err().told("");
        assert!(wrong.contains("arm.world_from_base") && wrong.contains("Flange_T_Probe"), "{wrong}");
        let far = PoseFile { translation_mm: [0.0, 1e5, 0.0], ..pose };
        let wrong = far.pose::<Flange, Probe>("arm.flange_from_probe").unwrap_err().told("");
        assert!(wrong.contains("translation_mm is 100000"), "{wrong}");
    }
}
