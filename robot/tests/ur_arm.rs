//! The UR driver against a small controller of bytes: what it needs, what it refuses, what it notices.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may stop at the first surprise, its helpers too"
)]

mod support;

use nalgebra::Vector3;
use probepath_frames::Span;
use probepath_robot::drivers::ur::registers::{command, state};
use probepath_robot::drivers::ur::{UrArm, UrError, UrSettings};
use probepath_robot::{Arm, ArmFault, Command, Joints, Safety};
use support::{Controller, Lies, START, settings};

fn connected(lies: Lies) -> (Controller, UrArm) {
    let controller = Controller::start(lies);
    let arm = UrArm::connect(&controller.host, settings()).unwrap_or_else(|error| panic!("{error}"));
    (controller, arm)
}

fn refused(lies: Lies) -> UrError {
    let controller = Controller::start(lies);
    match UrArm::connect(&controller.host, settings()) {
        Ok(_) => panic!("it connected"),
        Err(error) => error,
    }
}

fn near(from: &Joints, by: f64) -> Command {
    Command::Position(from.map(|q| q + by))
}

#[test]
fn commands_go_out_and_states_come_back_on_the_controllers_clock() {
    let (controller, mut arm) = connected(Lies { force: [0.0, 0.0, 5.0, 0.0, 0.0, 0.0], ..Lies::default() });
    let first = arm.exchange(&Command::Stay).unwrap();
    assert_eq!(first.commanded.as_slice(), START);
    assert_eq!((first.safety, first.guiding), (Safety::Normal, false));
    let mut last = first;
    for n in 1..=200 {
        let state = arm.exchange(&near(&first.commanded, 1e-4 * f64::from(n))).unwrap();
        assert_eq!((state.tick, state.stamp), (last.tick + 1, last.stamp + Span::from_milliseconds(2)));
        assert_eq!(state.commanded, state.position, "this controller follows at once");
        assert!(state.age > Span::ZERO && state.age < Span::from_milliseconds(1500), "{:?}", state.age);
        last = state;
    }
    assert!(last.stamp.seconds() > 42.0, "the controller's clock, not ours: {}", last.stamp);
    // The flange's z points down here: what pushes the probe up is against its z.
    assert!((last.wrench.force.norm() - 5.0).abs() < 1e-9 && last.wrench.force.z < -4.9, "{:?}", last.wrench);
    let counts = arm.counts();
    assert_eq!((counts.packages, counts.gaps, counts.connections, counts.faults), (201, 0, 1, 0));
    assert!(counts.texts >= 1 && counts.oldest >= last.age);
    let inside = controller.inside.lock().unwrap();
    let told = inside.script.unwrap();
    assert_eq!(
        (told.mass_kg, told.centre_of_gravity_m, told.watchdog_ticks),
        (0.62, Vector3::new(0.001, 0.0, 0.07), 20)
    );
    assert!(
        inside.orders.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1),
        "every order has the next number"
    );
}

#[test]
fn freedrive_gives_way_and_the_commanded_position_follows_the_hand() {
    let (controller, mut arm) = connected(Lies { status_bits: 7, ..Lies::default() });
    let before = arm.exchange(&Command::Stay).unwrap();
    let mut given = before;
    for _ in 0..50 {
        given = arm.exchange(&Command::Freedrive).unwrap();
        assert_eq!(given.commanded, given.position);
        assert!(given.guiding, "the teach button is bit 2");
    }
    assert!(given.position[0] - before.position[0] > 0.049, "the hand moved it");
    assert_eq!(arm.exchange(&Command::Stay).unwrap().commanded, given.position, "and there it stays");
    assert_eq!(
        controller.inside.lock().unwrap().orders.iter().filter(|order| order.1 == command::FREEDRIVE).count(),
        50
    );
}

#[test]
fn a_command_of_other_joints_or_not_finite_never_leaves() {
    let (controller, mut arm) = connected(Lies::default());
    let here = arm.exchange(&Command::Stay).unwrap().commanded;
    for wrong in [Joints::zeros(5), Joints::zeros(7), here.map(|_| f64::NAN), here.map(|_| f64::INFINITY)] {
        assert!(matches!(arm.exchange(&Command::Position(wrong)), Err(ArmFault::Refused { .. })));
    }
    assert!(arm.exchange(&near(&here, 1e-4)).is_ok(), "the next is taken");
    let orders = controller.inside.lock().unwrap().orders.clone();
    assert!(orders.iter().all(|(_, _, setpoint)| setpoint.iter().all(|q| q.is_finite())));
    assert_eq!(
        orders.iter().filter(|order| order.1 == command::SERVO).count(),
        1,
        "it was told to stay instead"
    );
}

