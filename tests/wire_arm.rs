//! The UR driver against the simulated controller, over loopback: the arm's physics, our script emulated, and what fails.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test may stop at the first surprise, its helpers too; a host that falls silent does so in wall time"
)]

use std::net::{IpAddr, Ipv4Addr};
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use nalgebra::Vector3;
use probepath_frames::Span;
use probepath_robot::drivers::ur::{UrArm, UrError, UrSettings};
use probepath_robot::{
    Arm, ArmFault, Command, Ending, Guard, GuardLimits, Joints, MotionLimits, PointToPoint, Safety, State,
    run,
};
use probepath_sim::controller::{
    ControllerConfig, ControllerServer, Helper, Running, Time, Version, WireKnobs,
};
use probepath_sim::{CellConfig, SimulatedCell, Ticks};

/// An address of our own, so that tests run side by side.
fn host() -> IpAddr {
    static NEXT: AtomicU8 = AtomicU8::new(0);
    let pid = std::process::id();
    let part = |n: u32| u8::try_from(n % 250 + 1).unwrap();
    IpAddr::V4(Ipv4Addr::new(127, 100 + NEXT.fetch_add(1, Ordering::SeqCst), part(pid / 250), part(pid)))
}

fn settings(cell: &SimulatedCell, time: Time) -> UrSettings {
    let (nominal, tool) = (cell.nominal(), cell.config().arm.tool);
    let centre_m = Vector3::from(tool.centre_of_gravity_mm) * 1e-3;
    let usual = UrSettings::new(nominal.model().clone(), nominal.flange_from_probe, tool.mass_kg, centre_m);
    // In wall time the tests share two cores with everything else.
    UrSettings { stepped: time == Time::Simulated, silence: Span::from_milliseconds(1500), ..usual }
}

fn served(time: Time, change: impl FnOnce(&mut ControllerConfig)) -> (Running, UrSettings) {
    let cell = SimulatedCell::new(&CellConfig::default(), 7).unwrap();
    let settings = settings(&cell, time);
    let mut config =
        ControllerConfig { host: host(), time, hand: Helper::Absent, ..ControllerConfig::default() };
    change(&mut config);
    (ControllerServer::start(cell, config).unwrap(), settings)
}

fn connected(knobs: WireKnobs) -> (Running, UrArm) {
    let (running, settings) = served(Time::Simulated, |config| config.knobs = knobs);
    let arm = UrArm::connect(&running.host().to_string(), settings).unwrap();
    (running, arm)
}

fn limits(running: &Running) -> MotionLimits {
    let acceleration = Joints::splat(6, 2.0);
    MotionLimits::of_model(running.cell().nominal().model(), acceleration, Joints::splat(6, 20.0)).unwrap()
}

/// Goes somewhere near through the one loop, with the guard.
fn goes(running: &Running, arm: &mut UrArm, by: f64) -> State {
    let limits = limits(running);
    let here = arm.exchange(&Command::Stay).unwrap().commanded;
    let there = here.map(|q| q + by);
    let mut motion = PointToPoint::plan(&here, &there, &limits, arm.period()).unwrap();
    let mut guard =
        Guard::new(GuardLimits { free_speed_m_s: 2.0, ..GuardLimits::default() }, limits).unwrap();
    let finished = run(arm, &mut motion, &mut guard, &mut ()).unwrap();
    assert_eq!(finished.ending, Ending::Done);
    assert!((finished.last.position.zip(&there, |q, w| q - w)).largest() < 2e-3, "{:?}", finished.last);
    finished.last
}

/// Slowly turns all joints until the arm fails.
fn until_fault(arm: &mut UrArm, most: u32) -> (ArmFault, State) {
    let mut last = arm.exchange(&Command::Stay).unwrap();
    let here = last.commanded;
    for n in 1..most {
        match arm.exchange(&Command::Position(here.map(|q| q + 5e-5 * f64::from(n)))) {
            Ok(state) => last = state,
            Err(fault) => return (fault, last),
        }
    }
    panic!("no fault in {most} ticks");
}

