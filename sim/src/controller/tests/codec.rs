//! RTDE, bytes in and bytes out.

use super::*;
use crate::controller::outputs::Source;
use crate::controller::session::package;
use crate::controller::{Script, dashboard, recognise, scripts::Scripts};
use crate::random::Stream;

/// Every output of UR_WIRE.md that is no register, with its type there.
const WIRE: &str = "DOUBLE timestamp speed_scaling target_speed_fraction actual_execution_time target_execution_time \
actual_momentum actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 \
standard_analog_input1 standard_analog_output0 standard_analog_output1 io_current tool_analog_input0 \
tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar joint_position_deviation_ratio \
collision_detection_ratio payload actual_robot_energy_consumed euromap67_24V_voltage euromap67_24V_current \
VECTOR6D target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current \
actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed \
actual_TCP_force target_TCP_pose target_TCP_speed tcp_offset actual_TCP_acceleration target_TCP_acceleration \
joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents payload_inertia \
target_base_acceleration target_base_wrench VECTOR3D actual_tool_accelerometer elbow_position elbow_velocity \
payload_cog target_gravity INT32 robot_mode safety_mode safety_status tool_output_voltage time_scale_source \
encoder0_raw encoder1_raw VECTOR6INT32 joint_mode UINT32 runtime_state robot_status_bits safety_status_bits \
analog_io_types tool_mode tool_analog_input_types script_control_line output_bit_registers0_to_31 \
output_bit_registers32_to_63 input_bit_registers0_to_31 input_bit_registers32_to_63 euromap67_input_bits \
euromap67_output_bits UINT64 actual_digital_input_bits actual_digital_output_bits \
actual_configurable_digital_input_bits actual_configurable_digital_output_bits control_step UINT8 \
tool_output_mode tool_digital_output0_mode tool_digital_output1_mode BOOL output_bit_register_64 \
output_bit_register_127 input_bit_register_64 INT32 output_int_register_0 output_int_register_47 \
input_int_register_0 DOUBLE output_double_register_0 output_double_register_47 input_double_register_47";

#[test]
fn every_output_of_the_guide_is_answered_with_its_type_and_as_many_bytes() {
    let mut rig = Rig::new();
    rig.ticks(3);
    let mut kind = "";
    let mut names = 0;
    for word in WIRE.split_whitespace() {
        if word.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit()) {
            kind = word;
            continue;
        }
        let source = Source::of(word).unwrap_or_else(|| panic!("{word} is not there"));
        let value = source.value(&rig.controller);
        assert_eq!((source.kind(), value.kind()), (kind, kind), "{word}");
        let mut bytes = Vec::new();
        value.put(&mut bytes);
        // The driver's codec, written apart from this one, reads as many.
        let theirs =
            probepath_robot::drivers::ur::rtde::output_type(word).map(|kind| (kind.name(), kind.size()));
        assert_eq!(theirs, Some((kind, bytes.len())), "{word}");
        names += 1;
    }
    assert!(names > 90, "{names}");
    assert!(Source::of("output_int_register_48").is_none() && Source::of("output_int_register_07").is_none());
    assert!(Source::of("output_bit_register_63").is_none() && Source::of("actual_tcp_pose").is_none());
}

#[test]
fn a_trailing_comma_names_nothing_and_an_unknown_name_is_said() {
    let mut rig = Rig::new();
    let mut session = rig.session(1);
    let wish = |names: &str| [&500.0_f64.to_be_bytes()[..], names.as_bytes()].concat();
    let reply = rig.say(&mut session, b'O', &wish("timestamp,actual_q,"));
    assert_eq!(&reply[3..], b"\x01DOUBLE,VECTOR6D");
    let reply = rig.say(&mut session, b'O', &wish("timestamp,no_such_thing"));
    assert_eq!(&reply[3..], b"\x00DOUBLE,NOT_FOUND");
    assert!(session.anyway(&rig.controller).is_none(), "a recipe that was refused sends nothing");
}

#[test]
fn a_connection_begins_in_version_one() {
    let mut rig = Rig::new();
    let mut session = Session::new(1, false);
    assert_eq!(&rig.say(&mut session, b'O', b"timestamp")[3..], b"DOUBLE", "no rate, no number");
    rig.say(&mut session, b'S', &[]);
    let data = session.anyway(&rig.controller).unwrap();
    assert_eq!(data.len(), 3 + 8, "no number before the fields");
    let seconds = f64::from_be_bytes(data[3..].try_into().unwrap());
    assert!(seconds >= 60.0, "the clock starts above 40 s: {seconds}");
    assert_eq!(session.text("x", 2), [0, 5, b'M', 2, b'x']);
    assert_eq!(rig.say(&mut session, b'V', &[0, 3]), [0, 4, b'V', 0], "there is no version 3");
}