#[test]
fn skipped_packages_show_as_gaps_and_are_counted() {
    let (_controller, mut arm) = connected(Lies { skip: 20..27, ..Lies::default() });
    let mut ticks = Vec::new();
    for _ in 0..40 {
        ticks.push(arm.exchange(&Command::Stay).unwrap().tick);
    }
    let gaps: Vec<u64> =
        ticks.windows(2).map(|pair| pair[1] - pair[0]).filter(|passed| *passed != 1).collect();
    assert_eq!(gaps, [8]);
    assert_eq!((arm.counts().gaps, arm.counts().longest_gap), (7, 7));
}

/// What a fault at package 10 is, and when it is seen.
#[test]
fn packages_that_come_together_are_all_seen_and_the_newest_is_commanded_upon() {
    let (_controller, mut arm) = connected(Lies { burst: 50..51, ..Lies::default() });
    let first = arm.exchange(&Command::Stay).unwrap();
    let (mut last, mut together, mut commanded) = (first, 0, first.commanded);
    for n in 1..=100 {
        let state = arm.exchange(&near(&first.commanded, 1e-4 * f64::from(n))).unwrap();
        let older = arm.overtaken();
        assert_eq!(state.tick, last.tick + 1 + older.len() as u64, "none is missing");
        for (k, overtaken) in older.iter().enumerate() {
            assert_eq!(overtaken.tick, last.tick + 1 + k as u64);
            let behind = state.stamp - overtaken.stamp;
            assert_eq!(overtaken.stamp, last.stamp + Span::from_milliseconds(2 * (1 + k as i64)));
            assert_eq!((overtaken.age.nanoseconds() - state.age.nanoseconds()), behind.nanoseconds());
            assert_eq!(overtaken.commanded, commanded, "this exchange's command was not heard yet");
        }
        together += older.len();
        (last, commanded) = (state, state.commanded);
    }
    assert_eq!(together, 3);
    let counts = arm.counts();
    assert_eq!((counts.late, counts.gaps), (3, 0));
}

fn fault(lies: Lies) -> (Controller, UrArm, ArmFault, u32) {
    let (controller, mut arm) = connected(lies);
    let here = arm.exchange(&Command::Stay).unwrap().commanded;
    for n in 2..200 {
        if let Err(fault) = arm.exchange(&near(&here, 1e-5 * f64::from(n))) {
            assert_eq!(arm.exchange(&Command::Stay), Err(fault.clone()), "it lasts");
            assert_eq!(arm.fault(), Some(&fault));
            return (controller, arm, fault, n);
        }
    }
    panic!("no fault");
}

#[test]
fn every_stop_of_the_controller_is_seen_at_its_tick_and_lasts() {
    let kind = |bits| {
        let (_controller, _arm, fault, seen) = fault(Lies { safety: Some((10, bits)), ..Lies::default() });
        // The handshake's own package was the first.
        assert_eq!(seen, 9, "at its tick: {fault}");
        fault
    };
    assert!(matches!(kind(1028), ArmFault::ProtectiveStop { .. }));
    assert!(matches!(kind(1 << 4), ArmFault::SafeguardStop { .. }));
    assert!(matches!(kind(1 << 6 | 1 << 7), ArmFault::EmergencyStop { .. }));
    assert!(matches!(kind(1 << 9), ArmFault::SafetyFault { .. }));
}

#[test]
fn reduced_mode_is_said_and_does_not_stop() {
    let (_controller, mut arm) = connected(Lies { safety: Some((10, 0b11)), ..Lies::default() });
    let seen: Vec<Safety> = (0..20).map(|_| arm.exchange(&Command::Stay).unwrap().safety).collect();
    assert_eq!((seen[0], seen[19]), (Safety::Normal, Safety::Reduced));
}

#[test]
fn a_lost_or_lying_stream_is_a_lost_connection_in_words() {
    let words = |lies| {
        let (_controller, _arm, fault, _) = fault(lies);
        assert!(matches!(fault, ArmFault::ConnectionLost { .. }), "{fault}");
        fault.to_string()
    };
    let cut = words(Lies { cut_at: Some(10), ..Lies::default() });
    assert!(cut.contains("closed the connection"), "{cut}");
    let stalled = words(Lies { stall_at: Some(10), ..Lies::default() });
    assert!(stalled.contains("said nothing for"), "{stalled}");
    let back = words(Lies { back_at: Some(10), ..Lies::default() });
    assert!(back.contains("its clock went from"), "{back}");
    let nan = words(Lies { nan_at: Some(10), ..Lies::default() });
    assert!(nan.contains("NaN"), "{nan}");
    let short = words(Lies { short_at: Some(10), ..Lies::default() });
    assert!(short.contains("bytes of fields"), "{short}");
}

