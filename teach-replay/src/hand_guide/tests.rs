//! A hand on the small plant.

use nalgebra::Vector3;
use probepath_frames::{Direction, Point, Span, Wrench};
use probepath_robot::{
    Arm, ArmFault, Command, Controller, Ending, Guard, GuardLimits, Joints, Plane, State, Tick, Wish, run,
};

use super::*;
use crate::replay::plant::{DT, Plant, Skin, arm, home};
use crate::{Cleaning, Label, Path, Recorder, Side};

/// What the hand does at a time, where the probe is: its force (N) in the base's axes, its torque about the probe's
/// axes (N m), and the switch.
type Push = Box<dyn Fn(f64, Vector3<f64>) -> (Vector3<f64>, Vector3<f64>, bool)>;

/// The plant with a hand on its probe.
struct Held {
    plant: Plant,
    push: Push,
}

impl Arm for Held {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let mut state = self.plant.exchange(command)?;
        let probe = arm().probe(&state.position);
        let (force, torque, guiding) = (self.push)(state.tick as f64 * DT, probe.origin().vector());
        let force = probe.isometry().rotation.inverse() * force;
        state.wrench = state.wrench + Wrench::new(force, torque);
        state.guiding = guiding;
        Ok(state)
    }

    fn period(&self) -> Span {
        self.plant.period()
    }

    fn joints(&self) -> usize {
        6
    }
}

const NOWHERE: Skin = Skin { stiffness: 300.0, bump: 0.0, wave: 1.0, until: -9.0 };

fn guided(skin: Skin, start: Joints, push: Push) -> (Vec<Joints>, Ending) {
    let mut plant = Plant::new(skin, start, 1);
    plant.drift_n = 0.1;
    let mut held = Held { plant, push };
    let mut guide = HandGuide::new(arm(), &start, GiveWay::default()).unwrap();
    let mut guard = Guard::new(GuardLimits::hand_guiding(), arm().limits).unwrap();
    let mut commanded = vec![start; 3];
    let mut observer = |tick: &Tick| {
        assert!(tick.changed < 1e-9, "the limits had to correct {}", tick.changed);
        commanded.push(tick.state.commanded);
        Wish::GoOn
    };
    let finished = run(&mut held, &mut guide, &mut guard, &mut observer).unwrap();
    (commanded, finished.ending)
}

fn keeps_limits(commanded: &[Joints]) {
    let limits = arm().limits;
    let mut rows = commanded.to_vec();
    for (name, limit) in [("v", limits.velocity), ("a", limits.acceleration), ("j", limits.jerk)] {
        rows = rows.windows(2).map(|p| p[1].zip(&p[0], |b, a| (b - a) / DT)).collect();
        let most = rows.iter().fold(0.0_f64, |most, row| most.max(row.zip(&limit, |x, l| x / l).largest()));
        assert!(most <= 1.0, "{name}: {most}");
    }
}

fn speeds(commanded: &[Joints]) -> Vec<f64> {
    let places: Vec<_> = commanded.iter().map(|q| arm().probe(q).origin()).collect();
    places.windows(2).map(|p| p[0].distance(&p[1]) / DT).collect()
}

#[test]
fn a_steady_push_moves_the_probe_that_way_and_letting_go_stops_it() {
    let push: Push = Box::new(|t, _| (Vector3::new(0.0, 3.3, 0.0), Vector3::zeros(), t < 2.0));
    let (commanded, ending) = guided(NOWHERE, home(), push);
    assert_eq!(ending, Ending::Done);
    let way = arm().probe(&commanded[commanded.len() - 1]).origin().vector()
        - arm().probe(&home()).origin().vector();
    // 3 N beyond the dead band on 60 N s/m for two seconds.
    assert!((way.y - 0.1).abs() < 0.01 && way.x.abs() < 0.002 && way.z.abs() < 0.002, "{way}");
    assert!(commanded.len() < 1250, "it took {} ticks to stop", commanded.len());
    keeps_limits(&commanded);
}

