//! No step of a motion touches the heap: not hand guiding's, not the replay's, not the lift-off's.
//!
//! The allocator ends the process at the first allocation inside [`assert_no_alloc`].

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Span, Stamp, Wrench};
use probepath_robot::{
    Arm, ArmFault, Command, Guard, GuardLimits, Joints, Model, MotionLimits, Safety, State, run,
};
use probepath_robot::{Controller, Operator, Tick, Wish};
use probepath_teach_replay::{
    GiveWay, HandGuide, Label, LiftOff, Path, PathPoint, Plan, PlanSettings, ProbeArm, Recorder, Replay,
    ReplayEnding, ReplaySettings, Side,
};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const PERIOD: Span = Span::from_milliseconds(2);
/// Height of the skin (m) and its stiffness (N/m).
const SKIN: (f64, f64) = (0.12, 800.0);

fn probe_arm() -> ProbeArm {
    let model = Model::ur5e();
    let limits = MotionLimits::of_model(&model, Joints::splat(6, 5.0), Joints::splat(6, 50.0)).unwrap();
    // FRAMES: a made-up holder: the probe's face 150 mm in front of the flange.
    let flange_from_probe = Pose::assume(Isometry3::translation(0.0, 0.0, 0.15));
    ProbeArm { model, flange_from_probe, limits, period: PERIOD }
}

fn home() -> Joints {
    Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0]).unwrap()
}

/// An arm that does what it is told at once, on a flat skin; a hand pushes it while it is guided.
struct Ideal {
    arm: ProbeArm,
    state: State,
    /// Ticks for which a hand pushes.
    guided: u64,
}

impl Ideal {
    fn at(joints: Joints, guided: u64) -> Self {
        let state = State {
            tick: 0,
            stamp: Stamp::ZERO,
            position: joints,
            velocity: Joints::zeros(6),
            commanded: joints,
            wrench: Wrench::zero(),
            guiding: guided > 0,
            safety: Safety::Normal,
            age: Span::ZERO,
        };
        Self { arm: probe_arm(), state, guided }
    }
}

impl Arm for Ideal {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let state = &mut self.state;
        if let Command::Position(position) = command {
            state.velocity = position.zip(&state.position, |now, before| (now - before) / PERIOD.seconds());
            (state.position, state.commanded) = (*position, *position);
        }
        state.tick += 1;
        state.stamp = state.stamp + PERIOD;
        state.guiding = state.tick < self.guided;
        let height = self.arm.probe(&state.position).origin().vector().z;
        let skin = -(SKIN.0 - height).max(0.0) * SKIN.1;
        let hand = if state.guiding { Vector3::new(3.0, -2.0, 1.0) } else { Vector3::zeros() };
        // A sensor that reads the same to the bit is one that hangs.
        let torque = 0.1 + 1e-4 * (state.tick % 7) as f64;
        state.wrench = Wrench::new(hand + Vector3::new(0.0, 0.0, skin), Vector3::new(0.0, torque, 0.0));
        Ok(*state)
    }

    fn period(&self) -> Span {
        PERIOD
    }

    fn joints(&self) -> usize {
        6
    }
}

/// Runs the whole loop with the allocator shut.
fn run_without_heap(arm: &mut Ideal, controller: &mut dyn Controller, watch: &mut dyn FnMut(&Tick) -> Wish) {
    let guard_limits = GuardLimits { free_speed_m_s: 5.0, ..GuardLimits::hand_guiding() };
    let mut guard = Guard::new(guard_limits, probe_arm().limits).unwrap();
    let mut watch = Watch(watch);
    let finished = assert_no_alloc(|| run(arm, controller, &mut guard, &mut watch));
    assert!(finished.unwrap().ticks > 500);
}

struct Watch<'a>(&'a mut dyn FnMut(&Tick) -> Wish);

impl probepath_robot::Observer for Watch<'_> {
    fn tick(&mut self, tick: &Tick) -> Wish {
        (self.0)(tick)
    }
}

#[test]
fn hand_guiding_and_its_recorder_touch_no_heap() {
    let mut recorder = Recorder::new(probe_arm(), 10_000);
    let mut guide = HandGuide::new(probe_arm(), &home(), GiveWay::default()).unwrap();
    let mut watch = |tick: &Tick| probepath_robot::Observer::tick(&mut recorder, tick);
    run_without_heap(&mut Ideal::at(home(), 1000), &mut guide, &mut watch);
    assert!(recorder.recording().samples().len() > 1000);
}

/// A flat path of 60 mm along y, a millimetre deep in the skin.
fn path() -> Path {
    let points = (0..121).map(|i| {
        let origin = Vector3::new(0.49, 0.05 + 0.0005 * f64::from(i), SKIN.0 - 0.001);
        // FRAMES: a made-up probe in the base, its face down.
        let base_from_probe =
            Pose::assume(Isometry3::new(origin, Vector3::new(std::f64::consts::PI, 0.0, 0.0)));
        PathPoint { base_from_probe, moved: None }
    });
    let label = Label { study: "S-009".into(), side: Side::Left, date: "2026-11-22".into() };
    Path::new(label, 0.0005, points.collect(), None).unwrap()
}

#[test]
fn a_whole_replay_with_a_pause_and_the_lift_off_touch_no_heap() {
    let plan = Plan::new(&path(), &probe_arm(), &home(), &PlanSettings::default()).unwrap();
    let operator = Operator::new();
    let mut replay = Replay::new(plan, ReplaySettings::default(), operator.clone()).unwrap();
    let status = replay.watch();
    let mut arm = Ideal::at(home(), 0);
    let mut paused = 0_u32;
    let mut watch = |_: &Tick| {
        let along = status.status().at_m;
        if along > 0.02 && paused < 500 {
            paused += 1;
            operator.pause();
        } else {
            operator.resume();
        }
        Wish::GoOn
    };
    run_without_heap(&mut arm, &mut replay, &mut watch);
    assert_eq!(replay.status().ending, Some(ReplayEnding::Completed));
    assert_eq!(paused, 500);
    let mut lift = LiftOff::new(probe_arm(), 0.04, 0.02).unwrap();
    run_without_heap(&mut arm, &mut lift, &mut |_| Wish::GoOn);
}
