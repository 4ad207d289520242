//! The same exam over the wire: a cell that is simulated in this process, and the same cell behind its controller's
//! sockets, taught and scanned by the same session.
//!
//! "The same" is: the same path was taught, the same force was held, as many B-scans were kept. The bytes differ, because
//! over the wire a command takes effect a tick later, through `servoj` with its lookahead, and the clock is the
//! controller's. The controller's time is simulated: it waits for every command, so nothing here depends on how fast this
//! computer is.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]
#![allow(clippy::print_stderr, reason = "a test says what it measured")]

use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use probepath_frames::nalgebra::Vector3;
use probepath_robot::motion::follow::Curve;
use probepath_robot::{Joints, Operator};
use probepath_scripts::Progress;
use probepath_scripts::protocol::Protocol;
use probepath_scripts::session::{
    ArmRequest, CellFile, ControllerTime, GuideBy, MachineAddress, Opening, Scan, ScanWish, Session,
    TeachWish,
};
use probepath_sim::controller::{ControllerConfig, ControllerServer, Running, Time};
use probepath_sim::igtl::{self, MachineServer, MachineServerConfig};
use probepath_sim::{CellConfig, SimulatedCell};
use probepath_us_capture::exam::{Attachment, Exam, TickRecord};

const SEED: u64 = 5;

/// A loopback address of this process and test: controllers always have their own ports.
fn host(test: u8) -> IpAddr {
    let pid = std::process::id();
    let part = |n: u32| u8::try_from(n % 250 + 1).unwrap();
    IpAddr::V4(Ipv4Addr::new(127, 60 + test, part(pid / 250), part(pid)))
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-wire-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    path
}

/// A leg, and a hand that stops after 60 mm.
fn simulated() -> CellFile {
    let mut simulated = CellConfig::default();
    simulated.hand.length_mm = 60.0;
    CellFile { simulated, ..CellFile::default() }
}

/// The same cell behind its controller, and the file to scan it with.
fn served(test: u8) -> (Running, CellFile) {
    let cell = SimulatedCell::new(&simulated().simulated, SEED).unwrap();
    let file = CellFile::of_served("served", &cell, host(test), ControllerTime::Simulated);
    let config = ControllerConfig { host: host(test), time: Time::Simulated, ..ControllerConfig::default() };
    (ControllerServer::start(cell, config).unwrap(), file)
}

/// Its ultrasound machine beside it.
fn with_machine(running: &Running) -> igtl::Running {
    let config = MachineServerConfig { host: running.host(), time: Time::Simulated, ..Default::default() };
    MachineServer::start(running.cell(), config).unwrap()
}

fn arm_alone(mut file: CellFile) -> CellFile {
    file.machine = Default::default();
    file.machine.address = MachineAddress::None;
    file
}

fn opening(cell: CellFile, out: &Path) -> Opening {
    Opening {
        cell,
        seed: SEED,
        out: out.to_owned(),
        protocol: Protocol { name: "wire".into(), text: String::new() },
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    }
}

/// Says yes, until told otherwise.
struct Person {
    says_yes: Arc<AtomicBool>,
}

impl Default for Person {
    fn default() -> Self {
        Self { says_yes: Arc::new(AtomicBool::new(true)) }
    }
}

impl Progress for Person {
    fn at(&self, _: &str, _: f64) {}

    fn say(&self, _: &str) {}

    fn confirm(&self, question: &str) -> bool {
        assert!(question.ends_with('?'), "{question}");
        self.says_yes.load(Ordering::SeqCst)
    }
}

/// What a taught and scanned cell left.
struct Road {
    /// The taught path, every millimetre (m).
    taught: Vec<Vector3<f64>>,
    scan: Scan,
    exam: Exam,
}

