//! The loop on an arm of two joints that does what it is told, one tick late, and fails when it is told to.

use probepath_frames::{Direction, Point, Pose, nalgebra::Translation3};

use super::test_arm::{Fails, PERIOD, TestArm, check, limits, there};
use super::*;
use crate::{Brake, GuardLimits, Hold, Joints, Operator, Phase, Plane, PointToPoint, RecordedArm, Workspace};

fn guard() -> Guard {
    Guard::new(GuardLimits::default(), limits()).unwrap()
}

fn stopped(fails: Fails) -> (TestArm, Guard, RunError) {
    let (mut arm, mut guard) = (TestArm::new(fails), guard());
    let error = *run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    check(&arm);
    (arm, guard, error)
}

fn trip(fails: Fails) -> Trip {
    let (arm, guard, error) = stopped(fails);
    assert!(error.at_rest);
    assert_eq!(arm.rows.last().unwrap().0, Command::Stay);
    let StopReason::Guard(trip) = error.reason else { panic!("{error}") };
    assert!(matches!(guard.phase(), Phase::Stopped(_)));
    let said = |tick: &Tick| matches!(tick.verdict, Verdict::Stop(_));
    assert!(error.black_box.ticks().any(said));
    trip
}

#[test]
fn a_motion_arrives_and_ends_in_peace() {
    let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
    let finished = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap();
    assert_eq!(finished.ending, Ending::Done);
    assert_eq!(finished.last.commanded, Joints::from_slice(&[1.0, -0.4]).unwrap());
    assert!(matches!(guard.phase(), Phase::Armed(_)));
    check(&arm);
}

#[test]
fn every_door_out_of_the_loop_stops_the_arm_within_its_limits() {
    assert!(matches!(trip(Fails { force: Some((300, 16.0)), ..Fails::default() }), Trip::Force { .. }));
    assert!(matches!(trip(Fails { late: Some(300), ..Fails::default() }), Trip::LateTick { missed: 9, .. }));
    assert!(matches!(trip(Fails { frozen: Some(300), ..Fails::default() }), Trip::OldData { .. }));
    assert!(matches!(
        trip(Fails { wrench_nan: Some(300), ..Fails::default() }),
        Trip::ImplausibleWrench { .. }
    ));
    assert!(matches!(trip(Fails { jump: Some(300), ..Fails::default() }), Trip::Jump { joint: 1, .. }));
    assert!(matches!(
        trip(Fails { blocked: Some(100), ..Fails::default() }),
        Trip::Following { joint: 0, .. }
    ));
}

#[test]
fn a_lost_arm_is_told_to_stay_and_needs_a_confirmation() {
    let (_, mut guard, error) = stopped(Fails { lost: Some(300), ..Fails::default() });
    assert!(matches!(error.reason, StopReason::Arm(ArmFault::ConnectionLost { tick: 300, .. })));
    assert!(!error.at_rest);
    assert_eq!(*guard.phase(), Phase::Stopped(Trip::Fault));
    let mut arm = TestArm::new(Fails::default());
    let error = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    assert_eq!(error.reason, StopReason::Guard(Trip::NotConfirmed));
    guard.confirm(&arm.exchange(&Command::Stay).unwrap()).unwrap();
    run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap();
}

#[test]
fn too_much_force_is_lifted_out_of_but_not_pressed_into() {
    let (arm, mut guard, error) = stopped(Fails { force: Some((300, 16.0)), ..Fails::default() });
    assert!(error.reason.asks_to_lift());
    assert!(matches!(guard.confirm(&arm.state), Err(Trip::Force { .. })));
    let mut arm = arm;
    guard.confirm_to_lift(&arm.exchange(&Command::Stay).unwrap()).unwrap();
    let lifted = |force| {
        let mut arm = TestArm::new(Fails { force: Some((0, force)), ..Fails::default() });
        let mut guard = Guard::new(GuardLimits::default(), limits()).unwrap();
        let fresh =
            TestArm::new(Fails { force: Some((0, 16.0)), ..Fails::default() }).exchange(&Command::Stay);
        guard.confirm_to_lift(&fresh.unwrap()).unwrap();
        run(&mut arm, &mut Hold::ticks(100), &mut guard, &mut ())
    };
    lifted(15.9).unwrap();
    lifted(17.5).unwrap_err();
}

#[test]
fn a_hand_may_pull_harder_than_skin_may_press_and_only_while_it_guides() {
    let mut guard = guard();
    let mut pulled = |limits| {
        guard.set_limits(limits);
        let mut arm = TestArm::new(Fails { force: Some((0, 30.0)), ..Fails::default() });
        run(&mut arm, &mut Hold::ticks(100), &mut guard, &mut ())
    };
    pulled(GuardLimits::hand_guiding()).unwrap();
    pulled(GuardLimits::default()).unwrap_err();
}

