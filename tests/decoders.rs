//! What is read from outside, on millions of damaged streams from a seed: the checks of the fuzz targets, in every run.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test stops at the first surprise")]

use std::path::Path;

use probepath_robot::drivers::ur::rtde::{Reply, Request, Version};
use probepath_robot::drivers::ur::script::Parameters;
use probepath_us_capture::igtl::{Image, encode_image, encode_status};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[path = "../fuzz/checks/dashboard.rs"]
mod dashboard;
#[path = "../fuzz/checks/igtl.rs"]
mod igtl;
#[path = "../fuzz/checks/rtde.rs"]
mod rtde;
#[path = "../fuzz/checks/script.rs"]
mod script;

/// Damages whole streams and has each checked; the first byte says how a stream is cut.
fn damaged(seed: u64, cases: usize, whole: &[Vec<u8>], check: fn(&[u8])) {
    let mut dice = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..cases {
        let mut stream = vec![dice.random()];
        for _ in 0..dice.random_range(1..4) {
            stream.extend(&whole[dice.random_range(0..whole.len())]);
        }
        for _ in 0..dice.random_range(1..5) {
            damage(&mut dice, &mut stream);
        }
        check(&stream);
    }
}

/// One byte flipped, written over, put in or taken out, a number made extreme, or the rest lost.
fn damage(dice: &mut ChaCha8Rng, stream: &mut Vec<u8>) {
    if stream.is_empty() {
        return;
    }
    let at = dice.random_range(0..stream.len());
    match dice.random_range(0..6) {
        0 => stream[at] ^= 1 << dice.random_range(0..8),
        1 => stream[at] = dice.random(),
        2 => stream.insert(at, dice.random()),
        3 => drop(stream.remove(at)),
        4 => stream[at] = [0, 1, 2, 3, 0x7f, 0x80, 0xfe, 0xff][dice.random_range(0..8)],
        _ => stream.truncate(at + 1),
    }
}

#[test]
fn rtde_packets() {
    let mut whole = Vec::new();
    let mut add = |written: &dyn Fn(&mut Vec<u8>)| {
        let mut packet = Vec::new();
        written(&mut packet);
        whole.push(packet);
    };
    let names = "timestamp,actual_q,runtime_state";
    let requests = [
        Request::ProtocolVersion(2),
        Request::ControllerVersion,
        Request::Outputs { frequency_hz: 500.0, names },
        Request::Inputs { names: "input_int_register_24,input_double_register_24" },
        Request::Start,
        Request::Pause,
        Request::Data { recipe: 1, fields: &[7; 60] },
    ];
    for request in requests {
        add(&|packet| request.write(Version::V2, packet).unwrap());
    }
    let replies = [
        Reply::ProtocolVersion { accepted: true },
        Reply::Outputs { recipe: 1, types: "DOUBLE,VECTOR6D,UINT32" },
        Reply::Outputs { recipe: 1, types: "DOUBLE,NOT_FOUND,UINT32" },
        Reply::Inputs { recipe: 1, types: "INT32,IN_USE" },
        Reply::Start { accepted: true },
        Reply::Data { recipe: 1, fields: &[3; 60] },
    ];
    for reply in replies {
        add(&|packet| reply.write(Version::V2, packet).unwrap());
    }
    // A text message of the controller: level 3, "hello" from "me".
    whole.push([&[0, 12, b'M', 5][..], b"hello", &[2], b"me", &[3]].concat());
    whole.push([&[0, 12, b'M', 5][..], b"hello", &[1], b"m", &[3]].concat());
    damaged(1, 1_000_000, &whole, rtde::check);
}

#[test]
fn dashboard_lines() {
    let lines = [
        "Connected: Universal Robots Dashboard Server\n",
        "URSoftware 5.19.0.1210631 (Jan 01 2024)\r\n",
        "Robotmode: RUNNING\n",
        "Safetystatus: PROTECTIVE_STOP\n",
        "could not understand: 'x'\n",
        "\n",
    ];
    let mut whole: Vec<Vec<u8>> = lines.iter().map(|line| line.as_bytes().to_vec()).collect();
    whole.push(vec![b'a'; 1020]);
    damaged(2, 1_000_000, &whole, dashboard::check);
}

#[test]
fn scripts_of_a_controller() {
    let ours = Path::new(env!("CARGO_MANIFEST_DIR")).join("robot/src/drivers/ur/probepath.script");
    let text = std::fs::read_to_string(ours).unwrap();
    let filled =
        ["WATCHDOG_TICKS", "WATCHDOG_HZ", "LOOKAHEAD_S", "GAIN", "MASS_KG", "COG_X_M", "COG_Y_M", "COG_Z_M"];
    let text = filled.iter().fold(text, |text, name| text.replace(&format!("{{{name}}}"), "25"));
    assert!(Parameters::read(&text).is_some());
    let theirs = b"def rtde_control():\n  sync()\nend\n".to_vec();
    // No byte before a script says anything, so the dice's own goes with the damage.
    let check = |bytes: &[u8]| script::check(bytes.get(1..).unwrap_or_default());
    damaged(3, 30_000, &[text.into_bytes(), theirs], check);
}

#[test]
fn openigtlink_messages() {
    let image = Image { columns: 12, rows: 7, spacing_mm: [0.1, 0.2], pixels: (0..84).collect() };
    let whole = vec![
        encode_image("Probe", 1, 61_000_000_000, &image).unwrap(),
        encode_image("Probe", 2, 61_040_000_000, &image).unwrap(),
        encode_status("Probe", 61_050_000_000).unwrap(),
    ];
    damaged(4, 300_000, &whole, igtl::check);
}