fn taught_and_scanned(cell: CellFile, by: GuideBy, look: bool, out: &Path) -> Road {
    let mut session = Session::open(opening(cell, out)).unwrap();
    let path = session.teach(&TeachWish { study: "WIRE-1".into(), by, ..TeachWish::default() }).unwrap();
    let (curve, steps) = (path.curve(), (path.length() * 1e3) as usize);
    let taught = (0..=steps).map(|mm| curve.at(mm as f64 * 1e-3).base_from_probe.origin().vector()).collect();
    let path = session.trim(&path, 0.01, 0.04).unwrap();
    let scan = session.scan(&path, &ScanWish { look, ..ScanWish::default() }).unwrap();
    if look {
        let lumen = session.reconstruct(&scan, None).unwrap();
        session.report(&lumen, &Default::default()).unwrap();
    }
    session.close().unwrap();
    let exam = Exam::open(&session.exam_path()).unwrap();
    Road { taught, scan, exam }
}

/// How far points are from a path at most, ends aside (m).
fn furthest(points: &[Vector3<f64>], path: &[Vector3<f64>]) -> f64 {
    let inner = &points[3..points.len() - 3];
    let to_segment = |p: &Vector3<f64>, a: &Vector3<f64>, b: &Vector3<f64>| {
        let ab = b - a;
        let t = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
        (p - a - ab * t).norm()
    };
    let nearest = |p: &Vector3<f64>| {
        path.windows(2).map(|ab| to_segment(p, &ab[0], &ab[1])).fold(f64::INFINITY, f64::min)
    };
    inner.iter().map(nearest).fold(0.0, f64::max)
}

#[test]
fn the_same_path_is_taught_the_same_force_held_and_as_many_bscans_kept_over_the_wire() {
    let (near, far) = (folder("near"), folder("far"));
    let here = taught_and_scanned(simulated(), GuideBy::Compliance, true, &near);
    let (running, file) = served(0);
    let machine = with_machine(&running);
    let there = taught_and_scanned(file, GuideBy::Compliance, true, &far);
    let off_m = furthest(&there.taught, &here.taught);
    let force = [&here, &there].map(|road| road.scan.figures.force_n);
    let path = [&here, &there].map(|road| road.scan.figures.path.rms_error_mm);
    eprintln!("taught {off_m} m apart, force {force:?}, path {path:?} mm");
    assert!(off_m < 1e-3, "{off_m}");
    assert!((force[0].rms_error - force[1].rms_error).abs() < 0.1, "{force:?}");
    assert!(force[1].rms_error < 0.3 && force[1].overshoot < 1.0, "{force:?}");
    assert!(path[1] < 0.3, "{path:?}");
    // The controller's clock, whole ticks of it, none skipped.
    assert!(there.exam.ticks[0].stamp.seconds() > 40.0);
    assert_eq!(there.exam.header.seed, None);
    assert!(there.exam.attachment(Attachment::URDF).is_some());
    assert!(running.is_at_rest());
    let kept = [&here, &there].map(|road| road.scan.images.len());
    assert!(kept[0] > 55 && kept[0].abs_diff(kept[1]) <= 2, "{kept:?}");
    assert_eq!(there.exam.bscans.len(), kept[1]);
    assert!(machine.sent().pictures > 60);
    for name in ["report.html", "report.json", "lumen.stl"] {
        assert!(std::fs::metadata(far.join(name)).unwrap().len() > 1000, "{name}");
    }
    [near, far].iter().for_each(|out| std::fs::remove_dir_all(out).unwrap());
}

#[test]
fn an_exam_of_the_wire_played_back_gives_the_same_commands_with_nobody_at_the_wire() {
    let (out, again) = (folder("record"), folder("again"));
    let (running, file) = served(1);
    let recorded = taught_and_scanned(arm_alone(file), GuideBy::Compliance, false, &out);
    drop(running);
    let mut session = Session::open_recorded(&recorded.exam, opening(CellFile::default(), &again)).unwrap();
    let path = session.teach(&TeachWish { study: "WIRE-1".into(), ..TeachWish::default() }).unwrap();
    let path = session.trim(&path, 0.01, 0.04).unwrap();
    session.scan(&path, &ScanWish { look: false, ..ScanWish::default() }).unwrap();
    session.close().unwrap();
    let played = Exam::open(&session.exam_path()).unwrap();
    assert_eq!(played.ticks.len(), recorded.exam.ticks.len());
    assert!(played.ticks.iter().zip(&recorded.exam.ticks).all(|(a, b)| a.command == b.command));
    [out, again].iter().for_each(|out| std::fs::remove_dir_all(out).unwrap());
}