#[test]
fn the_operator_and_the_observer_stop_in_peace_at_any_tick() {
    for at in (0..630).step_by(9) {
        let operator = Operator::new();
        let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard().listening_to(operator.clone()));
        let mut watch = |tick: &Tick| {
            if tick.index == at {
                operator.stop();
            }
            Wish::GoOn
        };
        let finished = run(&mut arm, &mut there(), &mut guard, &mut watch).unwrap();
        assert_eq!(finished.ending, Ending::Operator);
        assert!(operator.wish() == crate::Asked::Stop);
        check(&arm);
        let mut arm = TestArm::new(Fails::default());
        let mut ask = |tick: &Tick| if tick.index == at { Wish::Stop("seen".into()) } else { Wish::GoOn };
        let mut guard = Guard::new(GuardLimits::default(), limits()).unwrap();
        let finished = run(&mut arm, &mut there(), &mut guard, &mut ask).unwrap();
        assert_eq!(finished.ending, Ending::Observer("seen".into()));
        check(&arm);
    }
}

#[test]
fn a_hold_holds_for_its_ticks_and_a_brake_ends_at_rest() {
    let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
    arm.state.commanded = Joints::splat(2, 0.3);
    arm.state.position = arm.state.commanded;
    let finished = run(&mut arm, &mut Hold::ticks(100), &mut guard, &mut ()).unwrap();
    // Three ticks to see that the arm rests, one to stay at the end.
    assert_eq!(finished.ticks, 104);
    assert!(arm.rows.iter().all(|(_, state)| state.commanded == Joints::splat(2, 0.3)));
    let operator = guard.operator().clone();
    let mut stop = |tick: &Tick| {
        if tick.index == 50 {
            operator.stop();
        }
        Wish::GoOn
    };
    let finished = run(&mut arm, &mut Hold::until_stopped(), &mut guard, &mut stop).unwrap();
    assert_eq!(finished.ending, Ending::Operator);
    guard.operator().allow();
    let mut arm = TestArm::new(Fails::default());
    guard.confirm(&arm.exchange(&Command::Stay).unwrap()).unwrap();
    let mut brake = Brake::default();
    let finished = run(&mut arm, &mut Then(there(), 300, &mut brake), &mut guard, &mut ()).unwrap();
    assert_eq!(finished.ending, Ending::Done);
    assert!(finished.last.commanded[0] > 0.2 && finished.last.commanded[0] < 0.9);
    check(&arm);
}

/// One controller, and after some ticks another.
struct Then<'a>(PointToPoint, u64, &'a mut dyn Controller);

impl Controller for Then<'_> {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.1 = self.1.saturating_sub(1);
        if self.1 > 0 { self.0.step(state) } else { self.2.step(state) }
    }
}

/// A controller that misbehaves in the middle of a motion.
struct Bad<F>(PointToPoint, u64, F);

impl<F: FnMut() -> Option<Command>> Controller for Bad<F> {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.1 += 1;
        if self.1 > 300 { (self.2)() } else { self.0.step(state) }
    }
}

fn misbehaved(how: impl FnMut() -> Option<Command>) -> Box<RunError> {
    let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
    let error = run(&mut arm, &mut Bad(there(), 0, how), &mut guard, &mut ()).unwrap_err();
    assert!(error.at_rest);
    check(&arm);
    error
}

#[test]
fn a_controller_that_panics_jumps_or_says_nan_stops_the_arm() {
    let error = misbehaved(|| panic!("index out of bounds"));
    assert!(
        matches!(&error.reason, StopReason::Panicked { who: "controller", message } if message.contains("bounds"))
    );
    let error = misbehaved(|| Some(Command::Position(Joints::splat(2, 0.0))));
    assert!(matches!(error.reason, StopReason::Guard(Trip::Corrected { .. })));
    let error = misbehaved(|| Some(Command::Position(Joints::splat(2, f64::NAN))));
    assert!(matches!(error.reason, StopReason::Limits(LimitsError::NotFinite { joint: 0, .. })));
    let error = misbehaved(|| Some(Command::Position(Joints::splat(3, 0.0))));
    assert!(matches!(error.reason, StopReason::Limits(LimitsError::Joints { found: 3, joints: 2 })));
}

#[test]
fn a_controller_that_ends_or_stays_in_full_motion_is_braked() {
    for last in [None, Some(Command::Stay)] {
        let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
        let mut left = 500;
        let how = move || {
            left -= 1;
            if left == 0 { None } else { last }
        };
        let finished = run(&mut arm, &mut Bad(there(), 0, how), &mut guard, &mut ()).unwrap();
        assert_eq!(finished.ending, Ending::Done);
        check(&arm);
    }
}

