use std::sync::{Arc, Mutex};

use probepath_robot::Operator;
use probepath_us_capture::exam::Exam;

use super::*;
use crate::session::{CellFile, Opening};

/// A session of the simulated cell in a folder of its own.
fn session(name: &str) -> (Arc<Mutex<Session>>, std::path::PathBuf) {
    let out = std::env::temp_dir().join(format!("probepath-protocol-{name}-{}", std::process::id()));
    let opening = Opening {
        cell: CellFile::default(),
        seed: 1,
        out: out.clone(),
        protocol: Protocol { name: "test".into(), text: String::new() },
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    };
    (Arc::new(Mutex::new(Session::open(opening).unwrap())), out)
}

fn error_of(name: &str, text: &str) -> ProtocolError {
    let (session, out) = session(name);
    let protocol = Protocol { name: "leg.rhai".into(), text: text.into() };
    let error = run(&protocol, &session).unwrap_err();
    std::fs::remove_dir_all(out).unwrap();
    error
}

#[test]
fn a_typing_error_is_placed() {
    let error = error_of("typing", "let path = teach(#{ side: \"left\" };");
    assert!(matches!(error, ProtocolError::Syntax { .. }), "{error}");
    assert!(error.to_string().starts_with("leg.rhai:1:"), "{error}");
}

#[test]
fn a_step_that_does_not_exist_is_answered_with_those_that_do() {
    let error = error_of("unknown", "let x = 1;\nlift(mm(3));");
    let text = error.to_string();
    assert!(
        text.starts_with("leg.rhai:2:1")
            && text.contains("nothing is called")
            && text.contains("reconstruct")
    );
}

#[test]
fn a_step_with_the_wrong_things_is_answered_with_how_it_is_written() {
    let text = error_of("wrong", "scan(5);").to_string();
    assert!(text.contains("write scan(path, #{ speed: mm_s(10)"), "{text}");
}

#[test]
fn a_bare_number_has_its_place_in_the_error() {
    let text = error_of("bare", "\n  teach(#{ study: 7 });").to_string();
    assert_eq!(text, "leg.rhai:2:3: teach: `study` is a text; found 7, a bare number without a unit");
}

#[test]
fn a_loop_that_never_ends_is_ended() {
    let error = error_of("endless", "let n = 0;\nloop { n += 1; }");
    assert!(matches!(error, ProtocolError::Endless { .. }), "{error}");
    assert!(error.to_string().contains("never ends"), "{error}");
}

#[test]
fn recursion_without_end_is_an_error_and_no_crash() {
    let text = error_of("recursion", "fn again(n) { again(n + 1) }\nagain(0);").to_string();
    assert!(text.starts_with("leg.rhai:") && text.contains("without end"), "{text}");
}

#[test]
fn a_stop_ends_a_script_between_two_steps() {
    let (session, out) = session("stopped");
    lock(&session).operator().stop();
    let protocol = Protocol { name: "leg.rhai".into(), text: "loop { }".into() };
    let error = run(&protocol, &session).unwrap_err();
    assert!(matches!(error, ProtocolError::Stopped { .. }), "{error}");
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_stop_before_a_step_moves_nothing() {
    let (session, out) = session("stopped-step");
    let wish = crate::session::TeachWish { study: "S".into(), ..Default::default() };
    lock(&session).operator().stop();
    let error = lock(&session).teach(&wish).unwrap_err();
    assert!(error.is_stop(), "{error}");
    lock(&session).close().unwrap();
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    let first = exam.ticks.first().unwrap().commanded;
    assert!(exam.ticks.iter().all(|tick| tick.commanded == first));
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn the_femoral_protocol_can_be_read() {
    let (session, out) = session("femoral");
    let stage = Stage::of(&session);
    engine(&stage, &Operator::new()).compile(FEMORAL).unwrap();
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn protocols_that_come_along_are_found_by_name() {
    for name in ["calibrate", "calibrate.rhai"] {
        let protocol = Protocol::of_library(name).unwrap();
        assert!(protocol.is_calibration() && protocol.name == "calibrate.rhai");
    }
    assert_eq!(Protocol::of_library("femoral"), Some(Protocol::femoral()));
    assert_eq!(Protocol::of_library("tibial"), None);
}
