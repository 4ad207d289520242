//! Poses in files, scripts and on the wire: both names travel along and are checked on reading.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{Frame, FrameError, Pose};

/// How far from one a quaternion's length may be in a file that people write by hand.
const UNIT_WITHIN: f64 = 1e-3;

/// A pose as it travels: `of`, defined in `written_in`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedPose {
    /// Name of the system it is written in (left of the arrow, `A` in `A_T_B`).
    pub written_in: String,
    /// Name of the system whose pose it is (`B` in `A_T_B`).
    pub of: String,
    /// Origin of `of`, in metres.
    pub translation_m: [f64; 3],
    /// Orientation as a unit quaternion x, y, z, w.
    pub rotation_xyzw: [f64; 4],
}

impl<A: Frame, B: Frame> From<&Pose<A, B>> for NamedPose {
    fn from(pose: &Pose<A, B>) -> Self {
        let isometry = pose.isometry();
        let q = isometry.rotation.coords;
        Self {
            written_in: A::NAME.into(),
            of: B::NAME.into(),
            translation_m: isometry.translation.vector.into(),
            rotation_xyzw: [q.x, q.y, q.z, q.w],
        }
    }
}

impl NamedPose {
    /// The pose, when its names are those of `A` and `B`.
    ///
    /// # Errors
    /// When a name differs, a number is not finite, or the quaternion is not of unit length.
    pub fn check<A: Frame, B: Frame>(&self) -> Result<Pose<A, B>, FrameError> {
        if self.written_in != A::NAME || self.of != B::NAME {
            return Err(FrameError::WrongSystems {
                expected: crate::pose::pair::<A, B>(),
                found: format!("{}_T_{}", self.written_in, self.of),
            });
        }
        let what = || crate::pose::pair::<A, B>();
        if self.translation_m.iter().chain(&self.rotation_xyzw).any(|x| !x.is_finite()) {
            return Err(FrameError::NotFinite { what: what() });
        }
        let [x, y, z, w] = self.rotation_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let length = quaternion.norm();
        if (length - 1.0).abs() > UNIT_WITHIN {
            return Err(FrameError::NotUnit { what: what(), length });
        }
        // Already unit to rounding: kept to the bit, so that what was written is what is read.
        let rotation = if (length - 1.0).abs() < 1e-14 {
            UnitQuaternion::new_unchecked(quaternion)
        } else {
            UnitQuaternion::from_quaternion(quaternion)
        };
        // FRAMES: both names were just compared with those of A and B.
        Ok(Pose::assume(Isometry3::from_parts(
            Translation3::from(Vector3::from(self.translation_m)),
            rotation,
        )))
    }
}