#[test]
fn the_arm_gives_way_by_its_own_means_and_the_same_path_is_taught() {
    let (near, far) = (folder("compliance"), folder("freedrive"));
    let here = taught_and_scanned(arm_alone(simulated()), GuideBy::Compliance, false, &near);
    let (_running, file) = served(2);
    let there = taught_and_scanned(arm_alone(file), GuideBy::Freedrive, false, &far);
    // Where the hand begins and ends is another place each time: the middle counts.
    let middle = there.taught.get(10..there.taught.len() - 10).unwrap();
    let off_m = furthest(middle, &here.taught);
    eprintln!(
        "taught by freedrive {off_m} m from the one by compliance; force {:?}",
        there.scan.figures.force_n
    );
    assert!(there.exam.ticks.iter().any(|tick| tick.freedrive && tick.phase == "freedrive"));
    assert!(off_m < 8e-3, "{off_m}");
    [near, far].iter().for_each(|out| std::fs::remove_dir_all(out).unwrap());
}

#[test]
fn what_lies_between_both_ways_of_giving_way_is_the_hands_unsteadiness() {
    // The same hand without it: what is left is how each arm resists.
    let steady = |unsteadiness: f64, by: GuideBy, name: &str| {
        let out = folder(name);
        let mut cell = arm_alone(simulated());
        (cell.simulated.hand.unsteadiness, cell.simulated.hand.mishaps) = (unsteadiness, false);
        let road = taught_and_scanned(cell, by, false, &out);
        std::fs::remove_dir_all(out).unwrap();
        road.taught
    };
    let off = |unsteadiness: f64| {
        let here = steady(unsteadiness, GuideBy::Compliance, "steady-here");
        let there = steady(unsteadiness, GuideBy::Freedrive, "steady-there");
        furthest(there.get(10..there.len() - 10).unwrap(), &here)
    };
    let (steady, unsteady) = (off(0.0), off(1.0));
    eprintln!("freedrive beside compliance: {steady} m with a steady hand, {unsteady} m with a usual one");
    assert!(steady < 2e-3 && steady < unsteady, "{steady} {unsteady}");
}

#[test]
fn after_a_protective_stop_nothing_moves_until_it_is_recovered_in_words() {
    let out = folder("stopped");
    let (running, file) = served(3);
    let person = Arc::new(Person::default());
    let says_yes = Arc::clone(&person.says_yes);
    let mut session = Session::open(Opening { progress: person, ..opening(arm_alone(file), &out) }).unwrap();
    let path = session.teach(&TeachWish { study: "WIRE-2".into(), ..TeachWish::default() }).unwrap();
    let path = session.trim(&path, 0.01, 0.03).unwrap();
    running.stop_protectively("somebody leans on the arm");
    let wish = ScanWish { look: false, ..ScanWish::default() };
    let error = session.scan(&path, &wish).unwrap_err().to_string();
    assert!(error.contains("stop"), "{error}");
    let again = session.scan(&path, &wish).unwrap_err().to_string();
    assert!(!again.is_empty());
    says_yes.store(false, Ordering::SeqCst);
    let refused = session.recover().unwrap_err().to_string();
    assert!(refused.contains("nobody said yes"), "{refused}");
    says_yes.store(true, Ordering::SeqCst);
    session.recover().unwrap();
    session.scan(&path, &wish).unwrap();
    session.close().unwrap();
    let exam = Exam::open(&session.exam_path()).unwrap();
    assert!(exam.events.iter().any(|event| event.text.contains("may move again")));
    std::fs::remove_dir_all(out).unwrap();
}