#[test]
fn the_loop_moves_the_arm_over_the_wire_and_the_truth_agrees() {
    let (running, mut arm) = connected(WireKnobs::default());
    let report = *arm.report();
    assert!(report.model_off_m < 0.003 && report.model_off_rad < 0.01, "{report:?}");
    let last = goes(&running, &mut arm, 0.2);
    assert_eq!((last.safety, last.age), (Safety::Normal, Span::ZERO));
    let truth = running.cell().truth().now().joints;
    assert!(truth.zip(&last.position, |t, q| t - q).largest() < 1e-3, "{truth:?} {last:?}");
    assert_eq!((arm.counts().gaps, arm.counts().late, running.counters().scripts), (0, 0, 1));
}

#[test]
fn the_same_commands_give_the_same_states_in_simulated_time() {
    let states = || {
        let (running, mut arm) = connected(WireKnobs::default());
        let here = arm.exchange(&Command::Stay).unwrap().commanded;
        let all: Vec<State> = (1..=500)
            .map(|n| arm.exchange(&Command::Position(here.map(|q| q + 1e-4 * f64::from(n)))).unwrap())
            .collect();
        drop((running, arm));
        all
    };
    assert_eq!(states(), states());
}

#[test]
fn a_protective_stop_is_seen_at_its_tick_and_recovered_on_a_word() {
    let knobs = WireKnobs { protective_stop_at_tick: Some(300), ..WireKnobs::default() };
    let (running, mut arm) = connected(knobs);
    let (first, ticks) = (arm.exchange(&Command::Stay).unwrap(), running.counters().ticks);
    let (fault, last) = until_fault(&mut arm, 1000);
    assert!(matches!(fault, ArmFault::ProtectiveStop { .. }), "{fault}");
    let told = fault.to_string();
    assert!(
        told.contains("the controller says: C0A0: PROTECTIVE_STOP"),
        "its primary interface's words: {told}"
    );
    assert_eq!(ticks + last.tick - first.tick, 299, "well until the tick before, and seen at its own");
    let scripts = running.counters().scripts;
    let recovered = arm.recover().unwrap();
    assert_eq!(running.counters().scripts, scripts + 1);
    // It braked from 0.025 rad/s, and nothing was resumed.
    assert!(recovered.commanded.zip(&last.commanded, |a, b| a - b).largest() < 0.01);
    goes(&running, &mut arm, 0.05);
}

#[test]
fn the_other_stops_are_seen_and_wait_for_a_person() {
    let during = Some(Ticks { from_tick: 200, count: 400 });
    let (_running, mut arm) = connected(WireKnobs { emergency_stop: during, ..WireKnobs::default() });
    let (fault, _) = until_fault(&mut arm, 1000);
    assert!(matches!(fault, ArmFault::EmergencyStop { .. }), "{fault}");
    assert!(matches!(arm.recover(), Err(UrError::NotReady { .. })), "the arm has no power");

    let (running, mut arm) = connected(WireKnobs { safeguard_stop: during, ..WireKnobs::default() });
    let (fault, _) = until_fault(&mut arm, 1000);
    assert!(matches!(fault, ArmFault::SafeguardStop { .. }), "{fault}");
    running.set_knobs(WireKnobs::default());
    // The knob is turned at the controller's next tick; a person tries again.
    let recovered = (0..50).find_map(|_| arm.recover().ok());
    assert!(recovered.is_some(), "{:?}", arm.recover());
    goes(&running, &mut arm, 0.05);
}

#[test]
fn reduced_mode_shows_and_the_arm_goes_on() {
    let reduced = Some(Ticks { from_tick: 100, count: 50 });
    let (_running, mut arm) = connected(WireKnobs { reduced, ..WireKnobs::default() });
    let seen: Vec<Safety> = (0..300).map(|_| arm.exchange(&Command::Stay).unwrap().safety).collect();
    assert_eq!(seen.iter().filter(|safety| **safety == Safety::Reduced).count(), 50);
}

