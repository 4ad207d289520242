//! Other people's clients, unmodified, drive the simulated controller over its wire: PyPI's ur_rtde and the official
//! RTDE Python client.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test stops at the first surprise")]
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::process::Command;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use probepath_robot::Joints;
use probepath_sim::controller::{ControllerConfig, ControllerServer, Running};
use probepath_sim::{CellConfig, SimulatedCell};
use serde_json::{Value, json};

const PRESS_N: f64 = 5.0;

/// A loopback address of this test alone.
fn host(test: u8) -> IpAddr {
    let pid = std::process::id();
    IpAddr::V4(Ipv4Addr::new(127, 60 + test, (pid / 250 % 250 + 1) as u8, (pid % 250 + 1) as u8))
}

fn serve(test: u8) -> Running {
    let cell = SimulatedCell::new(&CellConfig::default(), 1).unwrap();
    let config = ControllerConfig { host: host(test), unlock_after_s: 1.0, ..ControllerConfig::default() };
    ControllerServer::start(cell, config).unwrap()
}

fn folder(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// What a Python program says; `None` where there is no Python with these clients.
fn python(script: &str, arguments: &[&str]) -> Option<String> {
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!(
            "skipped: PROBEPATH_PYTHON names no Python with ur_rtde and urinterface (tests/run installs one)"
        );
        return None;
    };
    let script = format!("{}/tests/interop/{script}", env!("CARGO_MANIFEST_DIR"));
    let done = Command::new(python).arg("-u").arg(script).args(arguments).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    Some(said)
}

/// Six numbers as the controller writes a pose: in its own base, turned by 180 degrees about z.
fn written(pose: &Isometry3<f64>) -> [f64; 6] {
    let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let (place, turn) = (half * pose.translation.vector, (half * pose.rotation).scaled_axis());
    [place.x, place.y, place.z, turn.x, turn.y, turn.z]
}

/// What our model says of some postures, and what the arm carries.
fn facts(cell: &SimulatedCell) -> Value {
    let nominal = cell.nominal();
    let cases: Vec<Value> = [[0.2, 0.1, -0.1, 0.1, -0.2, 0.3], [-0.15, -0.1, 0.15, -0.2, 0.1, -0.4]]
        .iter()
        .map(|away| {
            let q = nominal.start.zip(&Joints::from_slice(away).unwrap(), |q, away| q + away);
            let flange = written(nominal.model().forward(&q).isometry());
            json!({ "q": q.as_slice(), "flange": flange })
        })
        .collect();
    let (tool, probe) = (cell.config().arm.tool, nominal.flange_from_probe);
    let (place, turn) = (probe.origin().vector(), probe.isometry().rotation.scaled_axis());
    json!({
        "cases": cases,
        "tcp": [place.x, place.y, place.z, turn.x, turn.y, turn.z],
        "mass_kg": tool.mass_kg,
        "centre_m": tool.centre_of_gravity_mm.map(|mm| mm * 1e-3),
        "down_m": 0.12,
        "press_n": PRESS_N,
    })
}

#[test]
fn ur_rtde_drives_the_simulated_controller() {
    let (running, folder) = (serve(0), folder("ur_rtde"));
    let file = folder.join("facts.json");
    std::fs::write(&file, facts(running.cell()).to_string()).unwrap();
    let address = running.host().to_string();
    let Some(said) = python("ur_rtde_drive.py", &[&address, &file.display().to_string()]) else { return };
    eprintln!("{said}{:?}", running.counters());
    // What was read of the force is what truly pressed, at that instant.
    let line = said.lines().find(|line| line.starts_with('{')).expect("what was pressed with");
    let pressed: Value = serde_json::from_str(line).unwrap();
    let at = pressed["at_s"].as_f64().unwrap();
    let moments = running.cell().truth().moments();
    let moment = moments.iter().rfind(|moment| moment.stamp.seconds() <= at + 1e-6).expect("it was then");
    let truth = moment.skin.force.norm();
    assert!((truth - PRESS_N).abs() < 0.5, "read {pressed}, truly {truth:.2} N");
    assert!(running.last_ending().contains("watchdog"), "{}", running.last_ending());
    assert!(running.is_at_rest());
}

#[test]
fn the_official_client_records_from_it() {
    let (running, folder) = (serve(1), folder("rtde_record"));
    let address = running.host().to_string();
    let Some(said) = python("rtde_record.py", &[&address, &folder.display().to_string()]) else { return };
    eprintln!("{said}");
    assert!(running.counters().packages >= 200);
}