#[test]
fn a_script_that_ends_hangs_or_stopped_is_noticed() {
    let words = |lies| fault(lies).2.to_string();
    let ended = words(Lies { ends_at: Some(10), ..Lies::default() });
    assert!(ended.contains("is stopped"), "{ended}");
    let timed_out = words(Lies { says: Some((10, state::TIMED_OUT)), ..Lies::default() });
    assert!(timed_out.contains("heard nothing for more than 40 ms"), "{timed_out}");
    let far = words(Lies { says: Some((10, state::REFUSED)), ..Lies::default() });
    assert!(far.contains("too far"), "{far}");
    let hung = words(Lies { deaf_at: Some(10), ..Lies::default() });
    assert!(hung.contains("has not echoed"), "{hung}");
}

#[test]
fn recovering_redoes_everything_and_resumes_nothing() {
    let (controller, mut arm, fault, _) = fault(Lies { safety: Some((10, 1028)), ..Lies::default() });
    assert!(matches!(fault, ArmFault::ProtectiveStop { .. }));
    let orders = controller.inside.lock().unwrap().orders.len();
    let recovered = arm.recover().unwrap();
    assert_eq!(recovered.commanded, recovered.position, "from where it is");
    let inside = controller.inside.lock().unwrap().clone();
    assert_eq!(inside.scripts, 2);
    let moved = inside.orders[orders..].iter().filter(|order| order.1 == command::SERVO).count();
    assert_eq!(moved, 0, "nothing is resumed");
    for asked in ["unlock protective stop", "close safety popup"] {
        assert!(inside.asked.iter().any(|line| line == asked), "{asked}");
    }
    assert!(arm.exchange(&near(&recovered.commanded, 1e-4)).is_ok());
    assert_eq!((arm.counts().connections, arm.counts().faults), (2, 1));
    assert!(matches!(arm.recover(), Err(UrError::NothingToRecover)));
}

#[test]
fn a_cut_connection_is_connected_anew_only_on_a_persons_word() {
    let (controller, mut arm, _, _) = fault(Lies { cut_at: Some(10), ..Lies::default() });
    for _ in 0..10 {
        assert!(arm.exchange(&Command::Stay).is_err());
    }
    assert_eq!(controller.inside.lock().unwrap().scripts, 1, "nothing happens by itself");
    arm.recover().unwrap();
    assert!(arm.exchange(&Command::Stay).is_ok());
}

#[test]
fn an_emergency_stop_is_a_persons_to_clear() {
    let (_controller, mut arm, _, _) = fault(Lies { safety: Some((10, 1 << 6)), ..Lies::default() });
    let words = arm.recover().unwrap_err().to_string();
    assert!(words.contains("release it") && words.contains("pendant"), "{words}");
    assert!(arm.exchange(&Command::Stay).is_err(), "the fault stays");
}

