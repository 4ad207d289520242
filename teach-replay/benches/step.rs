//! How long one whole step takes, from the state that came in to the command that goes out: the operator, the contact's
//! law, the path, kinematics and the quadratic program, the limits and the guard, in the one loop that also runs
//! hardware. Every single step is timed, and beside all of them those during which the system gave the processor to
//! nobody else, as on a shared machine the others tell of its other work: `cargo bench -p probepath-teach-replay --bench step`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench prints, and may stop at the first surprise"
)]
#![allow(clippy::disallowed_methods, reason = "a bench asks the wall clock how long a step takes")]

use std::time::Instant;

use nalgebra::{Isometry3, Vector3};
use nix::sys::resource::{UsageWho, getrusage};
use probepath_frames::{Base, Direction, Point, Pose, Probe, Span, Stamp, Wrench};
use probepath_robot::{
    Arm, ArmFault, Command, Guard, GuardLimits, Joints, Model, MotionLimits, Operator, Plane, State,
    Workspace, probe_place, run,
};
use probepath_teach_replay::{
    Label, Path, PathPoint, Plan, PlanSettings, ProbeArm, Replay, ReplayEnding, ReplayPhase, ReplaySettings,
    ReplayWatch, Side,
};

const PERIOD: Span = Span::from_milliseconds(2);
/// Height of the skin (m) and its stiffness (N/m).
const SKIN: (f64, f64) = (0.12, 800.0);

/// Nanoseconds that a step took, and whether it was interrupted.
type Step = (u64, bool);

/// How often the system took the processor away from this thread.
fn interruptions() -> i64 {
    let usage = getrusage(UsageWho::RUSAGE_THREAD).unwrap();
    usage.involuntary_context_switches() + usage.voluntary_context_switches()
}

/// An arm that does what it is told at once, on a flat skin, and times what happens between two exchanges.
struct Timed {
    arm: ProbeArm,
    state: State,
    watch: ReplayWatch,
    left: Option<(Instant, i64)>,
    /// Every step along the path, and every other.
    follow: Vec<Step>,
    others: Vec<Step>,
}

impl Arm for Timed {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let took =
            self.left.map(|(left, before)| (left.elapsed().as_nanos() as u64, interruptions() != before));
        let phase = self.watch.status().phase;
        if let Some(took) = took {
            if phase == ReplayPhase::Follow { self.follow.push(took) } else { self.others.push(took) }
        }
        let state = &mut self.state;
        if let Command::Position(position) = command {
            state.velocity = position.zip(&state.position, |now, before| (now - before) / PERIOD.seconds());
            (state.position, state.commanded) = (*position, *position);
        }
        state.tick += 1;
        state.stamp = state.stamp + PERIOD;
        let height = self.arm.probe(&state.position).origin().vector().z;
        let press = -(SKIN.0 - height).max(0.0) * SKIN.1;
        // A sensor that reads the same to the bit is one that hangs.
        let torque = 1e-4 * (state.tick % 7) as f64;
        state.wrench = Wrench::new(Vector3::new(0.0, 0.0, press), Vector3::new(0.0, torque, 0.0));
        let state = *state;
        let before = interruptions();
        self.left = Some((Instant::now(), before));
        Ok(state)
    }

    fn period(&self) -> Span {
        PERIOD
    }

    fn joints(&self) -> usize {
        self.state.position.len()
    }
}

fn probe_arm(model: Model) -> ProbeArm {
    let joints = model.joints();
    let limits =
        MotionLimits::of_model(&model, Joints::splat(joints, 5.0), Joints::splat(joints, 50.0)).unwrap();
    // FRAMES: a made-up holder: the probe's face 150 mm in front of the flange.
    let flange_from_probe = Pose::assume(Isometry3::translation(0.0, 0.0, 0.15));
    ProbeArm { model, flange_from_probe, limits, period: PERIOD }
}