#[test]
fn a_link_cut_in_the_middle_of_a_package_is_lost_and_the_arm_rests_by_itself() {
    let (running, mut arm) = connected(WireKnobs { cut_at_tick: Some(400), ..WireKnobs::default() });
    let (fault, last) = until_fault(&mut arm, 1000);
    assert!(matches!(fault, ArmFault::ConnectionLost { .. }), "{fault}");
    // Our script stops by its watchdog, 20 ticks after the last word; the cell's time goes on by itself meanwhile.
    let rested = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        running.is_at_rest()
    });
    assert!(rested);
    let truth = running.cell().truth().moments();
    let mut moves =
        truth.windows(2).filter(|pair| pair[1].joints.zip(&pair[0].joints, |b, a| b - a).largest() > 2e-6);
    let stopped = moves.next_back().map(|pair| pair[1].stamp).unwrap();
    let after = stopped - last.stamp;
    assert!(after <= Span::from_milliseconds(100), "it moved for {after:?} after the last state");
    arm.recover().unwrap();
    goes(&running, &mut arm, 0.05);
}

#[test]
fn skipped_packages_are_gaps_and_a_stalled_stream_is_a_lost_connection() {
    let (running, settings) = served(Time::Wall, |_| {});
    let mut arm = UrArm::connect(&running.host().to_string(), settings).unwrap();
    arm.exchange(&Command::Stay).unwrap();
    let from = running.counters().ticks + 20;
    let skipped = Some(Ticks { from_tick: from, count: 5 });
    running.set_knobs(WireKnobs { skipped, ..WireKnobs::default() });
    let gaps = (0..2000).any(|_| {
        arm.exchange(&Command::Stay).unwrap();
        arm.counts().gaps >= 5
    });
    assert!(gaps, "{:?}", arm.counts());
    let stalled = Some(Ticks { from_tick: 0, count: u64::MAX });
    running.set_knobs(WireKnobs { stalled, ..WireKnobs::default() });
    let fault = (0..200).find_map(|_| arm.exchange(&Command::Stay).err()).unwrap();
    assert!(fault.to_string().contains("said nothing for"), "{fault}");
}

