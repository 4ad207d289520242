//! The whole road in the simulated cell: one scan teaches, replays, captures, reconstructs and reports; the exam it
//! leaves is held against what was promised of it.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use probepath_robot::Operator;
use probepath_scripts::protocol::{self, Protocol};
use probepath_scripts::report::Report;
use probepath_scripts::session::{CellFile, Opening, Session, protocol_of};
use probepath_scripts::validate::shares;
use probepath_scripts::{Progress, ScanRequest, View, offline};
use probepath_us_capture::exam::{Ending, Exam};

/// Teaches the usual way, but scans only the first part of it, past the bifurcation: a minute of leg is for `validate`.
const SHORT: &str = r#"
let path = teach(#{ study: "ROAD-1", side: "left" });
let images = scan(path.trim(mm(20), mm(60)), #{ speed: mm_s(10), force: newton(5), every: mm(0.5) });
report(reconstruct(images), #{ segments: [segment("CFA", mm(0), mm(40))] });
"#;

/// A folder of this test, empty.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-road-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn request(out: &Path, protocol: &str) -> ScanRequest {
    let file = out.join("short.rhai");
    fs::write(&file, protocol).unwrap();
    // A hand that stops after 80 mm: the rest of the leg is for `validate`.
    let cell = out.join("cell.toml");
    fs::write(&cell, "[simulated.hand]\nlength_mm = 80.0\n").unwrap();
    ScanRequest { protocol: Some(file), cell: Some(cell), seed: 5, out: out.to_owned(), date: None }
}

#[test]
fn one_scan_leaves_report_surface_and_an_exam_that_keeps_every_promise() {
    let out = folder("whole");
    let report = request(&out, SHORT).run(&Operator::new(), Arc::new(())).unwrap();
    assert!(report.surface_error_mm.unwrap().mean < 0.40, "{report}");
    assert!(report.force_n.rms_error < 0.3 && report.force_n.overshoot < 1.0, "{report}");
    assert!(report.path.rms_error_mm < 0.3, "{report}");
    assert!(report.images.kept >= 75 && report.images.without_lumen < 8, "{report}");
    for name in ["report.html", "report.json", "lumen.stl", "lumen.ply", "lumen.vtp", "lumen.png"] {
        assert!(fs::metadata(out.join(name)).unwrap().len() > 1000, "{name}");
    }
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    assert_eq!(exam.ending, Ending::Complete);
    assert_eq!(exam.bscans.len(), report.images.kept);
    strangers_read_the_surfaces(&out);
    within_limits(&exam, &out);
    the_same_again_while_somebody_watches(&out, &report);
    played_back(&exam, &out);
    reconstructed_again(&out, &report);
    fs::remove_dir_all(out).unwrap();
}

/// trimesh and VTK find the three surfaces closed, facing outward and equal.
fn strangers_read_the_surfaces(out: &Path) {
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!("skipped: PROBEPATH_PYTHON names no Python with trimesh and vtk (tests/run installs one)");
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/interop/meshes.py");
    let surfaces = ["lumen.stl", "lumen.ply", "lumen.vtp"].map(|name| out.join(name));
    let done = std::process::Command::new(python).arg(script).args(surfaces).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
}

/// Every command of the exam, by finite differences, within the limits of its cell.
fn within_limits(exam: &Exam, out: &Path) {
    let session = open(out.join("limits"), Protocol::femoral());
    let shares = shares(exam, session.motion_limits()).unwrap();
    let most = [shares.position, shares.velocity, shares.acceleration, shares.jerk];
    assert!(most.iter().all(|share| *share <= 1.0 + 1e-6), "{shares:?}");
    assert!(shares.jerk > 0.05, "an exam in which nothing moves: {shares:?}");
}

/// Keeps the last view of the vessel, and what was said.
#[derive(Default)]
struct Watching {
    view: Mutex<Option<View>>,
    said: Mutex<String>,
}

impl Progress for Watching {
    fn at(&self, _: &str, _: f64) {}

    fn say(&self, text: &str) {
        self.said.lock().unwrap().push_str(text);
    }

    fn watches_vessel(&self) -> bool {
        true
    }

    fn vessel(&self, so_far: &View) {
        *self.view.lock().unwrap() = Some(so_far.clone());
    }
}

/// The same seed gives the same exam file, byte for byte, also where somebody watches the vessel grow; and what is
/// watched is the vessel of the report.
fn the_same_again_while_somebody_watches(out: &Path, report: &Report) {
    let again = folder("again");
    let watching = Arc::new(Watching::default());
    request(&again, SHORT).run(&Operator::new(), watching.clone()).unwrap();
    let [one, other] = [out, &again].map(|folder| fs::read(folder.join("exam.mcap")).unwrap());
    assert!(one == other, "{} and {} bytes", one.len(), other.len());
    fs::remove_dir_all(again).unwrap();
    let said = watching.said.lock().unwrap();
    assert!(said.contains("The vessel was shown"), "{said}");
    let view = watching.view.lock().unwrap().clone().unwrap();
    let vessel = view.vessel.unwrap();
    let (seen, whole) = (vessel.narrowest().unwrap().area_mm2, least_area(report));
    assert!((seen / whole - 1.0).abs() < 0.1, "{seen} {whole}");
    assert!(vessel.covered_percent > 90.0, "{}", vessel.covered_percent);
}

/// The narrowest measured section of a report (mm2).
fn least_area(report: &Report) -> f64 {
    report.area_curve.iter().filter_map(|at| at.area_mm2).fold(f64::INFINITY, f64::min)
}

/// A recorded exam given back through the recorded arm gives the same commands: one that differed would end the
/// protocol with its tick and joint.
fn played_back(exam: &Exam, out: &Path) {
    let protocol = protocol_of(exam).unwrap();
    let opening = opening(out.join("played"), protocol.clone());
    let session = Arc::new(Mutex::new(Session::open_recorded(exam, opening).unwrap()));
    protocol::run(&protocol, &session).unwrap();
    let mut session = session.lock().unwrap();
    session.close().unwrap();
    let again = Exam::open(&session.exam_path()).unwrap();
    assert_eq!(again.ticks.len(), exam.ticks.len());
    assert!(again.ticks.iter().zip(&exam.ticks).all(|(a, b)| a.command == b.command));
    // One row with another state, and the commands are no longer the recorded ones.
    let mut other = Exam { ticks: exam.ticks.clone(), bscans: Vec::new(), ..clone_of(exam) };
    let middle = other.ticks.iter().position(|tick| tick.phase == "follow").unwrap() + 500;
    other.ticks[middle].wrench.force.z -= 1.0;
    let opening = self::opening(out.join("differs"), protocol.clone());
    let session = Arc::new(Mutex::new(Session::open_recorded(&other, opening).unwrap()));
    let error = protocol::run(&protocol, &session).unwrap_err().to_string();
    assert!(error.contains("of the recording"), "{error}");
}

/// An exam's header and attachments.
fn clone_of(exam: &Exam) -> Exam {
    Exam {
        header: exam.header.clone(),
        ticks: Vec::new(),
        bscans: Vec::new(),
        events: exam.events.clone(),
        attachments: exam.attachments.clone(),
        metadata: exam.metadata.clone(),
        damaged: Vec::new(),
        ending: exam.ending.clone(),
    }
}

/// `reconstruct` of the exam finds the same stenoses and areas.
fn reconstructed_again(out: &Path, report: &Report) {
    let again = out.join("again");
    let wish = offline::ReconstructWish { input: out.join("exam.mcap"), out: again, ..Default::default() };
    let made = offline::reconstruct(&wish, &()).unwrap();
    let made = made.report.unwrap();
    assert_eq!((&made.stenoses, &made.segments), (&report.stenoses, &report.segments));
    assert_eq!(made.area_curve, report.area_curve);
    assert_eq!(made.force_n, report.force_n);
}

fn opening(out: PathBuf, protocol: Protocol) -> Opening {
    Opening {
        cell: CellFile::default(),
        seed: 5,
        out,
        protocol,
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    }
}

fn open(out: PathBuf, protocol: Protocol) -> Session {
    Session::open(opening(out, protocol)).unwrap()
}

/// Asks for something once a step has come so far.
struct At {
    step: &'static str,
    fraction: f64,
    then: Box<dyn Fn() + Send + Sync>,
}

impl Progress for At {
    fn at(&self, step: &str, fraction: f64) {
        if step == self.step && fraction >= self.fraction {
            (self.then)();
        }
    }

    fn say(&self, _: &str) {}
}

#[test]
fn a_stop_in_the_middle_of_a_scan_leaves_the_arm_at_rest_and_the_exam_readable() {
    // Asked five times a second of exam time: 6 s into the teaching, at the first tick of the replay, on the path.
    for (step, fraction, asks) in [("teaching", 0.0, 30), ("scanning", 0.0, 0), ("scanning", 0.4, 0)] {
        let out = folder(&format!("stop-{step}-{fraction}"));
        let operator = Operator::new();
        let stopping = operator.clone();
        let asked = std::sync::atomic::AtomicUsize::new(0);
        let then = Box::new(move || {
            if asked.fetch_add(1, std::sync::atomic::Ordering::SeqCst) >= asks {
                stopping.stop();
            }
        });
        let error = request(&out, SHORT).run(&operator, Arc::new(At { step, fraction, then })).unwrap_err();
        assert!(error.to_string().contains("stopped by the operator"), "{error}");
        let exam = Exam::open(&out.join("exam.mcap")).unwrap();
        assert_eq!(exam.ending, Ending::Complete);
        at_rest(&exam);
        within_limits(&exam, &out);
        fs::remove_dir_all(out).unwrap();
    }
}

/// The last commands are all the same place.
fn at_rest(exam: &Exam) {
    let last: Vec<_> = exam.ticks.iter().rev().take(3).map(|tick| tick.commanded).collect();
    assert!(last.len() == 3 && last.iter().all(|commanded| *commanded == last[0]), "{last:?}");
}

#[test]
fn a_pause_holds_the_force_and_a_resume_finishes_the_scan() {
    let out = folder("pause");
    let operator = Operator::new();
    let pausing = operator.clone();
    let asked = std::sync::atomic::AtomicUsize::new(0);
    // Asked five times a second of exam time: paused for two seconds, once.
    let then = Box::new(move || match asked.fetch_add(1, std::sync::atomic::Ordering::SeqCst) {
        0 => pausing.pause(),
        10 => pausing.resume(),
        _ => {}
    });
    let progress = Arc::new(At { step: "scanning", fraction: 0.4, then });
    let report = request(&out, SHORT).run(&operator, progress).unwrap();
    assert!(report.force_n.rms_error < 0.3, "{report}");
    assert!(report.images.kept >= 75, "{report}");
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    let follow: Vec<_> = exam.ticks.iter().filter(|tick| tick.phase == "follow").collect();
    let moved = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|i| follow[i].world_from_probe.unwrap().origin());
        a.distance(&b)
    };
    // Somewhere there is a second in which the probe hardly moves along the skin, and force goes on being held.
    let still = (0..follow.len() - 500).step_by(50).map(|i| moved(i, i + 500)).fold(f64::INFINITY, f64::min);
    assert!(still < 0.001, "it moved {still} m");
    within_limits(&exam, &out);
    fs::remove_dir_all(out).unwrap();
}
