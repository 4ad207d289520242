//! Forward kinematics and Jacobians against Pinocchio's: files made by `tests/golden/make_kinematics.py`.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a test's own helpers may stop at the first surprise, and say what they measured"
)]

use std::path::{Path, PathBuf};

use probepath_frames::{Flange, Pose};
use probepath_robot::{Joints, Model, PANDA_URDF, UR5E_URDF};

/// One posture, and what Pinocchio says of it.
struct Row {
    joints: Joints,
    place: Vec<f64>,
    /// By rows.
    rotation: Vec<f64>,
    /// By rows, 6 x n.
    jacobian: Vec<f64>,
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/kinematics").join(name)
}

fn rows(name: &str) -> Vec<Row> {
    let bytes = std::fs::read(golden(name)).unwrap();
    assert_eq!(&bytes[..8], b"PPKINE1\n");
    let count = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (n, rows) = (count(8), count(12));
    let numbers: Vec<f64> =
        bytes[16..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let width = n + 12 + 6 * n;
    assert_eq!(numbers.len(), rows * width);
    assert_eq!(rows, 1000);
    let row = |row: &[f64]| Row {
        joints: Joints::from_slice(&row[..n]).unwrap(),
        place: row[n..n + 3].to_vec(),
        rotation: row[n + 3..n + 12].to_vec(),
        jacobian: row[n + 12..].to_vec(),
    };
    numbers.chunks_exact(width).map(row).collect()
}

/// The largest difference between the model and Pinocchio.
fn worst(model: &Model, rows: &[Row]) -> f64 {
    let n = model.joints();
    let mut worst: f64 = 0.0;
    for row in rows {
        assert_eq!(row.joints.len(), n);
        let pose = model.forward(&row.joints);
        let rotation = pose.isometry().rotation.to_rotation_matrix();
        let jacobian = model.jacobian(&row.joints, &Pose::<Flange, Flange>::identity());
        for i in 0..3 {
            worst = worst.max((pose.origin().vector()[i] - row.place[i]).abs());
            for k in 0..3 {
                worst = worst.max((rotation.matrix()[(i, k)] - row.rotation[3 * i + k]).abs());
            }
        }
        for (i, theirs) in row.jacobian.iter().enumerate() {
            worst = worst.max((jacobian.matrix()[(i / n, i % n)] - theirs).abs());
        }
        assert!(worst.is_finite());
    }
    worst
}

fn agrees(model: &Model, name: &str) {
    let worst = worst(model, &rows(name));
    println!("{name}: {worst:.1e}");
    assert!(worst < 1e-9, "{name}: {worst}");
}

fn from_file(name: &str, base: &str, tip: &str) -> Model {
    let (model, warnings) = Model::from_urdf_file(&golden(name), base, tip).unwrap();
    assert_eq!(warnings, []);
    model
}

#[test]
fn the_arms_that_ship_agree_with_pinocchio() {
    agrees(&Model::ur5e(), "ur5e.bin");
    agrees(&Model::seven_joint(), "panda.bin");
    assert!(UR5E_URDF.contains("<robot name=\"ur5e\">") && PANDA_URDF.contains("panda_link8"));
}

#[test]
fn other_people_s_arms_agree_with_pinocchio() {
    agrees(&from_file("ur3e.urdf", "base_link", "tool0"), "ur3e.bin");
    agrees(&from_file("xarm7.urdf", "world", "link_eef"), "xarm7.bin");
}

#[test]
fn rails_mimic_joints_and_skew_axes_agree_with_pinocchio() {
    let gantry = from_file("gantry.urdf", "floor", "flange");
    assert_eq!(gantry.joint_names(), ["lift", "trolley", "swing", "spin", "flange_joint"]);
    agrees(&gantry, "gantry.bin");
}

#[test]
fn a_chain_that_goes_up_one_branch_and_down_another_agrees_with_pinocchio() {
    let gantry = from_file("gantry.urdf", "camera", "wrist");
    assert_eq!(gantry.joint_names(), ["camera_tilt", "camera_turn", "swing", "spin"]);
    agrees(&gantry, "gantry_from_camera.bin");
}