#[test]
fn what_is_not_as_it_has_to_be_is_refused_in_words() {
    let says = |change: fn(&mut ControllerConfig), words: &str| {
        let (running, settings) = served(Time::Simulated, change);
        let error = UrArm::connect(&running.host().to_string(), settings).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    says(|config| config.knobs.taken = vec!["*".into()], "another client hold input_int_register_24");
    says(|config| config.version = Version { major: 3, minor: 15, bugfix: 8, build: 1 }, "CB3");
    says(|config| config.version = Version { major: 5, minor: 9, bugfix: 0, build: 1 }, "5.10");
    says(|config| config.knobs.refuses_protocol = true, "version 2");
    says(|config| config.powered = false, "switch it on");
}

#[test]
fn data_that_race_the_start_are_taken() {
    let (running, mut arm) = connected(WireKnobs { data_races_start: true, ..WireKnobs::default() });
    goes(&running, &mut arm, 0.02);
}

#[test]
fn a_second_host_is_refused_while_the_first_holds_the_inputs() {
    let (running, mut arm) = connected(WireKnobs::default());
    let second = UrArm::connect(&running.host().to_string(), settings(running.cell(), Time::Simulated));
    let words = second.unwrap_err().to_string();
    assert!(words.contains("another client"), "{words}");
    assert!(arm.exchange(&Command::Stay).is_ok(), "the first goes on");
}

#[test]
fn hung_threads_of_the_script_end_at_rest_and_are_said() {
    let during = Some(Ticks { from_tick: 300, count: 10_000 });
    for knobs in [
        WireKnobs { mover_hangs: during, ..WireKnobs::default() },
        WireKnobs { reader_hangs: during, ..WireKnobs::default() },
    ] {
        let (running, mut arm) = connected(knobs.clone());
        let (fault, last) = until_fault(&mut arm, 1000);
        assert!(matches!(fault, ArmFault::WatchdogStop { .. }), "{fault}");
        let since = last.stamp - running.cell().truth().moments()[0].stamp;
        assert!(since < Span::from_milliseconds(900), "{since:?}: {fault}");
        running.set_knobs(WireKnobs::default());
        arm.recover().unwrap();
        goes(&running, &mut arm, 0.02);
    }
}

#[test]
fn a_host_that_falls_silent_in_motion_leaves_the_arm_at_rest_and_the_next_exchange_says_so() {
    let (running, settings) = served(Time::Wall, |_| {});
    let mut arm = UrArm::connect(&running.host().to_string(), settings).unwrap();
    let here = arm.exchange(&Command::Stay).unwrap().commanded;
    let mut last = None;
    for n in 1..=200 {
        match arm.exchange(&Command::Position(here.map(|q| q + 1e-4 * f64::from(n)))) {
            Ok(state) => last = Some(state),
            // A machine at full load may have been silent for 40 ms before: then the watchdog has shown itself already.
            Err(fault) => {
                assert!(matches!(fault, ArmFault::WatchdogStop { .. }), "{fault}");
                break;
            }
        }
    }
    let last = last.unwrap();
    std::thread::sleep(Duration::from_millis(600));
    assert!(running.is_at_rest());
    let moments = running.cell().truth().moments();
    let mut moved =
        moments.windows(2).filter(|pair| pair[1].joints.zip(&pair[0].joints, |b, a| b - a).largest() > 2e-6);
    let after = moved.next_back().map(|pair| pair[1].stamp).unwrap() - last.stamp;
    assert!(after <= Span::from_milliseconds(100), "it moved for {after:?} after our last word");
    let fault = (0..3).find_map(|_| arm.exchange(&Command::Stay).err()).unwrap();
    assert!(matches!(fault, ArmFault::WatchdogStop { .. }), "{fault}");
    arm.recover().unwrap();
    arm.exchange(&Command::Stay).unwrap();
}

#[test]
fn a_host_that_thinks_at_rest_goes_on_after() {
    let (running, settings) = served(Time::Wall, |_| {});
    let mut arm = UrArm::connect(&running.host().to_string(), settings).unwrap();
    let before = arm.exchange(&Command::Stay).unwrap();
    std::thread::sleep(Duration::from_millis(700));
    let after = arm.exchange(&Command::Stay).unwrap();
    assert!(after.stamp - before.stamp > Span::from_milliseconds(300), "fresh, not what waited: {after:?}");
    assert!(after.age < Span::from_milliseconds(500), "{:?}", after.age);
    assert!(arm.counts().late > 100, "{:?}", arm.counts());
    assert_eq!(arm.counts().gaps, 0);
}

#[test]
fn the_hand_pushes_with_the_sign_and_along_the_axes_of_the_probe() {
    let (running, settings) = served(Time::Simulated, |config| config.hand = Helper::Guides);
    let mut arm = UrArm::connect(&running.host().to_string(), settings).unwrap();
    arm.exchange(&Command::Stay).unwrap();
    arm.zero_sensor().unwrap();
    let (mut with, mut across, mut guided, mut moved) = (0.0, 0.0, 0, 0.0_f64);
    let start = arm.exchange(&Command::Stay).unwrap().position;
    for _ in 0..3000 {
        let state = arm.exchange(&Command::Freedrive).unwrap();
        assert_eq!(state.commanded, state.position);
        let truth = running.cell().truth().now();
        guided += u32::from(state.guiding);
        moved = moved.max(state.position.zip(&start, |q, from| q - from).largest());
        let pushed = truth.hand.force + truth.skin.force;
        if pushed.norm() > 2.0 {
            let (felt, along) = (state.wrench.force, pushed.normalize());
            with += felt.dot(&along) / pushed.norm();
            across += (felt - along * felt.dot(&along)).norm() / pushed.norm();
        }
    }
    let pushes = with + across;
    assert!(guided > 500 && moved > 0.02, "guided for {guided} ticks, moved by {moved} rad");
    assert!(pushes > 100.0 && with / pushes > 0.85, "{with} along the push, {across} across");
    let rested = (0..400).map(|_| arm.exchange(&Command::Stay).unwrap()).last().unwrap();
    assert!(rested.velocity.largest() < 0.01, "it stays where the hand left it");
    goes(&running, &mut arm, 0.02);
}