/// A path of 120 mm along y, a millimetre deep in the skin, swaying and turning.
fn path() -> Path {
    let points = (0..241).map(|i| {
        let y = 0.05 + 0.0005 * f64::from(i);
        let origin = Vector3::new(0.49 + 0.001 * (20.0 * y).sin(), y, SKIN.0 - 0.001);
        let turn = Vector3::new(std::f64::consts::PI, 0.05 * (18.0 * y).sin(), 0.1 * (12.0 * y).sin());
        // FRAMES: a made-up probe in the base, its face down.
        let base_from_probe: Pose<Base, Probe> = Pose::assume(Isometry3::new(origin, turn));
        PathPoint { base_from_probe, moved: None }
    });
    let label = Label { study: "S-009".into(), side: Side::Left, date: "2026-11-22".into() };
    Path::new(label, 0.0005, points.collect(), None).unwrap()
}

fn measure(name: &str, model: Model, home: &[f64]) {
    let home = Joints::from_slice(home).unwrap();
    let arm = probe_arm(model);
    // A box around the leg, so that the planes are looked at too.
    let floor = Plane { through: Point::<Base>::new(0.0, 0.0, 0.05), inward: Direction::z() };
    let side = Plane { through: Point::<Base>::new(0.0, -0.4, 0.0), inward: Direction::y() };
    let workspace = Workspace::new().and(floor).and(side);
    let settings = PlanSettings { workspace: workspace.clone(), ..PlanSettings::default() };
    let plan = Plan::new(&path(), &arm, &home, &settings).unwrap();
    let replay_settings = ReplaySettings::default();
    let (mut follow, mut others) = (Vec::with_capacity(400_000), Vec::with_capacity(400_000));
    for _ in 0..20 {
        let mut replay = Replay::new(plan.clone(), replay_settings, Operator::new()).unwrap();
        let state = State {
            tick: 0,
            stamp: Stamp::ZERO,
            position: home,
            velocity: Joints::zeros(home.len()),
            commanded: home,
            wrench: Wrench::zero(),
            guiding: false,
            safety: Default::default(),
            age: Span::ZERO,
        };
        let watch = replay.watch();
        let mut timed = Timed { arm: arm.clone(), state, watch, left: None, follow, others };
        let guard_limits = GuardLimits { free_speed_m_s: 0.5, ..GuardLimits::default() };
        let place = probe_place(arm.model.clone(), arm.flange_from_probe);
        let mut guard = Guard::new(guard_limits, arm.limits).unwrap().within(workspace.clone(), place);
        run(&mut timed, &mut replay, &mut guard, &mut ()).unwrap();
        assert_eq!(replay.status().ending, Some(ReplayEnding::Completed));
        (follow, others) = (timed.follow, timed.others);
    }
    for (phase, steps) in [("along the path", &follow), ("other phases", &others)] {
        report(&format!("{name}, {phase}"), steps.iter().map(|step| step.0).collect());
        let alone = steps.iter().filter(|step| !step.1).map(|step| step.0).collect();
        report(&format!("{name}, {phase}, not interrupted"), alone);
    }
}

/// Percentiles in microseconds.
fn report(name: &str, mut took: Vec<u64>) {
    took.sort_unstable();
    let at = |part: f64| took[((took.len() - 1) as f64 * part) as usize] as f64 * 1e-3;
    println!(
        "one whole step, {name}: {} steps; p50 {:.2} us, p90 {:.2}, p99 {:.2}, p99.9 {:.2}, p99.99 {:.2}, most {:.1}",
        took.len(),
        at(0.5),
        at(0.9),
        at(0.99),
        at(0.999),
        at(0.9999),
        at(1.0)
    );
}

/// What timing itself takes: two readings of the clock.
fn clock() {
    let took = (0..100_000).map(|_| Instant::now().elapsed().as_nanos() as u64).collect();
    report("the clock alone", took);
}

fn main() {
    clock();
    measure("6 joints", Model::ur5e(), &[0.0, -1.57, 1.57, -1.57, -1.57, 0.0]);
    measure("7 joints", Model::seven_joint(), &[0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.78]);
}
