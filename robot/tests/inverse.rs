//! Inverse kinematics: checked by the forward kinematics, and for the reasons it gives when it fails.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test's own helpers may stop at the first surprise, and say what they measured"
)]

use std::path::Path;

use probepath_frames::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Pose, Probe};
use probepath_robot::{InverseOptions, Joints, Model, NoInverse};

const OPTIONS: InverseOptions = InverseOptions { steps: 100, restarts: 60, enough: 4 };

/// Numbers in 0 to 1, the same on every machine (SplitMix64).
struct Seeded(u64);

impl Seeded {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn posture(&mut self, arm: &Model) -> Joints {
        let mut q = Joints::zeros(arm.joints());
        for (q, limit) in q.as_mut_slice().iter_mut().zip(arm.limits()) {
            let (lower, upper) = (limit.lower.max(-6.3), limit.upper.min(6.3));
            *q = lower + (upper - lower) * self.unit();
        }
        q
    }

    /// A posture within limits, each joint at most `apart` from the given one.
    fn near(&mut self, arm: &Model, q: &Joints, apart: f64) -> Joints {
        let mut near = *q;
        for (q, limit) in near.as_mut_slice().iter_mut().zip(arm.limits()) {
            *q = (*q + apart * (2.0 * self.unit() - 1.0)).clamp(limit.lower, limit.upper);
        }
        near
    }
}

fn tool() -> Pose<Flange, Probe> {
    let rotation = UnitQuaternion::from_euler_angles(0.3, -0.4, 1.0);
    // FRAMES: a probe held somehow, for tests.
    Pose::assume(Isometry3::from_parts(Translation3::new(0.02, -0.05, 0.18), rotation))
}

fn from_file(name: &str, base: &str, tip: &str) -> Model {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/kinematics");
    Model::from_urdf_file(&folder.join(name), base, tip).unwrap().0
}

fn arms() -> [Model; 4] {
    [
        Model::ur5e(),
        Model::seven_joint(),
        from_file("ur3e.urdf", "base_link", "tool0"),
        from_file("xarm7.urdf", "world", "link_eef"),
    ]
}

/// The joints that were found, checked: they put the tool there, within limits.
fn solved(arm: &Model, goal: &Pose<Base, Probe>, reference: &Joints, within: f64) -> Option<Joints> {
    let joints = arm.inverse(goal, &tool(), reference, &OPTIONS).ok()?;
    let (metres, radians) = (arm.forward(&joints) * tool()).distance(goal);
    // The angle between two quaternions has no more than half the digits near zero.
    assert!(metres < within && radians < within.max(1e-7), "{}: {metres} m, {radians} rad", arm.name());
    assert_eq!(arm.outside_limits(&joints, 1e-9), None);
    Some(joints)
}

#[test]
fn poses_of_random_postures_are_found_from_any_reference() {
    let mut seeded = Seeded(11);
    for arm in arms() {
        let tries = 1000;
        let found = (0..tries)
            .filter(|_| {
                let goal = arm.forward(&seeded.posture(&arm)) * tool();
                solved(&arm, &goal, &seeded.posture(&arm), 2e-9).is_some()
            })
            .count();
        println!("{}: {found} of {tries} from any reference", arm.name());
        assert!(found * 1000 >= tries * 995, "{}: {found} of {tries}", arm.name());
    }
}

#[test]
fn a_pose_near_the_reference_is_found_near_the_reference() {
    let mut seeded = Seeded(12);
    for arm in arms() {
        let (tries, apart) = (1000, 0.2);
        let mut near = 0;
        for _ in 0..tries {
            let q = seeded.posture(&arm);
            let reference = seeded.near(&arm, &q, apart);
            let goal = arm.forward(&q) * tool();
            let found = solved(&arm, &goal, &reference, 2e-9).expect("it was made near the reference");
            near += usize::from(found.zip(&reference, |a, b| a - b).largest() < 3.0 * apart);
        }
        println!("{}: {near} of {tries} within {} rad", arm.name(), 3.0 * apart);
        assert!(near * 100 >= tries * 90, "{}: {near} of {tries}", arm.name());
    }
}

#[test]
fn a_seventh_joint_goes_where_the_posture_is_nearest_to_the_reference() {
    let arm = Model::seven_joint();
    let (mut seeded, tries, mut nearest) = (Seeded(13), 500, 0);
    for _ in 0..tries {
        let q = seeded.posture(&arm);
        let reference = seeded.near(&arm, &q, 0.3);
        let goal = arm.forward(&q) * tool();
        let found = solved(&arm, &goal, &reference, 2e-9).expect("it was made near the reference");
        let distance = |q: &Joints| q.zip(&reference, |a, b| (a - b) * (a - b)).iter().sum::<f64>().sqrt();
        nearest += usize::from(distance(&found) <= distance(&q) + 1e-6);
    }
    println!("{nearest} of {tries} nearer to the reference than the posture it was made from");
    assert!(nearest * 100 >= tries * 98, "{nearest} of {tries}");
}

