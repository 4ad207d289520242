//! A stop, a person's yes, and the scan goes on from where it was: slow at first, and through the air.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use probepath_robot::Operator;
use probepath_scripts::protocol::Protocol;
use probepath_scripts::report::Report;
use probepath_scripts::session::{CellFile, Opening, Session};
use probepath_scripts::validate::shares;
use probepath_scripts::{Progress, ScanError, ScanRequest};
use probepath_us_capture::exam::{Exam, TickRecord};

/// Goes on after any stop, as often as somebody says yes.
const GOES_ON: &str = r#"
let path = teach(#{ study: "SAFE-1", side: "left" }).trim(mm(20), mm(50));
let images = ();
try { images = scan(path, #{ speed: mm_s(10), force: newton(5), every: mm(0.5) }); }
catch (why) { print(`stopped: ${why}`); confirm(); images = resume(); }
report(reconstruct(images));
"#;

const CELL: &str = "[simulated.hand]\nlength_mm = 80.0\n";

pub(crate) fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-safety-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// Stops once, somewhere along the path, and says yes or no.
struct Person {
    operator: Operator,
    stops_at: f64,
    says: bool,
    stopped: AtomicUsize,
    asked: AtomicUsize,
}

impl Person {
    fn new(stops_at: f64, says: bool) -> Arc<Self> {
        let (stopped, asked) = (AtomicUsize::new(0), AtomicUsize::new(0));
        Arc::new(Self { operator: Operator::new(), stops_at, says, stopped, asked })
    }
}

impl Progress for Person {
    fn at(&self, step: &str, fraction: f64) {
        let there = step == "scanning" && fraction >= self.stops_at;
        if there && self.stopped.fetch_add(1, Ordering::SeqCst) == 0 {
            self.operator.stop();
        }
    }

    fn say(&self, _: &str) {}

    fn confirm(&self, question: &str) -> bool {
        assert!(question.contains("stopped") && question.contains("lift"), "{question}");
        self.asked.fetch_add(1, Ordering::SeqCst);
        self.says
    }
}

fn scanned(out: &Path, cell: &str, person: &Arc<Person>) -> Result<Report, ScanError> {
    fs::write(out.join("goes-on.rhai"), GOES_ON).unwrap();
    fs::write(out.join("cell.toml"), cell).unwrap();
    let (protocol, cell) = (Some(out.join("goes-on.rhai")), Some(out.join("cell.toml")));
    let request = ScanRequest { protocol, cell, seed: 5, out: out.to_owned(), date: None };
    request.run(&person.operator, person.clone())
}

fn exam(out: &Path) -> Exam {
    Exam::open(&out.join("exam.mcap")).unwrap()
}

fn within_limits(exam: &Exam, out: &Path) {
    let opening = Opening {
        cell: CellFile::default(),
        seed: 5,
        out: out.join("limits"),
        protocol: Protocol { name: "none".into(), text: String::new() },
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    };
    let found = shares(exam, Session::open(opening).unwrap().motion_limits()).unwrap();
    let most = [found.position, found.velocity, found.acceleration, found.jerk];
    assert!(most.iter().all(|share| *share <= 1.0 + 1e-6), "{found:?}");
}

fn place(tick: &TickRecord) -> probepath_frames::Point<probepath_frames::World> {
    tick.world_from_probe.unwrap().origin()
}

/// What came after the confirmation: off the skin slowly, then through the air, slow at first, then the rest of the path.
fn went_on_slowly(exam: &Exam) {
    let confirmed = exam.ticks.iter().rposition(|tick| tick.phase == "confirm").unwrap();
    let after: Vec<&TickRecord> = exam.ticks[confirmed + 1..].iter().collect();
    let begins = after.iter().position(|tick| tick.phase == "approach").unwrap();
    // Over 50 ms: the measured place has noise.
    let speed = |i: usize| place(after[i]).distance(&place(after[i - 25])) / 0.05;
    let first = (begins + 25..begins + 500).map(speed).fold(0.0, f64::max);
    assert!(first > 0.0003 && first < 0.030, "{first} m/s in the first second after the confirmation");
    let at_once = (begins + 25..begins + 75).map(speed).fold(0.0, f64::max);
    assert!(at_once <= 0.0125, "{at_once} m/s at first");
    let before = exam.ticks[..confirmed].iter().rev().find(|tick| tick.phase == "lift").unwrap();
    assert!(before.wrench.force.z.abs() < 1.0, "the probe was off the skin when it went on: {before:?}");
    assert!(after.iter().any(|tick| tick.phase == "follow"));
}

/// No hole in what was followed: the skin's length from the first to the last image, and a neighbour for each.
fn nothing_is_left_out(exam: &Exam, report: &Report) {
    let follow: Vec<_> = exam.ticks.iter().filter(|tick| tick.phase == "follow").map(place).collect();
    let longest = follow.windows(2).map(|pair| pair[0].distance(&pair[1])).fold(0.0, f64::max);
    assert!(longest < 0.003, "the path goes on {} mm from where it was", longest * 1e3);
    assert!(report.images.kept >= 55 && report.images.kept <= 70, "{report}");
    assert!(report.surface_error_mm.as_ref().unwrap().mean < 0.45, "{report}");
}

#[test]
fn after_the_operators_stop_and_a_yes_the_scan_goes_on_from_where_it_was() {
    let out = folder("operator");
    let person = Person::new(0.5, true);
    let report = scanned(&out, CELL, &person).unwrap();
    assert_eq!(person.asked.load(Ordering::SeqCst), 1);
    let exam = exam(&out);
    went_on_slowly(&exam);
    nothing_is_left_out(&exam, &report);
    within_limits(&exam, &out);
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn without_a_yes_nothing_moves_again_and_the_reason_is_said() {
    let out = folder("no");
    let person = Person::new(0.5, false);
    let error = scanned(&out, CELL, &person).unwrap_err().to_string();
    assert!(error.contains("nobody said yes") && error.contains("goes-on.rhai:"), "{error}");
    let exam = exam(&out);
    let last: Vec<_> = exam.ticks.iter().rev().take(3).collect();
    assert!(last.iter().all(|tick| tick.commanded == last[0].commanded));
    assert_eq!(last[0].phase, "follow", "it rests where the stop left it");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn after_the_arms_own_stop_and_a_yes_the_scan_goes_on_too() {
    let out = folder("itself");
    let nobody = Person::new(f64::INFINITY, true);
    scanned(&out, CELL, &nobody).unwrap();
    // The same cell does the same again: this tick is in the middle of the path.
    let follow: Vec<_> = exam(&out).ticks.into_iter().filter(|tick| tick.phase == "follow").collect();
    let tick = follow[follow.len() / 2].tick;
    fs::remove_dir_all(out).unwrap();
    let knobs = [
        format!("protective_stop_at_tick = {tick}"),
        format!("connection_lost_at_tick = {tick}"),
        format!("skipped = {{ from_tick = {tick}, count = 20 }}"),
    ];
    for knob in knobs {
        let out = folder("itself");
        let person = Person::new(f64::INFINITY, true);
        let report = scanned(&out, &format!("{CELL}[simulated.knobs.arm]\n{knob}\n"), &person).unwrap();
        assert_eq!(person.asked.load(Ordering::SeqCst), 1, "{knob}");
        let exam = exam(&out);
        went_on_slowly(&exam);
        nothing_is_left_out(&exam, &report);
        fs::remove_dir_all(out).unwrap();
    }
}
