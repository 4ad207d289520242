//! probepath's script, driven by its registers.

use nalgebra::Vector3;
use probepath_robot::drivers::ur::registers::{self, command, state};
use probepath_robot::drivers::ur::script::Parameters;

use super::*;
use crate::knobs::Ticks;

pub(super) const GIVEN: Parameters = Parameters {
    watchdog_ticks: 10,
    watchdog_hz: 10.0,
    lookahead_s: 0.03,
    gain: 300.0,
    mass_kg: 0.85,
    centre_of_gravity_m: Vector3::new(0.006, 0.0, 0.070),
};

/// A host that speaks with the script.
struct Host {
    rig: Rig,
    seq: i32,
}

impl Host {
    fn new(knobs: WireKnobs) -> Self {
        let mut rig = Rig::with(knobs);
        assert!(rig.controller.upload(GIVEN.text().as_bytes()));
        rig.ticks(1);
        let mut host = Self { rig, seq: 0 };
        assert_eq!(host.said(registers::OUT_PROTOCOL), registers::PROTOCOL);
        assert_eq!(host.state(), state::WAITING);
        host.hello(1);
        host
    }

    fn hello(&mut self, session: i32) {
        self.rig.int(registers::IN_SESSION as usize, session);
        self.tick(command::HELLO);
        self.tick(command::HELLO);
        assert_eq!((self.said(registers::OUT_SESSION), self.state()), (session, state::HOLDING));
    }

    fn said(&self, register: u32) -> i32 {
        self.rig.controller.output.int(register as usize)
    }

    fn state(&self) -> i32 {
        self.said(registers::OUT_STATE)
    }

    /// One package and one tick.
    fn tick(&mut self, command: i32) {
        self.seq += 1;
        self.rig.int(registers::IN_SEQUENCE as usize, self.seq);
        self.rig.int(registers::IN_COMMAND as usize, command);
        self.rig.ticks(1);
    }

    fn servo(&mut self, to: &Joints) {
        let six = crate::controller::program::ur_rtde::numbers(to);
        self.rig.controller.input.set_six(registers::IN_SETPOINT as usize, &six);
        self.tick(command::SERVO);
    }

    /// Joint 0 away at 0.2 rad/s for so many ticks.
    fn moving(&mut self, ticks: u32) {
        let mut to = *self.rig.controller.robot.target().0;
        for _ in 0..ticks {
            to[0] += 0.2 * 0.002;
            self.servo(&to);
        }
        assert!(self.rig.controller.is_moving());
    }

    /// Ticks until the arm stands, with nobody writing anything.
    fn left_alone(&mut self) -> u32 {
        self.rig.until(500, |c| !c.is_moving())
    }
}

#[test]
fn setpoints_are_followed_and_staying_rests() {
    let mut host = Host::new(WireKnobs::default());
    host.moving(250);
    assert_eq!((host.state(), host.said(registers::OUT_SEQUENCE)), (state::SERVOING, host.seq));
    // Behind a steady motion by the look-ahead at the gain of 300, and a tick or two.
    let behind = host.rig.controller.input.double(24) - host.rig.measured()[0];
    assert!((0.2 * 0.026..0.2 * 0.038).contains(&behind), "{behind}");
    (0..200).for_each(|_| host.tick(command::STAY));
    assert_eq!(host.state(), state::HOLDING);
    assert!(!host.rig.controller.is_moving());
}

#[test]
fn silence_stops_the_arm_and_only_another_handshake_goes_on() {
    let mut host = Host::new(WireKnobs::default());
    host.moving(250);
    let ticks = host.left_alone();
    // Ten ticks of patience, then 0.2 rad/s at 8 rad/s², and the servo's lag: within 100 ms.
    assert!((12..=50).contains(&ticks), "{ticks}");
    assert_eq!(host.state(), state::TIMED_OUT);
    host.moving_is_refused();
    host.hello(2);
    host.moving(20);
}

impl Host {
    fn moving_is_refused(&mut self) {
        let there = self.rig.measured();
        let mut to = there;
        for _ in 0..30 {
            to[0] += 0.0004;
            self.servo(&to);
        }
        assert!(apart(&there, &self.rig.measured()) < 1e-3);
    }
}

#[test]
fn the_last_net_ends_the_program_when_silence_lasts() {
    let mut host = Host::new(WireKnobs {
        reader_hangs: Some(Ticks { from_tick: 300, count: 9999 }),
        mover_hangs: Some(Ticks { from_tick: 300, count: 9999 }),
        ..WireKnobs::default()
    });
    host.moving(250);
    while host.rig.controller.counters.ticks < 300 {
        host.moving(1);
    }
    let ticks = host.rig.until(100, |c| c.program_name().is_none());
    assert!(ticks >= 50, "{ticks}");
    assert!(host.rig.controller.ended.contains("watchdog"), "{}", host.rig.controller.ended);
    assert!(host.left_alone() < 50);
}

#[test]
fn a_thread_that_hangs_is_found_by_the_other() {
    let from_tick = 260;
    let hung = Some(Ticks { from_tick, count: 9999 });
    for (knobs, found) in [
        (WireKnobs { reader_hangs: hung, ..WireKnobs::default() }, "reads the registers"),
        (WireKnobs { mover_hangs: hung, ..WireKnobs::default() }, "moves the arm"),
    ] {
        let mut host = Host::new(knobs);
        while host.rig.controller.counters.ticks < from_tick {
            host.moving(1);
        }
        let mut ticks = 0;
        while host.rig.controller.program_name().is_some() || host.rig.controller.is_moving() {
            host.tick(command::SERVO);
            ticks += 1;
            assert!(ticks < 60, "{found}");
        }
        assert!(host.rig.controller.ended.contains(found), "{}", host.rig.controller.ended);
    }
}

#[test]
fn a_setpoint_far_away_or_no_number_is_refused_and_the_arm_rests() {
    for wild in [0.5, f64::NAN, f64::INFINITY] {
        let mut host = Host::new(WireKnobs::default());
        host.moving(50);
        let mut to = host.rig.measured();
        to[2] += wild;
        (0..100).for_each(|_| host.servo(&to));
        assert_eq!(host.state(), state::REFUSED);
        assert!(!host.rig.controller.is_moving() && host.rig.controller.robot.safety.moves());
    }
}

#[test]
fn zeroing_is_done_once_and_counted() {
    let mut host = Host::new(WireKnobs::default());
    (0..30).for_each(|_| host.tick(command::ZERO));
    assert_eq!(host.said(registers::OUT_ZEROED), 1);
    host.tick(command::STAY);
    (0..5).for_each(|_| host.tick(command::ZERO));
    assert_eq!(host.said(registers::OUT_ZEROED), 2);
}

#[test]
fn freedrive_gives_way_and_servoing_comes_back_from_where_the_hand_left_it() {
    let mut host = Host::new(WireKnobs::default());
    let from = host.rig.measured();
    (0..1500).for_each(|_| host.tick(command::FREEDRIVE));
    assert_eq!(host.state(), state::FREEDRIVE);
    assert!(host.rig.controller.teach_button() && apart(&from, &host.rig.measured()) > 0.02);
    for _ in 0..300 {
        let here = *host.rig.controller.robot.target().0;
        host.servo(&here);
    }
    assert_eq!(host.state(), state::SERVOING);
    assert!(!host.rig.controller.teach_button());
    (0..300).for_each(|_| host.tick(command::STAY));
    host.tick(command::END);
    assert_eq!(host.rig.controller.program_name(), None);
}
