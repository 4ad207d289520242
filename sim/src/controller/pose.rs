//! Poses as the controller writes them: six numbers, place (m) and rotation vector (rad), in its own base.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};

/// The controller's `base` against the URDF's `base_link`: turned by 180 degrees about z (FIELD.md section 7).
pub(super) fn turned() -> Isometry3<f64> {
    let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    Isometry3::from_parts(Translation3::identity(), half)
}

/// A pose in the URDF's base as the controller writes it.
pub(super) fn written(base_from_tool: &Isometry3<f64>) -> [f64; 6] {
    numbers(&(turned() * base_from_tool))
}

/// The pose in the URDF's base that the controller wrote.
pub(super) fn read(pose: &[f64; 6]) -> Isometry3<f64> {
    turned() * isometry(pose)
}

/// Six numbers of an isometry, in whatever frame.
pub(super) fn numbers(isometry: &Isometry3<f64>) -> [f64; 6] {
    let (place, turn) = (isometry.translation.vector, isometry.rotation.scaled_axis());
    [place.x, place.y, place.z, turn.x, turn.y, turn.z]
}

/// The isometry of six numbers, in whatever frame.
pub(super) fn isometry(pose: &[f64; 6]) -> Isometry3<f64> {
    let [x, y, z, rx, ry, rz] = *pose;
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz)),
    )
}

/// Two vectors from one frame's axes into another's (`turn` takes column vectors there).
pub(super) fn rotated(turn: &UnitQuaternion<f64>, six: &Vector6<f64>) -> Vector6<f64> {
    let (a, b) = (turn * six.fixed_rows::<3>(0), turn * six.fixed_rows::<3>(3));
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Two vectors in the URDF's base axes as the controller writes them, and back: the turn is its own inverse.
pub(super) fn turned_axes(six: &Vector6<f64>) -> Vector6<f64> {
    Vector6::new(-six[0], -six[1], six[2], -six[3], -six[4], six[5])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trap_of_the_two_bases_is_the_published_one() {
        // FIELD.md section 7: tool0 at (+0.492, +0.133, 0.488) in the URDF is (-0.492, -0.133, 0.488) on the wire.
        let urdf = Isometry3::from_parts(Translation3::new(0.492, 0.133, 0.488), UnitQuaternion::identity());
        let wire = written(&urdf);
        assert!((wire[0] + 0.492).abs() < 1e-12 && (wire[1] + 0.133).abs() < 1e-12);
        let back = read(&wire);
        assert!((back.translation.vector - urdf.translation.vector).norm() < 1e-12);
        assert!(back.rotation.angle_to(&urdf.rotation) < 1e-12);
        let six = Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
        assert!((turned_axes(&six) - rotated(&turned().rotation, &six)).norm() < 1e-12);
    }
}
