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

use probepath_frames::nalgebra::Vector3;
use probepath_robot::Operator;
use probepath_robot::motion::follow::Curve;
use probepath_scripts::protocol::Protocol;
use probepath_scripts::session::{
    CellFile, ControllerTime, GuideBy, MachineAddress, Opening, Scan, ScanWish, Session, TeachWish,
};
use probepath_sim::controller::{ControllerConfig, ControllerServer, Running, Time};
use probepath_sim::igtl::{self, MachineServer, MachineServerConfig};
use probepath_sim::{CellConfig, SimulatedCell};
use probepath_us_capture::exam::{Attachment, Exam};

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
fn after_a_protective_stop_nothing_moves_until_it_is_recovered_in_words() {
    let out = folder("stopped");
    let (running, file) = served(3);
    let mut session = Session::open(opening(arm_alone(file), &out)).unwrap();
    let path = session.teach(&TeachWish { study: "WIRE-2".into(), ..TeachWish::default() }).unwrap();
    let path = session.trim(&path, 0.01, 0.03).unwrap();
    running.stop_protectively("somebody leans on the arm");
    let wish = ScanWish { look: false, ..ScanWish::default() };
    let error = session.scan(&path, &wish).unwrap_err().to_string();
    assert!(error.contains("stop"), "{error}");
    let again = session.scan(&path, &wish).unwrap_err().to_string();
    assert!(!again.is_empty());
    session.recover().unwrap();
    session.scan(&path, &wish).unwrap();
    session.close().unwrap();
    let exam = Exam::open(&session.exam_path()).unwrap();
    assert!(exam.events.iter().any(|event| event.text.contains("may move again")));
    std::fs::remove_dir_all(out).unwrap();
}
