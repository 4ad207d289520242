//! How long the model's questions take: `cargo bench -p probepath-robot --bench kinematics`.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use probepath_frames::nalgebra::{Isometry3, Translation3, UnitQuaternion};
use probepath_frames::{Flange, Pose, Probe};
use probepath_robot::{InverseOptions, Joints, Model};

/// Joint positions that are regular and within limits for both arms.
const BENT: [f64; 7] = [0.3, -0.8, 0.5, -1.6, 0.9, 1.4, 0.2];

fn kinematics(criterion: &mut Criterion) {
    // FRAMES: a probe held straight ahead, for the benchmark.
    let tool: Pose<Flange, Probe> =
        Pose::assume(Isometry3::from_parts(Translation3::new(0.0, 0.0, 0.15), UnitQuaternion::identity()));
    for arm in [Model::ur5e(), Model::seven_joint()] {
        let mut near = Joints::zeros(arm.joints());
        near.as_mut_slice().copy_from_slice(&BENT[..arm.joints()]);
        let tick = arm.forward(&near.map(|q| q + 0.002)) * tool;
        let far = arm.forward(&near.map(|q| q * 0.6 - 0.2)) * tool;
        let jacobian = arm.jacobian(&near, &tool);
        let mut group = criterion.benchmark_group(arm.name());
        group.bench_function("forward", |b| b.iter(|| arm.forward(black_box(&near))));
        group.bench_function("jacobian", |b| b.iter(|| arm.jacobian(black_box(&near), &tool)));
        group.bench_function("smallest singular value", |b| {
            b.iter(|| black_box(&jacobian).smallest_singular_value())
        });
        group.bench_function("refine", |b| b.iter(|| arm.refine(black_box(&tick), &tool, &near)));
        group.bench_function("inverse", |b| {
            b.iter(|| arm.inverse(black_box(&far), &tool, &near, &InverseOptions::default()))
        });
        group.finish();
    }
}

criterion_group!(benches, kinematics);
criterion_main!(benches);