#[test]
fn input_recipes_are_numbered_in_order_and_may_share_registers() {
    let mut rig = Rig::new();
    let mut session = rig.session(1);
    for number in 1..=23_u8 {
        let reply = rig.say(&mut session, b'I', b"input_int_register_0,input_double_register_0");
        assert_eq!(&reply[3..], [&[number], &b"INT32,DOUBLE"[..]].concat());
    }
    let package = [&[23], &7_i32.to_be_bytes()[..], &1.5_f64.to_be_bytes()[..]].concat();
    assert!(rig.say(&mut session, b'U', &package).is_empty());
    assert_eq!((rig.controller.input.int(0), rig.controller.input.double(0)), (7, 1.5));
    let longer = [&package[..], &[1; 40]].concat();
    assert!(rig.say(&mut session, b'U', &longer).is_empty(), "what is beyond the recipe is left");
    let reply = rig.say(&mut session, b'U', &package[..9]);
    assert_eq!(reply[2], b'M', "a package that is too short is said, and nothing taken of it");
}

#[test]
fn what_one_client_holds_is_in_use_for_the_second() {
    let mut rig = Rig::new();
    let (mut first, mut second) = (rig.session(1), rig.session(2));
    assert_eq!(rig.say(&mut first, b'I', b"input_int_register_5")[3], 1);
    let reply = rig.say(&mut second, b'I', b"input_int_register_6,input_int_register_5");
    assert_eq!(&reply[3..], b"\x00INT32,IN_USE");
    assert_eq!(rig.say(&mut second, b'I', b"input_int_register_6")[3], 1, "the other one is free");
    let mut taken = Rig::with(WireKnobs { taken: vec!["*".into()], ..WireKnobs::default() });
    let mut session = taken.session(1);
    assert_eq!(&taken.say(&mut session, b'I', b"speed_slider_mask")[3..], b"\x00IN_USE");
}

#[test]
fn a_lower_rate_gives_every_fourth_tick() {
    let mut rig = Rig::new();
    let mut session = rig.session(1);
    rig.say(&mut session, b'O', &[&125.0_f64.to_be_bytes()[..], b"timestamp"].concat());
    rig.say(&mut session, b'S', &[]);
    let mut sent = 0;
    for _ in 0..400 {
        rig.ticks(1);
        sent += u32::from(session.due(&rig.controller).is_some());
    }
    assert_eq!(sent, 100);
}

#[test]
fn the_answers_do_not_hang_on_how_the_bytes_are_split() {
    let outputs = [&250.0_f64.to_be_bytes()[..], b"actual_q,runtime_state"].concat();
    let talk = [
        package(b'V', &[0, 2]),
        package(b'v', &[]),
        package(b'O', &outputs),
        package(b'I', b"input_int_register_24"),
        package(b'S', &[]),
        package(b'U', &[1, 0, 0, 0, 9]),
        package(b'P', &[]),
    ]
    .concat();
    let whole = |size: usize| {
        let mut rig = Rig::new();
        let mut session = Session::new(1, false);
        let mut replies = Vec::new();
        for chunk in talk.chunks(size) {
            replies.extend(session.hear(chunk, &mut rig.controller, &mut rig.owners).replies);
        }
        (replies, rig.controller.input.int(24))
    };
    let all = whole(talk.len());
    assert_eq!(all.1, 9);
    for size in 1..talk.len() {
        assert_eq!(whole(size), all, "{size}");
    }
}

#[test]
fn a_length_that_cannot_be_ends_the_connection_in_words() {
    for size in 0..3_u8 {
        let mut rig = Rig::new();
        let mut session = rig.session(1);
        let heard = session.hear(&[0, size, b'V', 1, 2, 3], &mut rig.controller, &mut rig.owners);
        assert!(heard.close && heard.replies[2] == b'M');
    }
}

#[test]
fn no_bytes_make_it_panic() {
    let mut stream = Stream::new(5, "bytes");
    let mut rig = Rig::new();
    let mut session = rig.session(1);
    rig.say(&mut session, b'I', b"input_int_register_0,input_double_register_0,speed_slider_mask");
    for round in 0..20_000 {
        let length = stream.uniform(0.0, 40.0) as usize;
        let mut bytes: Vec<u8> = (0..length).map(|_| stream.uniform(0.0, 256.0) as u8).collect();
        if round % 2 == 0 {
            let kinds = b"VvMUOISP";
            bytes = package(kinds[stream.uniform(0.0, 8.0) as usize], &bytes);
        }
        if session.hear(&bytes, &mut rig.controller, &mut rig.owners).close || round % 50 == 0 {
            session = rig.session(1);
        }
        let line = String::from_utf8_lossy(&bytes).into_owned();
        let _ = dashboard::answer(&mut rig.controller, &line);
        Scripts::default().hear(&bytes).iter().for_each(|script| assert!(!rig.controller.upload(script)));
    }
    rig.ticks(10);
}

#[test]
fn scripts_are_known_by_their_first_line() {
    assert_eq!(recognise(b"# hello\n\n  def probepath():\n"), Script::Probepath);
    assert_eq!(recognise(b"def rtde_control():\r\n  x"), Script::UrRtde);
    assert_eq!(recognise(b"def external_control():\n"), Script::Unknown);
    assert_eq!(recognise(&[0xff, 0xfe, 10, 0]), Script::Unknown);
    let mut rig = Rig::new();
    assert!(!rig.controller.upload(b"def probepath():\nend\n"), "another script of that name is not ours");
}
