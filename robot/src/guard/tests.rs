//! The guard through the one loop, on an arm of two joints whose probe is a metre away from the first joint's axis.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Direction, Pose, Probe, Span, Wrench, nalgebra};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;
use crate::run::test_arm::{Fails, PERIOD, TestArm, check, limits, there};
use crate::{
    Arm, Command, Controller, Ending, Hold, Plane, PointToPoint, RunError, Safety, StopReason, Tick, Wish,
    run,
};
use probepath_frames::Point;

/// A metre from the first joint's axis, turned about its own y by the second joint: upright at zero.
fn place() -> ProbePlace {
    Box::new(|q: &Joints| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), q[1]);
        // FRAMES: where the arm of these tests holds the probe.
        Pose::assume(Isometry3::from_parts(Translation3::new(q[0].cos(), q[0].sin(), 0.0), turn))
    })
}

fn fast() -> GuardLimits {
    GuardLimits { free_speed_m_s: 2.0, skin_speed_m_s: 2.0, ..GuardLimits::default() }
}

fn guard() -> Guard {
    Guard::new(fast(), limits()).unwrap().within(Workspace::new(), place())
}

fn stopped_by(fails: Fails, mut guard: Guard) -> (Trip, TestArm, Box<RunError>) {
    let mut arm = TestArm::new(fails);
    let error = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    assert!(matches!(guard.phase(), Phase::Stopped(_)));
    assert_eq!(arm.rows.last().unwrap().0, Command::Stay);
    if error.at_rest {
        check(&arm);
    }
    let StopReason::Guard(trip) = error.reason else { panic!("{error}") };
    (trip, arm, error)
}

fn wrench(force: [f64; 3], torque: [f64; 3]) -> Wrench<Probe> {
    Wrench::new(Vector3::from(force), Vector3::from(torque))
}

#[test]
fn a_probe_that_would_lean_over_too_far_is_stopped_while_the_brake_still_ends_upright() {
    let most_rad = 0.2;
    let upright = Direction::z();
    let guard = guard().leaning_at_most(Tilt { upright, most_rad });
    let (trip, arm, error) = stopped_by(Fails::default(), guard);
    assert!(matches!(trip, Trip::Tilt { .. }) && error.at_rest, "{trip}");
    let furthest = arm.rows.iter().map(|(_, state)| state.commanded[1].abs()).fold(0.0, f64::max);
    assert!(furthest <= most_rad && furthest > 0.95 * most_rad, "the brake ended at {furthest}");
}

#[test]
fn a_probe_found_leaning_over_may_come_back_but_lean_no_further() {
    let upright = Direction::z();
    for (to, comes_back) in [(0.5, true), (1.2, false)] {
        let mut guard = guard().leaning_at_most(Tilt { upright, most_rad: 0.6 });
        let (mut arm, from) = (TestArm::new(Fails::default()), Joints::from_slice(&[0.0, 0.9]).unwrap());
        (arm.state.commanded, arm.state.position) = (from, from);
        let to = Joints::from_slice(&[0.0, to]).unwrap();
        let mut motion = PointToPoint::plan(&from, &to, &limits(), PERIOD).unwrap();
        assert_eq!(run(&mut arm, &mut motion, &mut guard, &mut ()).is_ok(), comes_back);
    }
    assert!((Tilt::around(upright).most_rad.to_degrees() - 60.0).abs() < 1e-12);
}