/// The probe's speeds, commanded, from tick to tick (m/s).
fn speeds(exam: &Exam, phase: &str) -> Vec<f64> {
    let model = probepath_robot::Model::ur5e();
    let place = |tick: &TickRecord| {
        let joints = Joints::from_slice(tick.command.as_ref().unwrap_or(&tick.commanded).as_slice()).unwrap();
        model.forward(&joints).origin()
    };
    let ticks: Vec<&TickRecord> = exam.ticks.iter().filter(|tick| tick.phase == phase).collect();
    ticks.windows(2).map(|pair| place(pair[0]).distance(&place(pair[1])) / 0.002).collect()
}

#[test]
fn right_after_a_recovery_a_path_is_taught_slowly_at_first() {
    let out = folder("taught-after");
    let (running, file) = served(4);
    let person = Arc::new(Person::default());
    let mut session = Session::open(Opening { progress: person, ..opening(arm_alone(file), &out) }).unwrap();
    running.stop_protectively("somebody leans on the arm");
    let wish = TeachWish { study: "WIRE-3".into(), ..TeachWish::default() };
    assert!(session.teach(&wish).is_err());
    session.recover().unwrap();
    let path = session.teach(&wish).unwrap();
    assert!(path.length() > 0.03, "{}", path.length());
    session.close().unwrap();
    let taught = speeds(&Exam::open(&session.exam_path()).unwrap(), "teach");
    let first = taught.iter().position(|speed| *speed > 1e-5).unwrap();
    let most = |speeds: &[f64]| speeds.iter().fold(0.0_f64, |most, speed| most.max(*speed));
    let (at_first, later) = (most(&taught[..first + 250]), most(&taught));
    eprintln!("taught at {at_first} m/s in the first half second of motion, at {later} m/s later");
    assert!(later > at_first && at_first < 0.012 * (first as f64 * 0.002 + 0.5).exp());
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn what_the_arm_carries_is_found_by_turning_the_probe_and_an_arm_that_stopped_is_unlocked_on_a_word() {
    let out = folder("tool");
    let (running, mut file) = served(5);
    // Truly 0.85 kg at 6, 0, 70 mm.
    (file.arm.payload_kg, file.arm.centre_of_gravity_mm) = (Some(0.65), Some([0.0, 10.0, 60.0]));
    std::fs::create_dir_all(&out).unwrap();
    std::fs::write(out.join("cell.toml"), file.text().unwrap()).unwrap();
    let request = ArmRequest { address: None, cell: Some(out.join("cell.toml")) };
    let person = Arc::new(Person::default());
    let found = request.identify_tool(out.join("exam"), &Operator::new(), person.clone()).unwrap();
    eprintln!("{found}");
    let [x, y, z] = found.centre_of_gravity_mm.unwrap();
    assert!((found.mass_kg - 0.85).abs() < 0.01, "{found}");
    assert!((x - 6.0).abs() < 2.0 && y.abs() < 2.0 && (z - 70.0).abs() < 2.0, "{found}");
    assert!(found.poses >= 6 && found.mass_error_kg < 0.01, "{found}");

    running.stop_protectively("somebody leans on the arm");
    let refused = request.recover(&()).unwrap_err().to_string();
    assert!(refused.contains("nobody said yes"), "{refused}");
    let recovered = request.recover(&*person).unwrap();
    assert!(recovered.to_string().contains("unlocked") && recovered.joints.len() == 6, "{recovered}");
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn a_sensor_that_drifts_is_told_of_after_the_scan_and_zeroed_in_the_air() {
    let out = folder("drift");
    let mut cell = arm_alone(simulated());
    cell.simulated.sensor.drift_n_min = 2.0;
    let mut session = Session::open(opening(cell, &out)).unwrap();
    let path = session.teach(&TeachWish { study: "DRIFT".into(), ..TeachWish::default() }).unwrap();
    let path = session.trim(&path, 0.01, 0.04).unwrap();
    session.scan(&path, &ScanWish { look: false, ..ScanWish::default() }).unwrap();
    session.close().unwrap();
    let exam = Exam::open(&session.exam_path()).unwrap();
    let told: Vec<&str> = exam.events.iter().map(|event| event.text.as_str()).collect();
    assert!(told.iter().any(|text| text.contains("force sensor")), "{told:?}");
    std::fs::remove_dir_all(out).unwrap();
}
