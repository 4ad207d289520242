//! Where the controller's numbers are written, and what their signs are.
//!
//! | number | the controller's | ours |
//! |---|---|---|
//! | `actual_TCP_pose` | in its `base`, turned by 180 degrees about z against the URDF's `base_link` | [`Base`] is `base_link`: x and y change their signs |
//! | the TCP | wherever `set_tcp` put it; our script puts it at the flange | [`Flange`]; the probe is ours to place |
//! | `actual_TCP_force` | what the outside does to the tool, along the axes of `base`, about the flange (e-series; an external sensor or CB3: about the TCP; at the flange both are one), without the payload's weight | what the outside does to the probe, in [`Probe`]'s axes about its origin: no sign changes, both axes and point do |
//! | a probe that presses down on skin | force z of `base` positive: the skin pushes up | force z of [`Probe`] negative: its z points into the skin |
//! | `actual_q` | rad, the same axes and zeros as the URDF | as it is |
//!
//! Sources: the URDF of the manufacturer (`base_link-base_fixed_joint` turns by pi about z); the manufacturer's ROS 2
//! driver, pull requests 1287 ("the force torque is returned at the tool flange on e-series robots and at the tcp for
//! CB3"), 1615 ("a wrench at flange oriented in the base frame") and issue 1849 (external sensors); the script manual
//! on `get_tcp_force`. `UR_WIRE.md` says "at TCP", which is right for CB3: with the TCP at the flange nothing hangs
//! on it.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Pose, Probe, Wrench};

/// The controller's base, as seen from the URDF's, and the other way round: half a turn about z is its own inverse.
pub fn half_turn() -> UnitQuaternion<f64> {
    // Exact, without the rounding of pi's sine.
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 1.0))
}

/// A pose as the controller writes it, x, y, z (m) and a rotation vector (rad), as a plain isometry in its own base.
pub fn isometry(pose: &[f64; 6]) -> Isometry3<f64> {
    let [x, y, z, rx, ry, rz] = *pose;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz));
    Isometry3::from_parts(Translation3::new(x, y, z), turn)
}

/// Where the flange is, from what the controller says of its TCP and the offset of that.
pub fn base_from_flange(tcp_pose: &[f64; 6], tcp_offset: &[f64; 6]) -> Pose<Base, Flange> {
    let flange = isometry(tcp_pose) * isometry(tcp_offset).inverse();
    // FRAMES: the controller's TCP pose without the TCP's offset is the flange in the controller's base; half a turn
    // about z brings that to the URDF's.
    Pose::assume(Isometry3::from_parts(Translation3::identity(), half_turn()) * flange)
}