#[test]
fn force_along_the_skin_and_pressure_on_an_edge_stop_the_arm_and_ask_to_lift() {
    let pressed = |wrench| {
        let fails = Fails { wrench: Some((300, wrench)), ..Fails::default() };
        let (trip, _, error) = stopped_by(fails, guard().pressing_with(Face::default()));
        assert!(error.reason.asks_to_lift() && error.at_rest);
        trip
    };
    let dragged = pressed(wrench([9.0, 0.0, -4.0], [0.0; 3]));
    assert!(matches!(dragged, Trip::Sideways { force_n, .. } if force_n > 8.0), "{dragged}");
    // 6 N near the end of the face's 40 mm.
    let edge = pressed(wrench([0.0, 0.0, -6.0], [0.0, 0.115, 0.0]));
    assert!(matches!(edge, Trip::Pressure { edge_n_cm2, .. } if edge_n_cm2 > 25.0), "{edge}");
    // The same force in the middle is a scan.
    let fails = Fails { wrench: Some((300, wrench([1.0, 0.0, -6.0], [0.0; 3]))), ..Fails::default() };
    let mut guard = guard().pressing_with(Face::default());
    run(&mut TestArm::new(fails), &mut there(), &mut guard, &mut ()).unwrap();
}

#[test]
fn a_sensor_that_hangs_stops_the_arm_and_an_arm_without_one_goes_on() {
    let fails =
        Fails { wrench: Some((0, wrench([0.0, 0.0, -3.0], [0.0; 3]))), hangs: Some(300), ..Fails::default() };
    let (trip, arm, error) = stopped_by(fails, guard());
    assert!(matches!(trip, Trip::FrozenSensor { seconds } if seconds > 0.1 && seconds < 0.104), "{trip}");
    assert!(error.at_rest && arm.state.tick < 700);
    run(&mut TestArm::new(Fails::default()), &mut there(), &mut guard(), &mut ()).unwrap();
}

#[test]
fn a_state_that_is_old_by_the_hosts_clock_stops_the_arm() {
    let fails = |ms| Fails { age: Some((300, Span::from_milliseconds(ms))), ..Fails::default() };
    let (trip, _, error) = stopped_by(fails(11), guard());
    assert!(matches!(trip, Trip::OldData { age_s } if (age_s - 0.011).abs() < 1e-9) && error.at_rest);
    run(&mut TestArm::new(fails(9)), &mut there(), &mut guard(), &mut ()).unwrap();
}

#[test]
fn an_arm_that_stopped_by_itself_is_told_to_stay_and_nothing_else() {
    for safety in Safety::ALL.into_iter().filter(|safety| !safety.lets_move()) {
        let (trip, arm, error) =
            stopped_by(Fails { safety: Some((300, safety)), ..Fails::default() }, guard());
        assert_eq!(trip, Trip::StoppedItself { safety });
        assert!(!error.at_rest, "nobody braked it");
        let after = arm.rows.iter().skip_while(|(_, state)| state.safety == Safety::Normal);
        assert_eq!(after.skip(1).map(|(command, _)| *command).collect::<Vec<_>>(), [Command::Stay]);
    }
}

#[test]
fn reduced_mode_leaves_half_a_second_to_slow_down_and_then_holds_to_its_speed() {
    let reduced = Fails { safety: Some((200, Safety::Reduced)), ..Fails::default() };
    let (trip, arm, _) = stopped_by(reduced, guard());
    assert!(matches!(trip, Trip::ProbeSpeed { limit_m_s, .. } if (limit_m_s - 0.02).abs() < 1e-9), "{trip}");
    let running = arm.rows.iter().filter(|(_, state)| state.safety == Safety::Reduced).count();
    assert!((245..400).contains(&running), "{running} ticks");
    let slow = Joints::splat(2, 0.01);
    let mut motion =
        PointToPoint::plan(&Joints::zeros(2), &slow, &MotionLimits { velocity: slow, ..limits() }, PERIOD)
            .unwrap();
    run(
        &mut TestArm::new(Fails { safety: Some((0, Safety::Reduced)), ..reduced }),
        &mut motion,
        &mut guard(),
        &mut (),
    )
    .unwrap();
}