#[test]
fn a_violent_hand_is_followed_no_faster_than_allowed() {
    let push: Push = Box::new(|t, _| {
        let way = if (t * 3.0).fract() < 0.5 { 1.0 } else { -1.0 };
        let turn = Vector3::new(2.0 * way, 1.5, -way);
        (Vector3::new(30.0 * way, 12.0, 20.0 * (9.0 * t).sin()), turn, t < 3.0)
    });
    let (commanded, _) = guided(NOWHERE, home(), push);
    let most = speeds(&commanded).into_iter().fold(0.0, f64::max);
    assert!(most < 0.12, "{most}");
    keeps_limits(&commanded);
}

#[test]
fn pulled_to_the_end_of_its_reach_it_slows_down_and_comes_back() {
    let push: Push = Box::new(|t, _| {
        let out = if t < 7.0 { 15.0 } else { -15.0 };
        (Vector3::new(out, 0.0, 0.0), Vector3::zeros(), t < 10.0)
    });
    let (commanded, ending) = guided(NOWHERE, home(), push);
    assert_eq!(ending, Ending::Done);
    keeps_limits(&commanded);
    let nearest = commanded.iter().map(|q| arm().distance_to_singularity(q)).fold(f64::INFINITY, f64::min);
    assert!(nearest > 0.01 && nearest < 0.06, "{nearest}");
    let back = arm().probe(&commanded[commanded.len() - 1]).origin().vector().x;
    let furthest = commanded.iter().map(|q| arm().probe(q).origin().vector().x).fold(0.0, f64::max);
    assert!(back < furthest - 0.1, "{back} {furthest}");
}

#[test]
fn pushed_against_a_plane_of_the_workspace_it_slides_along_it_and_the_plane_is_named() {
    let start = home();
    let from = arm().probe(&start).origin().vector();
    let table = Plane { through: Point::new(from.x, from.y, from.z - 0.02), inward: Direction::z() };
    let guide = HandGuide::new(arm(), &start, GiveWay::default()).unwrap();
    let mut guide = guide.within(Workspace::new().and(table)).unwrap();
    let push: Push = Box::new(|t, _| (Vector3::new(0.0, 3.3, -15.0), Vector3::zeros(), t < 3.0));
    let mut held = Held { plant: Plant::new(NOWHERE, start, 1), push };
    let mut state = held.exchange(&Command::Stay).unwrap();
    let (mut commanded, mut names) = (vec![start; 3], Vec::new());
    while let Some(Command::Position(joints)) = guide.step(&state) {
        commanded.push(joints);
        names.extend(guide.held_by());
        assert!(arm().probe(&joints).origin().vector().z >= from.z - 0.02, "beyond the plane");
        state = held.exchange(&Command::Position(joints)).unwrap();
    }
    keeps_limits(&commanded);
    let way = arm().probe(&commanded[commanded.len() - 1]).origin().vector() - from;
    assert!(way.z < -0.018 && way.y > 0.08 && way.x.abs() < 0.005, "{way}");
    assert!(names.contains(&Binding::Plane { number: 0 }), "{names:?}");
}

#[test]
fn nobody_at_the_switch_moves_nothing_and_it_ends() {
    let start = home();
    let mut guide = HandGuide::new(arm(), &start, GiveWay { wait_s: 0.5, ..GiveWay::default() }).unwrap();
    let push: Push = Box::new(|_, _| (Vector3::new(50.0, 0.0, 0.0), Vector3::zeros(), false));
    let mut held = Held { plant: Plant::new(NOWHERE, start, 1), push };
    let mut guard = Guard::new(GuardLimits::hand_guiding(), arm().limits).unwrap();
    let finished = run(&mut held, &mut guide, &mut guard, &mut ()).unwrap();
    assert!(finished.ticks < 300 && finished.last.commanded == start);
}

/// A hand that is a spring toward a place: down onto the skin, along it, and up.
fn teaching_hand() -> Push {
    Box::new(|t, place| {
        let y = 0.1333 + 0.015 * (t - 8.0).clamp(0.0, 8.0);
        let press = 0.010;
        let skin = Skin::taught(y) - press;
        let up = match t {
            t if t < 6.0 => (0.1 - 0.04 * t).max(0.0) + press,
            t if t < 7.0 => press * (7.0 - t),
            t if t < 17.0 => 0.0,
            t => 0.03 * (t - 17.0),
        };
        let tremor = Vector3::new((50.0 * t).sin(), (43.0 * t).cos(), (61.0 * t).sin()) * 0.0002;
        let wanted = Vector3::new(0.492, y, skin + up) + tremor;
        ((wanted - place) * 400.0, Vector3::zeros(), t < 19.5)
    })
}

