//! Stops, and the way out of each.

use super::*;
use crate::controller::core::Runtime;
use crate::controller::dashboard;
use crate::controller::robot::safety::{Power, Safety};
use crate::knobs::Ticks;

const SCRIPT: &[u8] = b"def rtde_control():\nend\n";

fn answer(rig: &mut Rig, line: &str) -> String {
    dashboard::answer(&mut rig.controller, line).unwrap()
}

/// With ur_rtde's script, and a speedJ under way.
fn moving(knobs: WireKnobs) -> Rig {
    let mut rig = Rig::with(knobs);
    assert!(rig.controller.upload(SCRIPT));
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        .iter()
        .enumerate()
        .for_each(|(i, x)| rig.controller.input.set_double(i, *x));
    rig.int(0, 9);
    rig.ticks(150);
    assert!(rig.controller.is_moving());
    rig
}

#[test]
fn a_protective_stop_ends_the_program_and_is_unlocked_after_its_time() {
    let mut rig = moving(WireKnobs { protective_stop_at_tick: Some(200), ..WireKnobs::default() });
    rig.until(100, |c| c.robot.safety == Safety::ProtectiveStop);
    assert_eq!(rig.controller.counters.ticks, 200, "at its tick");
    assert_eq!((rig.controller.robot.safety.bits(), rig.controller.robot.safety.mode()), (1028, 3));
    assert_eq!(rig.controller.runtime, Runtime::Stopped);
    assert!(rig.until(100, |c| !c.is_moving()) < 50);
    assert!(!rig.controller.upload(SCRIPT), "nothing starts in a protective stop");
    assert!(answer(&mut rig, "unlock protective stop").starts_with("Cannot unlock"));
    rig.ticks(2500);
    assert_eq!(answer(&mut rig, "unlock protective stop"), "Protective stop releasing");
    assert_eq!(answer(&mut rig, "safetystatus"), "Safetystatus: NORMAL");
    rig.ticks(100);
    assert!(!rig.controller.is_moving(), "nothing goes on by itself");
    assert!(rig.controller.upload(SCRIPT));
}

#[test]
fn after_an_emergency_stop_power_and_brakes_come_back_by_hand() {
    let knob = Some(Ticks { from_tick: 200, count: 300 });
    let mut rig = moving(WireKnobs { emergency_stop: knob, ..WireKnobs::default() });
    rig.until(100, |c| c.robot.safety == Safety::EmergencyStop);
    assert!(answer(&mut rig, "power on").starts_with("Emergency stop"));
    rig.until(400, |c| c.robot.safety == Safety::Normal);
    assert_eq!(rig.controller.robot.power, Power::Off);
    assert!(!rig.controller.upload(SCRIPT), "without power nothing starts");
    assert_eq!(answer(&mut rig, "power on"), "Powering on");
    assert_eq!(answer(&mut rig, "robotmode"), "Robotmode: IDLE");
    assert_eq!(answer(&mut rig, "brake release"), "Brake releasing");
    assert!(rig.controller.upload(SCRIPT));
}

#[test]
fn a_safeguard_stop_pauses_and_waits_for_play() {
    let knob = Some(Ticks { from_tick: 200, count: 300 });
    let mut rig = moving(WireKnobs { safeguard_stop: knob, ..WireKnobs::default() });
    rig.until(100, |c| c.robot.safety == Safety::SafeguardStop);
    assert_eq!(rig.controller.runtime, Runtime::Paused);
    assert_eq!(answer(&mut rig, "play"), "Failed to execute: play");
    assert!(rig.until(100, |c| !c.is_moving()) < 50);
    rig.until(400, |c| c.robot.safety == Safety::Normal);
    rig.ticks(100);
    assert!(!rig.controller.is_moving(), "it waits");
    assert_eq!(answer(&mut rig, "play"), "Starting program");
    rig.ticks(50);
    assert!(rig.controller.is_moving());
}

#[test]
fn reduced_mode_halves_the_speed_of_moves() {
    let time = |knobs: WireKnobs| {
        let mut rig = Rig::with(knobs);
        rig.controller.upload(SCRIPT);
        rig.ticks(3);
        let mut to = crate::controller::program::ur_rtde::numbers(&rig.measured());
        to[0] += 0.3;
        to.iter().chain(&[0.5, 1.4]).enumerate().for_each(|(i, x)| rig.controller.input.set_double(i, *x));
        rig.int(0, 1);
        rig.until(5000, |c| c.output.int(0) == 2)
    };
    let reduced = Some(Ticks { from_tick: 1, count: 5000 });
    let (whole, half) = (time(WireKnobs::default()), time(WireKnobs { reduced, ..WireKnobs::default() }));
    assert!((f64::from(half) / f64::from(whole) - 2.0).abs() < 0.05, "{half} {whole}");
}

#[test]
fn a_joint_that_would_be_too_fast_stops_the_arm_by_itself() {
    let mut rig = Rig::new();
    rig.controller.upload(SCRIPT);
    rig.ticks(3);
    let mut to = crate::controller::program::ur_rtde::numbers(&rig.measured());
    to[0] += 2.0;
    to.iter()
        .chain(&[0.0, 0.0, 0.002, 0.03, 2000.0])
        .enumerate()
        .for_each(|(i, x)| rig.controller.input.set_double(i, *x));
    rig.int(0, 11);
    rig.until(200, |c| c.robot.safety == Safety::ProtectiveStop);
    assert!(rig.controller.ended.contains("rad/s"), "{}", rig.controller.ended);
}

#[test]
fn a_popup_that_asks_to_guide_finds_a_hand() {
    let mut rig = Rig::new();
    answer(&mut rig, "popup Please wait");
    assert!(!rig.controller.teach_button());
    answer(&mut rig, "popup Hold the switch, guide the probe along the artery, lift it off, let go.");
    assert!(rig.controller.teach_button() && rig.controller.popup.is_some());
    answer(&mut rig, "close popup");
    assert!(rig.controller.popup.is_none());
}

#[test]
fn what_is_too_old_is_forgotten_and_the_ticks_go_on() {
    let mut rig = Rig::new();
    rig.controller.config.remembers_s = Some(0.2);
    let before = rig.controller.now();
    rig.ticks(1000);
    let moments = rig.controller.cell.truth().moments();
    assert!((100..=201).contains(&moments.len()), "{}", moments.len());
    assert!(((rig.controller.now() - before).seconds() - 2.0).abs() < 1e-9);
    let scene = rig.controller.cell.shared();
    assert_eq!(scene.lock().tick(), 1000);
    let last = moments[moments.len() - 1];
    assert_eq!(scene.lock().world_from_probe(last.stamp), Some(last.world_from_probe));
    assert_eq!(scene.lock().world_from_probe(before), None, "it is forgotten, not guessed");
}