#[test]
fn after_a_confirmation_the_probe_is_slow_at_first_and_fast_again_after_some_seconds_of_motion() {
    let turned = |seconds: f64, speed: f64| {
        let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
        guard.stop(Trip::Operator);
        guard.end(&arm.state);
        guard.confirm(&arm.exchange(&Command::Stay).unwrap()).unwrap();
        run(&mut arm, &mut Hold::ticks((seconds / PERIOD.seconds()) as u64), &mut guard, &mut ()).unwrap();
        let limits = MotionLimits { velocity: Joints::splat(2, speed), ..limits() };
        let to = Joints::from_slice(&[0.2 * speed, 0.0]).unwrap();
        let mut motion = PointToPoint::plan(&Joints::zeros(2), &to, &limits, PERIOD).unwrap();
        run(&mut arm, &mut motion, &mut guard, &mut ())
    };
    turned(0.0, 0.0099).unwrap();
    let error = turned(0.0, 0.02).unwrap_err();
    assert!(
        matches!(error.reason, StopReason::Guard(Trip::ProbeSpeed { limit_m_s, .. }) if limit_m_s < 0.013)
    );
    turned(1.0, 0.025).unwrap();
    turned(1.0, 0.06).unwrap_err();
    turned(5.0, 0.9).unwrap();
}

#[test]
fn a_confirmation_needs_a_state_that_is_new_and_at_rest() {
    let (mut arm, mut guard) = (TestArm::new(Fails { lost: Some(300), ..Fails::default() }), guard());
    run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    assert_eq!(guard.confirm(&arm.state), Err(Trip::NotFresh));
    assert_eq!(guard.confirm_to_lift(&arm.state), Err(Trip::NotFresh));
    arm.fails.lost = None;
    let moving = arm.exchange(&Command::Position(arm.state.commanded.map(|q| q + 1e-3))).unwrap();
    assert!(matches!(guard.confirm(&moving), Err(Trip::Moving { .. })));
    let at_rest = arm.exchange(&Command::Stay).unwrap();
    guard.confirm(&at_rest).unwrap();
}

#[test]
fn the_operators_stop_wants_a_fresh_confirmation_too() {
    let operator = Operator::new();
    let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard().listening_to(operator.clone()));
    operator.stop();
    let finished = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap();
    assert_eq!(finished.ending, Ending::Operator);
    operator.allow();
    let error = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    assert_eq!(error.reason, StopReason::Guard(Trip::NotConfirmed));
}

/// Gives way to the hand between two motions.
struct Handed {
    out: PointToPoint,
    ticks: u64,
    free: std::ops::Range<u64>,
    end: u64,
    /// Where it was after the hand let go.
    held: Option<Joints>,
}

impl Controller for Handed {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.ticks += 1;
        if self.free.contains(&self.ticks) {
            Some(Command::Freedrive)
        } else if self.ticks < self.free.start {
            self.out.step(state)
        } else if self.ticks < self.end {
            Some(Command::Position(*self.held.get_or_insert(state.commanded)))
        } else {
            None
        }
    }
}

fn handed(fails: Fails, mut guard: Guard) -> (TestArm, Result<crate::Finished, Box<RunError>>) {
    let mut arm = TestArm::new(fails);
    let mut handed = Handed { out: there(), ticks: 0, free: 200..500, end: 700, held: None };
    let done = run(&mut arm, &mut handed, &mut guard, &mut ());
    (arm, done)
}

#[test]
fn an_arm_gives_way_from_rest_only_and_goes_on_from_where_the_hand_left_it() {
    let (arm, done) = handed(Fails { hand: 0.1, ..Fails::default() }, guard());
    done.unwrap();
    let free = |row: &(Command, State)| row.0 == Command::Freedrive;
    let first = arm.rows.iter().position(free).unwrap();
    let before: Vec<Joints> = arm.rows[first - 3..first].iter().map(|(_, state)| state.commanded).collect();
    assert!(before[0] == before[1] && before[1] == before[2], "it braked first");
    let last = arm.rows.iter().rposition(free).unwrap();
    let left_at = arm.rows[last].1.commanded;
    assert!((left_at[0] - before[0][0]).abs() > 0.02, "the hand moved it");
    assert!(arm.rows[last + 1..].iter().all(|(_, state)| state.commanded == left_at));
    assert_eq!(arm.rows[last + 1].0, Command::Stay);
}

