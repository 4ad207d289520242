//! How long the timing of 4,000 taught points takes: `cargo bench -p probepath-robot --bench timing`. With
//! PROBEPATH_PYTHON naming a Python that has toppra, toppra times the same points beside it, with velocities and
//! accelerations only: it knows no jerk.

#![allow(clippy::print_stderr, reason = "a benchmark says what it measured")]

use std::hint::black_box;
use std::io::Write;
use std::process::{Command, Stdio};

use criterion::{Criterion, criterion_group, criterion_main};
use probepath_robot::motion::timing::{PathClock, PathLimits, PathSpeed};
use probepath_robot::{Joints, MotionLimits};

const POINTS: usize = 4000;
/// Distance between points (m): 0.5 mm, as a taught path has them.
const STEP: f64 = 0.0005;

/// Six joints that sway as those of an arm along a leg.
fn taught(i: usize) -> Joints {
    let s = STEP * i as f64;
    let mut joints = Joints::zeros(6);
    let swings = [
        (1.2, 0.05, 0.31),
        (-0.9, 0.04, 0.23),
        (1.5, 0.06, 0.41),
        (0.4, 0.08, 0.17),
        (-1.1, 0.03, 0.13),
        (0.7, 0.1, 0.53),
    ];
    for (joint, (slope, swing, wave)) in swings.into_iter().enumerate() {
        joints[joint] = slope * s + swing * (s / wave * std::f64::consts::TAU + joint as f64).sin();
    }
    joints
}

fn limits() -> MotionLimits {
    let all = |value| Joints::splat(6, value);
    MotionLimits {
        lower: all(-9.0),
        upper: all(9.0),
        velocity: all(1.5),
        acceleration: all(5.0),
        jerk: all(100.0),
    }
}

fn timing(criterion: &mut Criterion) {
    let postures: Vec<Joints> = (0..POINTS).map(taught).collect();
    let cases = [
        ("scan, 20 mm/s", PathSpeed::gentle(0.02)),
        ("joints' limits alone", PathSpeed { speed: 2.0, acceleration: 50.0, jerk: 2000.0 }),
    ];
    let mut group = criterion.benchmark_group("timing of 4000 points");
    group.sample_size(20);
    for (name, wanted) in cases {
        let time = || PathLimits::new(STEP, black_box(&postures), &limits(), wanted);
        group.bench_function(name, |b| b.iter(time));
        let Ok(timed) = time() else { continue };
        eprintln!("{name}: the motion takes {:.3} s", timed.duration_s());
        let mut clock = PathClock::new(timed.clone());
        group.bench_function(format!("{name}: a tick of the clock"), |b| {
            b.iter(|| {
                if clock.has_arrived() {
                    clock = PathClock::new(timed.clone());
                }
                clock.step(wanted.speed, 0.002)
            });
        });
    }
    group.finish();
    beside(&postures);
}

/// toppra on the same points, in the same run.
fn beside(postures: &[Joints]) {
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!("skipped: PROBEPATH_PYTHON names no Python with toppra (tests/run installs one)");
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/toppra_beside.py");
    let child = Command::new(python).arg(script).stdin(Stdio::piped()).spawn();
    let Ok(mut child) = child else {
        eprintln!("skipped: PROBEPATH_PYTHON cannot be run");
        return;
    };
    if let Some(mut stdin) = child.stdin.take() {
        for joints in postures {
            let row: Vec<String> = joints.iter().map(|q| format!("{q:e}")).collect();
            // What cannot be written is told by the script itself: too few rows.
            let _ = writeln!(stdin, "{}", row.join(" "));
        }
    }
    let _ = child.wait();
}

criterion_group!(benches, timing);
criterion_main!(benches);