#[test]
fn an_observer_that_panics_stops_the_arm_and_is_left_alone() {
    let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
    let mut told = 0;
    let mut watch = |_: &Tick| {
        told += 1;
        if told == 300 {
            panic!("disk full")
        }
        Wish::GoOn
    };
    let error = run(&mut arm, &mut there(), &mut guard, &mut watch).unwrap_err();
    assert!(matches!(error.reason, StopReason::Panicked { who: "observer", .. }));
    assert!(error.at_rest);
    assert_eq!(told, 300);
    check(&arm);
}

#[test]
fn the_workspace_and_the_probes_speed_are_kept_before_a_command_is_sent() {
    // The probe a metre from the first joint's axis: its angle is its y, nearly.
    // FRAMES: the arm of this test has the probe there, its axes those of the base.
    let place = || Box::new(|q: &Joints| Pose::assume(Translation3::new(q[0].cos(), q[0].sin(), 0.0).into()));
    let wall = Plane { through: Point::new(0.0, 0.01, 0.0), inward: Direction::y().reversed() };
    let (mut arm, fast) =
        (TestArm::new(Fails::default()), GuardLimits { free_speed_m_s: 2.0, ..GuardLimits::default() });
    let mut guard = Guard::new(fast, limits()).unwrap().within(Workspace::new().and(wall), place());
    let error = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    assert!(matches!(error.reason, StopReason::Guard(Trip::Workspace { plane: 0, .. })), "{error}");
    check(&arm);
    let furthest = arm.rows.iter().map(|(_, state)| state.commanded[0].sin()).fold(f64::MIN, f64::max);
    assert!(furthest <= 0.01 && furthest > 0.009, "the brake ended at {furthest}");
    let mut arm = TestArm::new(Fails::default());
    let mut guard = Guard::new(GuardLimits::default(), limits()).unwrap().within(Workspace::new(), place());
    let error = run(&mut arm, &mut there(), &mut guard, &mut ()).unwrap_err();
    assert!(matches!(error.reason, StopReason::Guard(Trip::ProbeSpeed { .. })), "{error}");
    check(&arm);
}

#[test]
fn the_observer_sees_every_exchange() {
    let (mut arm, mut guard) = (TestArm::new(Fails::default()), guard());
    let mut seen = Vec::new();
    let mut watch = |tick: &Tick| {
        seen.push((tick.command, tick.state));
        Wish::GoOn
    };
    let finished = run(&mut arm, &mut there(), &mut guard, &mut watch).unwrap();
    assert_eq!(finished.ticks, seen.len() as u64);
    assert!(seen == arm.rows);
}

#[test]
fn a_record_replays_to_itself_and_another_motion_diverges() {
    let mut arm = TestArm::new(Fails::default());
    run(&mut arm, &mut there(), &mut guard(), &mut ()).unwrap();
    let mut recorded = RecordedArm::new(arm.rows.iter().copied().map(crate::Row::from), PERIOD, 2);
    run(&mut recorded, &mut there(), &mut guard(), &mut ()).unwrap();
    assert!(matches!(recorded.exchange(&Command::Stay), Err(ArmFault::RecordingEnds { .. })));
    let elsewhere = Joints::from_slice(&[1.0, -0.4000001]).unwrap();
    let mut other = PointToPoint::plan(&Joints::zeros(2), &elsewhere, &limits(), PERIOD).unwrap();
    let mut recorded = RecordedArm::new(arm.rows.iter().copied().map(crate::Row::from), PERIOD, 2);
    let error = run(&mut recorded, &mut other, &mut guard(), &mut ()).unwrap_err();
    assert!(matches!(error.reason, StopReason::Arm(ArmFault::Diverged { joint: 1, .. })));
}

#[test]
fn the_black_box_keeps_the_last_ticks_in_order() {
    let (_, _, error) = stopped(Fails { force: Some((500, 16.0)), ..Fails::default() });
    let indices: Vec<u64> = error.black_box.ticks().map(|tick| tick.index).collect();
    assert!(indices.windows(2).all(|pair| pair[1] == pair[0] + 1));
    assert_eq!(error.black_box.last().map(|tick| tick.command), Some(Command::Stay));
    let mut small = BlackBox::new(7);
    error.black_box.ticks().for_each(|tick| small.push(tick));
    let kept: Vec<u64> = small.ticks().map(|tick| tick.index).collect();
    assert_eq!(kept, indices[indices.len() - 7..]);
}
