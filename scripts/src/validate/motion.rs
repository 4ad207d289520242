//! Every commanded motion within the limits, read back from the exam file; the path's error; and the recorded exam
//! that gives the same commands. And the timing of paths: how quick, how near to the optimum.

mod timing;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::Vector3;
use probepath_frames::{Base, Pose, Probe, Stamp, World};
use probepath_robot::motion::follow::{Curve, PoseCurve};
use probepath_robot::{Command, Joints, MotionLimits, Operator, Row};
use probepath_teach_replay::Path as TaughtPath;
use probepath_us_capture::exam::Exam;

use super::bench::{Folder, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::session::{CellFile, Opening, Scan, ScanWish, Session, SessionError, TeachWish, recorded_row};

/// Largest commanded position, velocity, acceleration and jerk, as shares of their limits: 1 is at the limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// Position: distance from the middle of the joint's range, by half the range.
    pub position: f64,
    /// Velocity.
    pub velocity: f64,
    /// Acceleration.
    pub acceleration: f64,
    /// Jerk.
    pub jerk: f64,
}

/// What an exam's commands are, by finite differences over its ticks.
///
/// # Errors
/// When a row is none.
pub fn shares(exam: &Exam, limits: &MotionLimits) -> Result<Shares, SessionError> {
    let dt = exam.header.period.seconds();
    let mut shares = Shares::default();
    let mut past: Vec<Joints> = Vec::new();
    // What came together with a newer state was commanded once.
    for record in exam.ticks.iter().filter(|record| !record.overtaken) {
        let Row { command, state, .. } = recorded_row(record)?;
        let position = match command {
            Command::Position(position) => position,
            // Told to stay, the arm is where it was last told to be.
            Command::Stay | Command::Freedrive => state.commanded,
        };
        past.push(position);
        if past.len() > 4 {
            past.remove(0);
        }
        shares.add(&past, limits, dt);
    }
    Ok(shares)
}

impl Shares {
    /// Takes in the newest of up to four commands.
    fn add(&mut self, past: &[Joints], limits: &MotionLimits, dt: f64) {
        let Some(newest) = past.last() else { return };
        for joint in 0..newest.len() {
            let (low, high) = (limits.lower[joint], limits.upper[joint]);
            let off = (newest[joint] - (low + high) / 2.0).abs() / ((high - low) / 2.0);
            self.position = larger(self.position, off);
            let mut differences: Vec<f64> = past.iter().map(|q| q[joint]).collect();
            let orders = [
                (&mut self.velocity, limits.velocity[joint]),
                (&mut self.acceleration, limits.acceleration[joint]),
                (&mut self.jerk, limits.jerk[joint]),
            ];
            for (share, limit) in orders {
                differences = differences.windows(2).map(|pair| (pair[1] - pair[0]) / dt).collect();
                if let Some(newest) = differences.last() {
                    *share = larger(*share, newest.abs() / limit);
                }
            }
        }
    }
}

/// The larger one; NaN is larger than anything, so that it cannot hide.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Differences of positions that are stored to the last bit still round: third differences over 2 ms cubed by 1e-7.
const ROUNDING: f64 = 1.0 + 1e-6;

/// How often the first seed's path is replayed, for how well a replay repeats itself.
const REPLAYS: usize = 10;
/// A whole validation (ten seeds or more) reads so many ticks back.
const TICKS: u64 = 1_000_000;
/// Seeds that are added for it at most.
const MORE_SEEDS: u64 = 60;
/// The speed from which the operator stops (m/s), and how far along the path.
const STOP_FROM_M_S: f64 = 0.02;
const STOP_AT: f64 = 0.5;

/// What is collected over the seeds.
#[derive(Default)]
struct Columns {
    shares: [Vec<f64>; 4],
    ticks: u64,
    beside_mm: Vec<f64>,
    turned_deg: Vec<f64>,
    repeated_mm: Vec<f64>,
    same: Vec<f64>,
    stopped: [Vec<f64>; 2],
}