#[test]
fn the_sensor_is_zeroed_at_rest_and_not_under_load() {
    let (controller, mut arm) = connected(Lies { force: [3.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..Lies::default() });
    arm.zero_sensor().unwrap();
    assert!(arm.exchange(&Command::Stay).is_ok());
    let orders = controller.inside.lock().unwrap().orders.clone();
    assert!(orders.iter().any(|order| order.1 == command::ZERO) && orders.last().unwrap().1 == command::STAY);
    let (controller, mut arm) = connected(Lies { force: [0.0, 0.0, 20.0, 0.0, 0.0, 0.0], ..Lies::default() });
    let words = arm.zero_sensor().unwrap_err().to_string();
    assert!(words.contains("20.0 N") && words.contains("lift"), "{words}");
    assert!(controller.inside.lock().unwrap().orders.iter().all(|order| order.1 != command::ZERO));
}

#[test]
fn words_are_shown_on_the_pendant_in_one_line() {
    let (controller, mut arm) = connected(Lies::default());
    arm.popup("Guide the probe\nalong the leg").unwrap();
    arm.close_popup().unwrap();
    let asked = controller.inside.lock().unwrap().asked.clone();
    assert!(asked.contains(&"popup Guide the probe along the leg".to_owned()), "{asked:?}");
}

#[test]
fn a_controller_that_is_not_as_it_has_to_be_is_refused_in_words() {
    let says = |lies: Lies, words: &[&str]| {
        let error = refused(lies).to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error} says not {words:?}");
    };
    says(Lies { version: [5, 9, 4, 1], ..Lies::default() }, &["5.9.4.1", "5.10"]);
    says(Lies { version: [3, 15, 8, 1], ..Lies::default() }, &["CB3"]);
    says(Lies { version: [10, 7, 0, 1], ..Lies::default() }, &["PolyScope X"]);
    says(Lies { version: [4, 0, 0, 1], ..Lies::default() }, &["knows PolyScope 5"]);
    says(Lies { remote: false, ..Lies::default() }, &["local control"]);
    says(Lies { banner: "220 ProFTPD ready", ..Lies::default() }, &["no UR dashboard", "220 ProFTPD"]);
    says(Lies { banner: "Conn\u{1}", ..Lies::default() }, &["0x01"]);
    says(
        Lies { inputs: Some("IN_USE".into()), ..Lies::default() },
        &["another client", "input_int_register_24"],
    );
    says(Lies { outputs: Some("DOUBLE,NOT_FOUND".into()), ..Lies::default() }, &["has no actual_q"]);
    says(Lies { outputs: Some("DOUBLE,VECTOR3D".into()), ..Lies::default() }, &["2 types came for 19 names"]);
    says(Lies { mode: 3, ..Lies::default() }, &["switched off", "pendant"]);
    says(Lies { unturned: true, ..Lies::default() }, &["180 degrees about z", "base_link"]);
    says(Lies { payload_factor: 1.1, ..Lies::default() }, &["0.62 kg", "0.68", "sink"]);
    says(Lies { protocol: 9, ..Lies::default() }, &["protocol 9", "speaks 1"]);
    says(Lies { other_program: true, ..Lies::default() }, &["not ours"]);
    says(Lies { starts_scripts: false, ..Lies::default() }, &["does not run", "stopped"]);
}

#[test]
fn what_is_no_controller_at_all_is_refused_in_words() {
    let raw = |bytes: &[u8]| refused(Lies { raw: Some(bytes.to_vec()), ..Lies::default() }).to_string();
    let web = raw(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n");
    assert!(web.contains("web server"), "{web}");
    assert!(raw(b"").contains("closed the connection"));
    assert!(raw(&[0, 0, b'V']).contains("0 bytes long"));
    assert!(raw(&[0, 3, b'V']).contains("0 bytes, it has 1"));
    assert!(raw(&[0xff, 0xff, b'V', 1, 2, 3]).contains("65535 bytes long"));
    assert!(raw(&[0, 4, b'V', 0]).contains("version 2"));
    assert!(raw(&[0, 4, b'Q', 0]).contains("does not have"));
    assert!(raw(&[0, 4, b'S', 1]).contains("packet of kind start"));
    assert!(raw(&[0, 4, b'V']).contains("closed the connection"), "cut in the middle");
    // Nobody listens there at all.
    let nobody = UrArm::connect(&support::host(), settings()).unwrap_err().to_string();
    assert!(nobody.contains("30004") && nobody.contains("its cable in"), "{nobody}");
    let nowhere = UrArm::connect("no-such-host.invalid", settings()).unwrap_err();
    assert!(matches!(nowhere, UrError::Unreachable { .. }), "{nowhere}");
}

#[test]
fn settings_that_cannot_be_are_refused_before_anything_is_sent() {
    let refused = |change: fn(&mut UrSettings)| {
        let mut wrong = settings();
        change(&mut wrong);
        UrArm::connect("127.0.0.1", wrong).unwrap_err().to_string()
    };
    assert!(refused(|s| s.payload_kg = 620.0).contains("is it in kg"));
    assert!(refused(|s| s.payload_kg = f64::NAN).contains("NaN"));
    assert!(refused(|s| s.centre_of_gravity_m.z = 70.0).contains("is it in metres"));
    assert!(refused(|s| s.gain = 5.0).contains("100 to 2000"));
    assert!(refused(|s| s.lookahead_s = 0.5).contains("0.03 to 0.2"));
    assert!(refused(|s| s.watchdog = Span::from_milliseconds(1000)).contains("10 and 200 ms"));
    assert!(refused(|s| s.silence = Span::ZERO).contains("above zero"));
    assert!(refused(|s| s.model = probepath_robot::Model::seven_joint()).contains("a UR arm has 6"));
}