#[test]
fn poses_at_singularities_are_found() {
    let arm = Model::ur5e();
    let mut seeded = Seeded(14);
    let (mut found, tries) = (0, 400);
    for round in 0..tries {
        let mut q = seeded.posture(&arm);
        // The wrist's axes in line; the arm stretched.
        if round % 2 == 0 {
            q[4] = 0.0;
        } else {
            q[2] = 0.0;
        }
        let goal = arm.forward(&q) * tool();
        found += usize::from(solved(&arm, &goal, &seeded.near(&arm, &q, 0.3), 2e-9).is_some());
    }
    println!("{found} of {tries} at singularities");
    assert!(found * 100 >= tries * 95, "{found} of {tries}");
}

#[test]
fn the_same_question_gives_the_same_answer() {
    let arm = Model::seven_joint();
    let mut seeded = Seeded(15);
    for _ in 0..50 {
        let (goal, reference) = (arm.forward(&seeded.posture(&arm)) * tool(), seeded.posture(&arm));
        let ask = || arm.inverse(&goal, &tool(), &reference, &OPTIONS);
        assert_eq!(ask(), ask());
    }
}

fn at(x: f64, y: f64, z: f64) -> Pose<Base, Flange> {
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    // FRAMES: a place beside the base, the flange downward, for tests.
    Pose::assume(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn refused(arm: &Model, goal: &Pose<Base, Flange>, reference: &Joints) -> NoInverse {
    arm.inverse(goal, &Pose::identity(), reference, &OPTIONS).expect_err("it cannot be reached")
}

/// How far the flange gets from the shoulder's centre: a posture that stretches, found by brute force.
fn longest_reach(arm: &Model, centre: Vector3<f64>) -> f64 {
    let steps = 48;
    let mut longest: f64 = 0.0;
    for a in 0..steps {
        for b in 0..steps {
            for c in 0..steps {
                let turn = |i: usize| std::f64::consts::TAU * i as f64 / steps as f64;
                let q = Joints::from_slice(&[0.0, 0.0, turn(a).min(3.1), turn(b), turn(c), 0.0]).unwrap();
                longest = longest.max((arm.forward(&q).origin().vector() - centre).norm());
            }
        }
    }
    longest
}

#[test]
fn out_of_reach_says_by_how_much() {
    let arm = Model::ur5e();
    let shoulder = Vector3::new(0.0, 0.0, 0.1625);
    let longest = longest_reach(&arm, shoulder);
    for distance in [1.2, 1.5, 3.0] {
        // Straight up, where a stretched arm's offsets do not matter to the distance.
        let goal = at(0.6 * distance, 0.0, 0.1625 + 0.8 * distance);
        let error = refused(&arm, &goal, &Joints::from_slice(&[0.0, -1.0, 1.0, -1.5, -1.5, 0.0]).unwrap());
        let NoInverse::OutOfReach { short_m } = error else { panic!("{error}") };
        println!("{distance} m: short by {short_m}, at most {}", distance - longest);
        assert!((short_m - (distance - longest)).abs() < 5e-3, "{short_m} against {}", distance - longest);
    }
}

#[test]
fn a_limit_in_the_way_is_named() {
    // The shoulder's axis set across: with the pan joint held to 10 degrees, a place to the side is beyond it.
    let text = probepath_robot::UR5E_URDF.replacen(
        "lower=\"-6.283185307179586\" upper=\"6.283185307179586\"",
        "lower=\"-0.17\" upper=\"0.17\"",
        1,
    );
    let (arm, _) = Model::from_urdf(&text, "held.urdf", "base_link", "tool0").unwrap();
    let reference = Joints::from_slice(&[0.0, -1.0, 1.0, -1.5, -1.5, 0.0]).unwrap();
    let error = refused(&arm, &at(0.1, 0.7, 0.3), &reference);
    let NoInverse::BeyondLimit { ref joint, needed, lower, upper } = error else { panic!("{error}") };
    assert_eq!(joint, "shoulder_pan_joint");
    assert!((lower, upper) == (-0.17, 0.17) && (needed < lower || needed > upper), "{error}");
}

#[test]
fn an_orientation_that_cannot_be_is_named() {
    // High up and pointing down: the wrist would have to be a hand higher than the arm is long.
    let arm = Model::ur5e();
    let goal = at(0.3, 0.0, 0.95);
    let error = refused(&arm, &goal, &Joints::from_slice(&[0.0, -1.5, 0.1, -1.5, -1.5, 0.0]).unwrap());
    assert!(
        matches!(error, NoInverse::NotSoOriented { short_m, short_rad } if short_m + short_rad > 0.01),
        "{error}"
    );
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    let arm = Model::ur5e();
    let good = Joints::zeros(6);
    assert_eq!(
        refused(&arm, &at(0.4, 0.0, 0.4), &Joints::zeros(7)),
        NoInverse::WrongJoints { found: 7, expected: 6 }
    );
    assert!(matches!(
        refused(&arm, &at(f64::NAN, 0.0, 0.4), &good),
        NoInverse::NotFinite { what: "the pose" }
    ));
    let lost = Joints::splat(6, f64::INFINITY);
    assert!(matches!(refused(&arm, &at(0.4, 0.0, 0.4), &lost), NoInverse::NotFinite { .. }));
    assert_eq!(arm.refine(&at(0.4, f64::NAN, 0.4), &Pose::identity(), &good), None);
    assert_eq!(arm.refine(&at(0.4, 0.0, 0.4), &Pose::identity(), &Joints::zeros(7)), None);
}