/// Teaches and scans each seed's leg, reads the exam back, plays it back, replays and stops.
///
/// # Errors
/// When a session fails, or an exam cannot be read.
pub fn motion(seeds: u64, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let folder = Folder::new("motion")?;
    let wish = ScanWish { look: false, ..ScanWish::default() };
    let mut columns = Columns::default();
    for seed in 1..=seeds {
        tell(progress, "motion", seed - 1, seeds);
        let replays = if seed == 1 { REPLAYS } else { 1 };
        let (exam, replays) = columns.scanned(seed, &wish, replays, folder.path())?;
        columns.replayed(&replays);
        columns.same.push(played_back(&exam, &wish, replays.len(), folder.path()));
        let wrong = |source| ValidateError::Session { seed, source };
        let [rest, limit] = stopped(seed, folder.path()).map_err(wrong)?;
        columns.stopped[0].push(rest);
        columns.stopped[1].push(limit);
    }
    let mut seed = seeds;
    while seeds >= 10 && columns.ticks < TICKS && seed < seeds + MORE_SEEDS {
        seed += 1;
        tell(progress, "motion, ticks", columns.ticks, TICKS);
        columns.scanned(seed, &wish, 1, folder.path())?;
    }
    let mut rows = columns.rows();
    rows.extend(timing::rows());
    Ok(Goals::new("motion: teach and replay along the leg, read back from the exam", seeds, rows))
}

impl Columns {
    /// Teaches one seed, scans it so many times, and reads the limits back.
    fn scanned(
        &mut self,
        seed: u64,
        wish: &ScanWish,
        replays: usize,
        out: &Path,
    ) -> Result<(Exam, Vec<Trace>), ValidateError> {
        let wrong = |source| ValidateError::Session { seed, source };
        let (mut session, path) = taught(seed, out, Operator::new(), Arc::new(())).map_err(wrong)?;
        let scans = (0..replays).map(|_| session.scan(&path, wish)).collect::<Result<Vec<_>, _>>();
        let scans = scans.map_err(wrong)?;
        session.close().map_err(wrong)?;
        let exam = Exam::open(&session.exam_path()).map_err(|source| ValidateError::Exam { seed, source })?;
        let found = shares(&exam, session.motion_limits()).map_err(wrong)?;
        let row = [found.position, found.velocity, found.acceleration, found.jerk];
        for (column, value) in self.shares.iter_mut().zip(row) {
            column.push(value);
        }
        self.ticks += exam.ticks.len() as u64;
        let base_from_world = session.base_from_world();
        let trace = |scan: &Scan| Trace::of(&exam, scan.followed, path.curve(), &base_from_world);
        let traces = scans.iter().map(trace).collect();
        Ok((exam, traces))
    }

    /// How far the replays of one path were from it, and from each other.
    fn replayed(&mut self, traces: &[Trace]) {
        self.beside_mm.extend(traces.iter().map(|trace| trace.rms_mm));
        self.turned_deg.extend(traces.iter().map(|trace| trace.rms_deg));
        if traces.len() > 1 {
            self.repeated_mm.push(apart_mm(traces));
        }
    }

    fn rows(&self) -> Vec<Goal> {
        let [position, velocity, acceleration, jerk] = &self.shares;
        let worst = |values: &[f64]| values.iter().filter(|v| v.is_nan() || **v > ROUNDING).count() as f64;
        let crossed: f64 = self.shares.iter().map(|values| worst(values)).sum();
        let ticks = self.ticks;
        vec![
            Goal::of("commanded position, share of the limit", position, Some(ROUNDING), None),
            Goal::of("commanded velocity, share of the limit", velocity, Some(ROUNDING), None),
            Goal::of("commanded acceleration, share of the limit", acceleration, Some(ROUNDING), None),
            Goal::of("commanded jerk, share of the limit", jerk, Some(ROUNDING), None),
            Goal::of(format!("limits crossed in {ticks} ticks"), &[crossed], Some(0.0), None),
            Goal::of("replay against the smoothed path, RMS, mm", &self.beside_mm, Some(0.2), None),
            Goal::of("replay against the smoothed path, RMS, degrees", &self.turned_deg, Some(0.2), None),
            Goal::of(
                "ten replays, furthest from their mean, mm",
                &self.repeated_mm,
                Some(0.05),
                Some("0.20"),
            ),
            Goal::of("stop at 20 mm/s, word to rest, ms", &self.stopped[0], Some(100.0), None),
            Goal::of("stop at 20 mm/s, share of any limit", &self.stopped[1], Some(ROUNDING), None),
            Goal::of("played back: exams whose commands differ", &self.same, Some(0.0), None),
        ]
    }
}

