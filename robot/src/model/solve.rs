//! The small linear systems of inverse kinematics, on the stack.

use nalgebra::{Cholesky, Isometry3, Matrix3, Rotation3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::{Jacobian, Reach, Vector6};
use crate::{Joints, MAX_JOINTS};

/// What is missing from a tool's place to the goal, as the small motion in `Base`'s axes that would make it up:
/// linear (m), then a rotation vector (rad).
pub(crate) fn missing(reach: &Reach, goal: &Isometry3<f64>, goal_rotation: &Matrix3<f64>) -> Vector6 {
    let linear = goal.translation.vector - reach.position;
    let angular = rotation_vector(&(goal_rotation * reach.rotation.transpose()));
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// The small motion in `Base`'s axes from one pose to another, as [`missing`].
pub(crate) fn between(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6 {
    let linear = to.translation.vector - from.translation.vector;
    let turned = (to.rotation * from.rotation.inverse()).to_rotation_matrix();
    let angular = rotation_vector(turned.matrix());
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// Rotation vector of a rotation matrix, to rounding for small angles.
fn rotation_vector(r: &Matrix3<f64>) -> Vector3<f64> {
    let sine = Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12) * 0.5;
    let cosine = (r.trace() - 1.0) * 0.5;
    if cosine < 0.0 {
        // Beyond a right angle the sine fades out; the quaternion does not.
        return UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*r)).scaled_axis();
    }
    let length = sine.norm();
    if length < 1e-9 { sine } else { sine * (length.atan2(cosine) / length) }
}

/// The smallest joint step that makes the tool move by `motion`, in the damped least squares sense
/// ([`Wampler 1986`], `Jᵀ (J Jᵀ + damping)⁻¹`); `None` when the system cannot be solved.
///
/// [`Wampler 1986`]: https://doi.org/10.1109/TSMC.1986.289285
pub(crate) fn least_step(jacobian: &Jacobian, motion: &Vector6, damping: f64) -> Option<Joints> {
    let j = &jacobian.matrix;
    let step: SVector<f64, MAX_JOINTS> = if jacobian.len >= 6 {
        let normal = j * j.transpose() + SMatrix::<f64, 6, 6>::identity() * damping;
        j.transpose() * Cholesky::new(normal)?.solve(motion)
    } else {
        // With fewer joints than motions J Jᵀ is singular; Jᵀ J, padded with ones for the joints that are not, is not.
        let mut normal = j.transpose() * j + SMatrix::<f64, MAX_JOINTS, MAX_JOINTS>::identity() * damping;
        for spare in jacobian.len..MAX_JOINTS {
            normal[(spare, spare)] = 1.0;
        }
        Cholesky::new(normal)?.solve(&(j.transpose() * motion))
    };
    let step = Joints::from_slice(step.as_slice().get(..jacobian.len)?).ok()?;
    step.is_finite().then_some(step)
}
