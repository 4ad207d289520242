use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Pose, Probe};

use super::*;
use crate::MAX_JOINTS;

/// A small generator of numbers in 0 to 1, the same on every machine (SplitMix64).
pub(super) struct Seeded(pub(super) u64);

impl Seeded {
    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn posture(&mut self, arm: &Model) -> Joints {
        let mut q = Joints::zeros(arm.joints());
        for (q, limit) in q.as_mut_slice().iter_mut().zip(arm.limits()) {
            let (lower, upper) = (limit.lower.max(-3.2), limit.upper.min(3.2));
            *q = lower + (upper - lower) * self.unit();
        }
        q
    }
}

pub(super) fn tool() -> Pose<Flange, Probe> {
    let rotation = UnitQuaternion::from_euler_angles(0.3, -0.4, 1.0);
    // FRAMES: a probe held somehow, for tests.
    Pose::assume(Isometry3::from_parts(Translation3::new(0.02, -0.05, 0.18), rotation))
}

#[test]
fn the_ur5e_is_where_a_real_one_says_it_is() {
    let bent = Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0]).unwrap();
    let place = Model::ur5e().forward(&bent).origin().vector();
    assert!((place - Vector3::new(0.492, 0.133, 0.488)).amax() < 1e-3, "{place}");
}

#[test]
fn the_jacobian_is_the_derivative_of_the_forward_kinematics() {
    let mut seeded = Seeded(1);
    for arm in [Model::ur5e(), Model::seven_joint()] {
        for _ in 0..1000 {
            let q = seeded.posture(&arm);
            let jacobian = arm.jacobian(&q, &tool());
            for j in 0..arm.joints() {
                let off = (jacobian.column(j) - difference(&arm, &q, j)).amax();
                assert!(off < 1e-8, "{} joint {j} at {q:?}: {off}", arm.name());
            }
        }
    }
}

fn difference(arm: &Model, q: &Joints, joint: usize) -> Vector6 {
    let step = 1e-5;
    let (mut more, mut less) = (*q, *q);
    more[joint] += step;
    less[joint] -= step;
    let (more, less): (Pose<Base, Probe>, Pose<Base, Probe>) =
        (arm.forward(&more) * tool(), arm.forward(&less) * tool());
    let linear = (more.origin().vector() - less.origin().vector()) / (2.0 * step);
    let turn = more.isometry().rotation * less.isometry().rotation.inverse();
    let angular = turn.scaled_axis() / (2.0 * step);
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

#[test]
fn refining_follows_a_tick_s_motion_to_rounding() {
    let mut seeded = Seeded(2);
    for arm in [Model::ur5e(), Model::seven_joint()] {
        let mut tried = 0;
        while tried < 1000 {
            let q = seeded.posture(&arm);
            if arm.jacobian(&q, &tool()).smallest_singular_value() < 0.02 {
                continue;
            }
            let moved = q.zip(&q.map(|_| 0.0), |q, _| q + 0.004 * (seeded_like(q) - 0.5));
            if arm.outside_limits(&moved, 0.0).is_some() {
                continue;
            }
            tried += 1;
            let goal = arm.forward(&moved) * tool();
            let found = arm.refine(&goal, &tool(), &q).expect("a tick away from a regular posture");
            let (metres, radians) = (arm.forward(&found) * tool()).distance(&goal);
            assert!(metres < 2e-12 && radians < 1e-11, "{metres} m, {radians} rad");
            assert!(found.zip(&q, |a, b| a - b).largest() < 0.1);
        }
    }
}

/// A number in 0 to 1 that looks unrelated to `x`.
fn seeded_like(x: f64) -> f64 {
    (x * 1e4).sin().abs()
}

#[test]
fn another_posture_is_not_the_next_tick() {
    let arm = Model::ur5e();
    let near = Joints::from_slice(&[0.0, -1.2, 1.4, -1.6, -1.5, 0.0]).unwrap();
    let goal = |by: f64| arm.forward(&near.zip(&near, |q, _| q + by)) * tool();
    assert!(arm.refine(&goal(0.1), &tool(), &near).is_some());
    assert_eq!(arm.refine(&goal(0.8), &tool(), &near), None);
}

#[test]
fn joints_of_another_length_give_a_pose_that_is_not_finite() {
    assert!(!Model::ur5e().forward(&Joints::zeros(MAX_JOINTS)).is_finite());
}