#[test]
fn while_the_arm_gives_way_the_guard_goes_on_watching() {
    let limits_of = GuardLimits { free_speed_m_s: 0.25, ..GuardLimits::default() };
    let slow_out = || Guard::new(GuardLimits { free_speed_m_s: 2.0, ..limits_of }, limits()).unwrap();
    let wall = Plane { through: Point::new(0.0, 0.10, 0.0), inward: Direction::y().reversed() };
    type Case = (Fails, Guard, fn(&Trip) -> bool);
    let cases: [Case; 4] = [
        (Fails { hand: 2.1, ..Fails::default() }, slow_out().within(Workspace::new(), place()), |trip| {
            matches!(trip, Trip::ProbeSpeed { .. } | Trip::JointVelocity { .. })
        }),
        (
            Fails { hand: 0.5, ..Fails::default() },
            slow_out().within(Workspace::new().and(wall), place()),
            |trip| matches!(trip, Trip::Workspace { plane: 0, .. }),
        ),
        (Fails { force: Some((400, 20.0)), ..Fails::default() }, guard(), |trip| {
            matches!(trip, Trip::Force { .. })
        }),
        (Fails { safety: Some((400, Safety::EmergencyStop)), ..Fails::default() }, guard(), |trip| {
            matches!(trip, Trip::StoppedItself { .. })
        }),
    ];
    for (fails, guard, expected) in cases {
        let mut arm = TestArm::new(fails);
        let (mut guard, out) = (guard, Joints::splat(2, 1e-3));
        let out = PointToPoint::plan(&Joints::zeros(2), &out, &limits(), PERIOD).unwrap();
        let mut handed = Handed { out, ticks: 0, free: 20..900, end: 900, held: None };
        let error = run(&mut arm, &mut handed, &mut guard, &mut ()).unwrap_err();
        let StopReason::Guard(trip) = error.reason else { panic!("{error}") };
        assert!(expected(&trip), "{trip}");
        assert_eq!(arm.rows.last().unwrap().0, Command::Stay);
        let (last, before) = (arm.rows[arm.rows.len() - 1].1, arm.rows[arm.rows.len() - 2].1);
        assert_eq!(last.commanded, before.commanded);
    }
}

#[test]
fn right_after_a_confirmation_a_hand_may_lead_at_its_own_pace_and_what_is_commanded_after_it_is_slow() {
    let confirmed = |arm: &mut TestArm| {
        let mut guard = guard().within(Workspace::new(), place());
        guard.stop(Trip::Operator);
        guard.end(&arm.state);
        guard.confirm(&arm.exchange(&Command::Stay).unwrap()).unwrap();
        guard
    };
    // Three seconds at 100 mm/s, then a motion at 20 mm/s.
    let mut arm = TestArm::new(Fails { hand: 0.1, ..Fails::default() });
    let mut guard = confirmed(&mut arm);
    let out = PointToPoint::plan(&Joints::zeros(2), &Joints::zeros(2), &limits(), PERIOD).unwrap();
    let mut handed = Handed { out, ticks: 0, free: 1..1500, end: 1500, held: None };
    run(&mut arm, &mut handed, &mut guard, &mut ()).unwrap();
    let led = arm.state.commanded;
    assert!(led[0] > 0.25, "the hand moved it to {} rad", led[0]);
    let slow = |guard: &mut Guard, arm: &mut TestArm, speed: f64| {
        let limits = MotionLimits { velocity: Joints::splat(2, speed), ..limits() };
        let to = led.zip(&Joints::from_slice(&[0.2 * speed, 0.0]).unwrap(), |at, by| at + by);
        let mut motion = PointToPoint::plan(&arm.state.commanded, &to, &limits, PERIOD).unwrap();
        run(arm, &mut motion, guard, &mut ())
    };
    let error = slow(&mut guard, &mut arm, 0.02).unwrap_err();
    assert!(matches!(error.reason, StopReason::Guard(Trip::ProbeSpeed { .. })), "{error}");
    // The usual limits hold for the hand too.
    let mut arm = TestArm::new(Fails { hand: 0.3, ..Fails::default() });
    let limits_of = GuardLimits { free_speed_m_s: 0.25, skin_speed_m_s: 0.25, ..GuardLimits::default() };
    let mut guard = confirmed(&mut arm);
    guard.set_limits(limits_of);
    let out = PointToPoint::plan(&Joints::zeros(2), &Joints::zeros(2), &limits(), PERIOD).unwrap();
    let mut handed = Handed { out, ticks: 0, free: 1..1500, end: 1500, held: None };
    let error = run(&mut arm, &mut handed, &mut guard, &mut ()).unwrap_err();
    assert!(matches!(error.reason, StopReason::Guard(Trip::ProbeSpeed { .. })), "{error}");
}