/// What the outside does to the probe, from the controller's force (N, N m: axes of its base, about the flange).
pub fn wrench(
    force: &[f64; 6],
    base_from_flange: &Pose<Base, Flange>,
    flange_from_probe: &Pose<Flange, Probe>,
) -> Wrench<Probe> {
    let [fx, fy, fz, tx, ty, tz] = *force;
    let flange_axes = base_from_flange.isometry().rotation.inverse() * half_turn();
    let at_flange =
        Wrench::<Flange>::new(flange_axes * Vector3::new(fx, fy, fz), flange_axes * Vector3::new(tx, ty, tz));
    flange_from_probe.inverse() * at_flange
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{Joints, Model};

    /// FIELD.md section 7: tool0 at (+0.492, +0.133, 0.488) is (-0.492, -0.133, 0.488) in actual_TCP_pose for this q.
    #[test]
    fn the_controllers_base_is_turned_by_half_a_turn_against_the_urdfs() {
        let q = Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0]).unwrap();
        let ours = Model::ur5e().forward(&q);
        let place = ours.origin().vector();
        assert!((place - Vector3::new(0.492, 0.133, 0.488)).amax() < 1e-3, "{place}");
        let rotation = half_turn() * ours.isometry().rotation;
        let axis = rotation.scaled_axis();
        let tcp = [-place.x, -place.y, place.z, axis.x, axis.y, axis.z];
        assert!((Vector3::new(tcp[0], tcp[1], tcp[2]) - Vector3::new(-0.492, -0.133, 0.488)).amax() < 1e-3);
        let (metres, radians) = base_from_flange(&tcp, &[0.0; 6]).distance(&ours);
        assert!(metres < 1e-12 && radians < 1e-7, "{metres} m, {radians} rad");
        // Without the half turn it would be a metre away, and the arm would go to the wrong side of the table.
        let wrong = Pose::<Base, Flange>::assume(isometry(&tcp));
        assert!(wrong.distance(&ours).0 > 1.0 && wrong.distance(&ours).1 > 3.1);
    }

    #[test]
    fn a_tcps_offset_is_taken_off() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..1000 {
            let mut some = |most: f64| std::array::from_fn::<f64, 6, _>(|_| rng.random_range(-most..most));
            let (flange, offset) = (some(1.0), some(0.3));
            let tcp = isometry(&flange) * isometry(&offset);
            let (t, r) = (tcp.translation.vector, tcp.rotation.scaled_axis());
            let found = base_from_flange(&[t.x, t.y, t.z, r.x, r.y, r.z], &offset);
            let (metres, radians) = found.distance(&base_from_flange(&flange, &[0.0; 6]));
            assert!(metres < 1e-12 && radians < 1e-7, "{metres} {radians}");
        }
    }

    /// The probe hangs straight down from the flange and presses on a table: the table pushes it up.
    #[test]
    fn skin_that_presses_on_the_probe_is_negative_along_its_z() {
        // FRAMES: made up: a flange whose z points down, half a metre before the arm.
        let base_from_flange = Pose::<Base, Flange>::assume(Isometry3::new(
            Vector3::new(0.5, 0.1, 0.3),
            Vector3::new(PI, 0.0, 0.0),
        ));
        // FRAMES: made up: a probe 200 mm long, straight on the flange.
        let flange_from_probe = Pose::<Flange, Probe>::assume(Isometry3::translation(0.0, 0.0, 0.2));
        let felt = wrench(&[0.0, 0.0, 5.0, 0.0, 0.0, 0.0], &base_from_flange, &flange_from_probe);
        assert!((felt.force - Vector3::new(0.0, 0.0, -5.0)).amax() < 1e-12, "{felt:?}");
        assert!(felt.torque.amax() < 1e-12, "{felt:?}");
        // A push along the controller's +x is along the URDF's -x, which is the flange's -x here.
        let felt = wrench(&[2.0, 0.0, 0.0, 0.0, 0.0, 0.0], &base_from_flange, &flange_from_probe);
        assert!((felt.force - Vector3::new(-2.0, 0.0, 0.0)).amax() < 1e-12, "{felt:?}");
    }

    /// A force at the probe's tip has a torque at the flange and none at the tip.
    #[test]
    fn a_force_at_the_probes_tip_has_no_torque_there() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..1000 {
            let mut some = |most: f64| Vector3::from_fn(|_, _| rng.random_range(-most..most));
            // FRAMES: made up, anywhere.
            let base_from_flange = Pose::<Base, Flange>::assume(Isometry3::new(some(0.8), some(2.0)));
            // FRAMES: made up, anywhere.
            let flange_from_probe = Pose::<Flange, Probe>::assume(Isometry3::new(some(0.3), some(2.0)));
            let pushed = some(20.0);
            // Along the URDF's axes, by hand: the lever from the flange to the tip.
            let in_base =
                base_from_flange.isometry().rotation * (flange_from_probe.isometry().rotation * pushed);
            let lever =
                base_from_flange.isometry().rotation * flange_from_probe.isometry().translation.vector;
            let torque = lever.cross(&in_base);
            let theirs = [-in_base.x, -in_base.y, in_base.z, -torque.x, -torque.y, torque.z];
            let felt = wrench(&theirs, &base_from_flange, &flange_from_probe);
            assert!((felt.force - pushed).amax() < 1e-9 && felt.torque.amax() < 1e-9, "{felt:?}");
        }
    }
}
