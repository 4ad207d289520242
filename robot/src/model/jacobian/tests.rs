use nalgebra::{Matrix6, Vector3, Vector6};

use crate::model::tests::{Seeded, tool};
use crate::{Joints, Model, manipulability};

#[test]
fn manipulability_is_the_root_of_the_determinant() {
    let mut seeded = Seeded(21);
    for arm in [Model::ur5e(), Model::seven_joint()] {
        for _ in 0..1000 {
            let jacobian = arm.jacobian(&seeded.posture(&arm), &tool());
            let determinant = (jacobian.matrix() * jacobian.matrix().transpose()).determinant();
            // The determinant has lost half its digits where the square root is small.
            let off = (manipulability(&jacobian).powi(2) - determinant).abs();
            assert!(off < 1e-12, "{off}");
        }
    }
}

#[test]
fn no_direction_gets_less_than_the_smallest_singular_value() {
    let mut seeded = Seeded(22);
    let arm = Model::ur5e();
    for _ in 0..300 {
        let jacobian = arm.jacobian(&seeded.posture(&arm), &tool());
        let smallest = jacobian.smallest_singular_value();
        for _ in 0..30 {
            let mut rates = Joints::zeros(6);
            rates.as_mut_slice().iter_mut().for_each(|rate| *rate = seeded.unit() - 0.5);
            let length = rates.iter().map(|rate| rate * rate).sum::<f64>().sqrt();
            assert!(jacobian.velocity(&rates).norm() >= smallest * length - 1e-12);
        }
        // And the inverse's norm is its reciprocal: something does get as little.
        let square = jacobian.matrix().fixed_columns::<6>(0).into_owned();
        if let Some(inverse) = square.try_inverse().filter(|_| smallest > 1e-4) {
            let largest = largest_singular_value(&inverse);
            assert!((1.0 / smallest - largest).abs() < 1e-6 * largest, "{smallest} {largest}");
        }
    }
}

/// The largest singular value, by power iteration.
fn largest_singular_value(matrix: &Matrix6<f64>) -> f64 {
    let square = matrix.transpose() * matrix;
    let mut v = Vector6::repeat(1.0);
    for _ in 0..20_000 {
        v = (square * v).normalize();
    }
    (matrix * v).norm()
}

#[test]
fn at_a_wrist_in_line_the_smallest_singular_value_is_zero() {
    let arm = Model::ur5e();
    let mut seeded = Seeded(23);
    for _ in 0..100 {
        let mut q = seeded.posture(&arm);
        q[4] = 0.0;
        let jacobian = arm.jacobian(&q, &tool());
        assert!(jacobian.smallest_singular_value() < 1e-14 && manipulability(&jacobian) < 1e-14);
    }
}

#[test]
fn torques_do_the_work_that_the_force_does() {
    let mut seeded = Seeded(24);
    for arm in [Model::ur5e(), Model::seven_joint()] {
        for _ in 0..200 {
            let jacobian = arm.jacobian(&seeded.posture(&arm), &tool());
            let rates = seeded.posture(&arm);
            let mut three = || Vector3::new(seeded.unit(), seeded.unit(), seeded.unit());
            let (force, torque) = (three() * 10.0, three());
            let v = jacobian.velocity(&rates);
            let at_the_tool = force.dot(&v.fixed_rows::<3>(0)) + torque.dot(&v.fixed_rows::<3>(3));
            let at_the_joints: f64 = jacobian.torques(&force, &torque).zip(&rates, |a, b| a * b).iter().sum();
            assert!((at_the_tool - at_the_joints).abs() < 1e-10);
        }
    }
}

#[test]
fn a_jacobian_that_is_not_finite_has_no_number() {
    let arm = Model::ur5e();
    let jacobian = arm.jacobian(&Joints::splat(6, f64::NAN), &tool());
    assert!(jacobian.smallest_singular_value().is_nan() && jacobian.manipulability().is_nan());
}