#[test]
fn an_operators_stop_while_the_arm_gives_way_ends_at_rest() {
    let operator = Operator::new();
    let (mut arm, mut guard) =
        (TestArm::new(Fails { hand: 0.1, ..Fails::default() }), guard().listening_to(operator.clone()));
    let mut handed = Handed { out: there(), ticks: 0, free: 20..900, end: 900, held: None };
    let mut watch = |tick: &Tick| {
        if tick.index == 400 {
            operator.stop();
        }
        Wish::GoOn
    };
    let finished = run(&mut arm, &mut handed, &mut guard, &mut watch).unwrap();
    assert_eq!(finished.ending, Ending::Operator);
    let rests = arm.rows[arm.rows.len() - 3..]
        .iter()
        .all(|(command, state)| *command == Command::Stay && state.commanded == finished.last.commanded);
    assert!(rests && finished.ticks < 420);
}

/// One fault of each kind, at any tick.
fn any_fault(rng: &mut ChaCha8Rng) -> Fails {
    let tick = 5 + u64::from(rng.next_u32() % 900);
    let at = Some(tick);
    let none = Fails::default();
    match rng.next_u32() % 12 {
        0 => Fails { lost: at, ..none },
        1 => Fails { late: at, ..none },
        2 => Fails { frozen: at, ..none },
        3 => Fails { wrench_nan: at, ..none },
        4 => Fails { force: Some((tick, 40.0)), ..none },
        5 => Fails { jump: at, ..none },
        6 => Fails { blocked: at, ..none },
        7 => Fails { safety: Some((tick, Safety::ProtectiveStop)), ..none },
        8 => Fails { age: Some((tick, Span::from_milliseconds(50))), ..none },
        9 => Fails { wrench: Some((tick, wrench([9.0, 0.0, -1.0], [0.0; 3]))), ..none },
        10 => Fails { wrench: Some((0, wrench([0.0, 0.0, -1.0], [0.0; 3]))), hangs: at, ..none },
        _ => Fails { safety: Some((tick, Safety::Reduced)), ..none },
    }
}

#[test]
fn whatever_fails_and_whenever_the_arm_ends_at_rest_within_its_limits_and_wants_a_confirmation() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for case in 0..2000 {
        let fails = any_fault(&mut rng);
        let mut guard = guard().pressing_with(Face::default());
        let mut arm = TestArm::new(fails);
        let Err(error) = run(&mut arm, &mut there(), &mut guard, &mut ()) else {
            // It came after the motion, or had no time to matter.
            assert!(matches!(guard.phase(), Phase::Armed(_)), "case {case}");
            continue;
        };
        if error.at_rest {
            check(&arm);
        }
        assert!(matches!(guard.phase(), Phase::Stopped(_)), "case {case}: {error}");
        assert!(error.at_rest || error.reason.is_of_the_arm(), "case {case}: {error}");
        let rows = &arm.rows[arm.rows.len() - 2..];
        assert!(
            error.reason.is_of_the_arm() || rows[0].1.commanded == rows[1].1.commanded,
            "case {case}: {error}"
        );
        let error = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
        let refused = matches!(error.reason, StopReason::Guard(Trip::NotConfirmed) | StopReason::Arm(_));
        assert!(refused, "case {case}: {error}");
    }
}