/// A taught leg of one seed.
fn taught(
    seed: u64,
    out: &Path,
    operator: Operator,
    progress: Arc<dyn Progress>,
) -> Result<(Session, TaughtPath), SessionError> {
    let mut session = Session::open(Opening {
        cell: CellFile::default(),
        seed,
        out: out.to_owned(),
        protocol: Protocol { name: "validate".into(), text: String::new() },
        date: None,
        operator,
        progress,
    })?;
    let path = session.teach(&TeachWish { study: "VALIDATE".into(), ..TeachWish::default() })?;
    Ok((session, path))
}

/// Where the probe was measured to be against the path, while one replay followed it.
struct Trace {
    rms_mm: f64,
    rms_deg: f64,
    /// Every millimetre along: how far beside the path, in Base (m).
    beside: Vec<Vector3<f64>>,
}

/// Distance along the path between two places that are compared (m).
const COMPARED_EVERY: f64 = 0.001;

impl Trace {
    fn of(
        exam: &Exam,
        followed: Option<(Stamp, Stamp)>,
        curve: &PoseCurve,
        base_from_world: &Pose<Base, World>,
    ) -> Self {
        let count = (curve.length() / COMPARED_EVERY) as usize + 1;
        let mut beside = vec![Vector3::repeat(f64::NAN); count];
        let (mut squares, mut turns, mut n, mut near) = (0.0, 0.0, 0.0_f64, 0.0);
        let during = |stamp: Stamp| followed.is_some_and(|(first, last)| first <= stamp && stamp <= last);
        for record in exam.ticks.iter().filter(|record| during(record.stamp)) {
            let Some(world_from_probe) = record.world_from_probe else { continue };
            let pose = *base_from_world * world_from_probe;
            let (along, off) = beside_path(curve, &pose, near);
            near = along;
            let turned = curve.at(along).base_from_probe.distance(&pose).1;
            (squares, turns, n) = (squares + off.norm_squared(), turns + turned * turned, n + 1.0);
            if let Some(place) = beside.get_mut((along / COMPARED_EVERY).round() as usize) {
                *place = off;
            }
        }
        // No tick at all is no number, which keeps no bound.
        let rms = |sum: f64| (sum / n).sqrt();
        Self { rms_mm: 1e3 * rms(squares), rms_deg: rms(turns).to_degrees(), beside }
    }
}

/// The place on the curve nearest to a pose's origin across the probe's axis, and how far beside it the origin is:
/// along the axis the force decides, and along the path the servo's lag is time, not error.
fn beside_path(curve: &PoseCurve, pose: &Pose<Base, Probe>, near: f64) -> (f64, Vector3<f64>) {
    let here = pose.origin().vector();
    let (mut at, mut beside) = (near, Vector3::zeros());
    for _ in 0..6 {
        let point = curve.at(at);
        let axis = point.base_from_probe.z_axis().vector();
        let across = |v: Vector3<f64>| v - axis * v.dot(&axis);
        let off = across(here - point.base_from_probe.origin().vector());
        let forward = across(point.origin[0]);
        let step = off.dot(&forward) / forward.norm_squared().max(1e-12);
        beside = off - forward * step;
        at = (at + step).clamp(0.0, curve.length());
    }
    (at, beside)
}

/// The furthest that any replay is from the mean of them all, anywhere along the path (mm).
fn apart_mm(traces: &[Trace]) -> f64 {
    let places = traces.iter().map(|trace| trace.beside.len()).min().unwrap_or(0);
    // The first and the last centimetre are left out: there the probe is set down and lifted off.
    (10..places.saturating_sub(10)).fold(0.0, |most, k| {
        let known: Vec<_> = traces.iter().map(|trace| trace.beside[k]).filter(|v| !v.x.is_nan()).collect();
        let mean = known.iter().sum::<Vector3<f64>>() / known.len().max(1) as f64;
        known.iter().fold(most, |most, v| larger(most, 1e3 * (v - mean).norm()))
    })
}