#[test]
fn what_a_hand_teaches_on_the_skin_becomes_a_path_along_it() {
    let skin = Skin { stiffness: 1000.0, bump: 0.0, wave: 1.0, until: 1.0 };
    let mut over = *arm().probe(&home()).isometry();
    over.translation.vector = Vector3::new(0.492, 0.1333, 0.23);
    // FRAMES: the probe over the skin, its face down.
    let over = probepath_frames::Pose::assume(over);
    let arm_here = arm();
    let start = arm_here
        .model
        .inverse(&over, &arm_here.flange_from_probe, &home(), &probepath_robot::InverseOptions::default())
        .unwrap();
    let mut held = Held { plant: Plant::new(skin, start, 2), push: teaching_hand() };
    held.plant.drift_n = 0.1;
    let mut guide = HandGuide::new(arm(), &start, GiveWay::default()).unwrap();
    let mut guard = Guard::new(GuardLimits::hand_guiding(), arm().limits).unwrap();
    let mut recorder = Recorder::new(arm(), 20_000);
    run(&mut held, &mut guide, &mut guard, &mut recorder).unwrap();
    let label = Label { study: "S-004".into(), side: Side::Left, date: "2026-11-22".into() };
    let (path, report) = Path::clean(recorder.recording().samples(), label, &Cleaning::default()).unwrap();
    assert!((0.10..0.13).contains(&path.length()), "{} {report:?}", path.length());
    for point in path.points() {
        let place = point.base_from_probe.origin().vector();
        let depth = Skin::taught(place.y) - place.z;
        assert!((0.0..0.006).contains(&depth), "{depth} deep at {}", place.y);
    }
    assert!(report.moved_rms < 0.3e-3, "{report:?}");
}

#[test]
fn a_full_recorder_asks_the_loop_to_stop() {
    let push: Push = Box::new(|_, _| (Vector3::zeros(), Vector3::zeros(), true));
    let mut held = Held { plant: Plant::new(NOWHERE, home(), 1), push };
    let mut guide = HandGuide::new(arm(), &home(), GiveWay::default()).unwrap();
    let mut guard = Guard::new(GuardLimits::hand_guiding(), arm().limits).unwrap();
    let mut recorder = Recorder::new(arm(), 100);
    let finished = run(&mut held, &mut guide, &mut guard, &mut recorder).unwrap();
    assert!(matches!(finished.ending, Ending::Observer(why) if why.contains("full")));
    assert_eq!(recorder.recording().samples().len(), 100);
}

#[test]
fn settings_and_starts_that_cannot_be_are_refused() {
    let bad = GiveWay { damping_n_s_m: [60.0, 0.0, 60.0], ..GiveWay::default() };
    assert!(matches!(
        HandGuide::new(arm(), &home(), bad),
        Err(GuideError::Setting { name: "damping_n_s_m", .. })
    ));
    let start = Joints::splat(6, f64::NAN);
    assert!(matches!(HandGuide::new(arm(), &start, GiveWay::default()), Err(GuideError::Start { .. })));
}

#[test]
fn a_wrench_that_is_no_number_counts_as_none() {
    let mut guide = HandGuide::new(arm(), &home(), GiveWay::default()).unwrap();
    let mut held = Held {
        plant: Plant::new(NOWHERE, home(), 1),
        push: Box::new(|_, _| (Vector3::new(f64::NAN, 0.0, 0.0), Vector3::zeros(), true)),
    };
    let mut state = held.exchange(&Command::Stay).unwrap();
    for _ in 0..100 {
        let Some(Command::Position(joints)) = guide.step(&state) else { panic!("it ended") };
        assert!(joints == home());
        state = held.exchange(&Command::Position(joints)).unwrap();
    }
}