/// Stops the scan when it is half way.
struct StopHalfWay {
    operator: Operator,
    told: AtomicU64,
}

impl Progress for StopHalfWay {
    fn at(&self, step: &str, fraction: f64) {
        if step == "scanning" {
            self.told.fetch_add(1, Ordering::SeqCst);
            if fraction > STOP_AT {
                self.operator.stop();
            }
        }
    }
    fn say(&self, _: &str) {}
}

/// Ticks between two words about progress, the first at a motion's first tick.
const TICKS_BETWEEN: u64 = 100;

/// From the operator's word at 20 mm/s to the rest of what is commanded (ms), and the largest share of any limit of
/// the exam it is read from.
fn stopped(seed: u64, out: &Path) -> Result<[f64; 2], SessionError> {
    let operator = Operator::new();
    let watch = Arc::new(StopHalfWay { operator: operator.clone(), told: AtomicU64::new(0) });
    let (mut session, path) = taught(seed, &out.join("stopped"), operator, watch.clone())?;
    let taught_until = session.now();
    let wish = ScanWish { look: false, speed_m_s: STOP_FROM_M_S, ..ScanWish::default() };
    match session.scan(&path, &wish) {
        Err(SessionError::Stopped { .. }) => {}
        Err(other) => return Err(other),
        Ok(_) => return Err(SessionError::Order("the scan was not stopped")),
    }
    session.close()?;
    let exam = Exam::open(&session.exam_path())?;
    let found = shares(&exam, session.motion_limits())?;
    let limit = larger(larger(found.velocity, found.acceleration), found.jerk);
    let first = exam.ticks.iter().position(|record| record.stamp > taught_until).unwrap_or(0);
    let word = first as u64 + TICKS_BETWEEN * watch.told.load(Ordering::SeqCst).saturating_sub(1);
    let last = exam.ticks.last().map(|record| record.commanded);
    let moving =
        exam.ticks.iter().rposition(|record| Some(&record.commanded) != last.as_ref()).unwrap_or(0) as u64;
    // The first tick of the motion may be one or two later than `first`: then the word was as much later, and this
    // is too long by that.
    let ticks = moving.saturating_sub(word) + 1;
    Ok([ticks as f64 * exam.header.period.seconds() * 1e3, limit])
}

/// Gives the recorded states to the same software: 0 when every command is the recorded one, 1 when one differs.
fn played_back(exam: &Exam, wish: &ScanWish, replays: usize, out: &Path) -> f64 {
    let again = || -> Result<(), SessionError> {
        let mut session = Session::open_recorded(
            exam,
            Opening {
                cell: CellFile::default(),
                seed: 0,
                out: out.join("again"),
                protocol: Protocol { name: "validate".into(), text: String::new() },
                date: None,
                operator: Operator::new(),
                progress: Arc::new(()),
            },
        )?;
        let path = session.teach(&TeachWish { study: "VALIDATE".into(), ..TeachWish::default() })?;
        (0..replays).try_for_each(|_| session.scan(&path, wish).map(drop))
    };
    f64::from(u8::from(again().is_err()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jump_of_one_tick_breaks_the_jerk_limit() {
        let one = Joints::splat(1, 1.0);
        let limits = MotionLimits {
            lower: one.map(|_| -1.0),
            upper: one,
            velocity: one,
            acceleration: one.map(|_| 10.0),
            jerk: one.map(|_| 100.0),
        };
        let mut shares = Shares::default();
        let at = |q: f64| Joints::splat(1, q);
        shares.add(&[at(0.0), at(0.0), at(0.0), at(0.0001)], &limits, 0.002);
        // 0.1 mrad in one tick: 0.05 rad/s, 25 rad/s², 12,500 rad/s³.
        assert!((shares.velocity - 0.05).abs() < 1e-9, "{shares:?}");
        assert!((shares.acceleration - 2.5).abs() < 1e-9, "{shares:?}");
        assert!((shares.jerk - 125.0).abs() < 1e-6, "{shares:?}");
    }

    #[test]
    fn a_number_that_is_none_cannot_hide() {
        assert!(larger(1.0, f64::NAN).is_nan() && larger(f64::NAN, 1.0).is_nan());
    }
}
