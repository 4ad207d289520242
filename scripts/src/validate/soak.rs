//! The soak: minutes of replay on the wire beside image capture and recording, and what was lost.
//!
//! The simulated cell is served by a process of its own; on the other end of the wire is the session as it drives
//! hardware: driver, control thread, capture and exam file. What was lost is judged by the senders' own numbers, read
//! back from the exam.

mod served;

use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use probepath_frames::{Span, Stamp};
use probepath_robot::Operator;
use probepath_robot::realtime::{Clock, Figures, Histogram, Monotonic, TimingFigures, be_realtime};
use probepath_sim::CellConfig;
use probepath_sim::controller::Time;
use probepath_us_capture::Counts;
use probepath_us_capture::exam::{Ending, ExamEvent, ExamReader, Level, TickRecord, Written};
use serde::Deserialize;

use super::bench::{Folder, tell};
use super::{Goal, Goals, ValidateError};
use crate::offline;
use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::session::{CellFile, Opening, PUNCTUAL, ScanWish, Session, SessionError, TeachWish};
use served::Served;

/// What is soaked.
#[derive(Clone, Debug)]
pub struct SoakWish {
    /// The program `probepath`, which serves the cell.
    pub probepath: PathBuf,
    /// For at least so long by the cell's clock (s), whole scans.
    pub seconds: f64,
    /// The wall's time, or simulated.
    pub time: Time,
    /// Where the simulated cell is served.
    pub host: IpAddr,
    /// The cell.
    pub cell: CellConfig,
}

impl SoakWish {
    /// In the wall's time, served by `probepath` on an address of this process's own.
    pub fn wall(probepath: PathBuf, minutes: f64) -> Self {
        let process = std::process::id();
        let part = |n: u32| u8::try_from(n % 250 + 1).unwrap_or(1);
        let host = IpAddr::V4(Ipv4Addr::new(127, 21, part(process / 250), part(process)));
        Self { probepath, seconds: minutes * 60.0, time: Time::Wall, host, cell: CellConfig::default() }
    }
}

/// The seed of the cell: one is enough, nothing here is an average over legs.
const SEED: u64 = 1;

/// Teaches once, then replays for as long as is wished.
///
/// # Errors
/// When the cell cannot be served, a session fails, or the exam cannot be read back.
pub fn soak(wish: &SoakWish, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    let folder = Folder::new("soak")?;
    let wrong = |source| ValidateError::Session { seed: SEED, source };
    let served = Served::start(&wish.probepath, &wish.cell, (SEED, wish.host, wish.time), folder.path())?;
    let cell = served.wire().map_err(wrong)?;
    let enough = AtomicBool::new(false);
    let (ran, bare) = std::thread::scope(|scope| {
        let bare = (wish.time == Time::Wall).then(|| scope.spawn(|| bare_sleep(&enough)));
        let ran = run(wish.seconds, cell, folder.path(), progress);
        enough.store(true, Ordering::Relaxed);
        (ran, bare.and_then(|bare| bare.join().ok()))
    });
    let (ran, served) = (ran.map_err(wrong)?, served.end()?);
    let found = Found::of(&ran.exam).map_err(|source| ValidateError::Exam { seed: SEED, source })?;
    let rows = rows(&ran, &found, &served, bare.as_ref());
    let what = format!("soak: {:.0} s of replay on the wire beside image capture and recording", ran.seconds);
    Ok(Goals::new(&what, 1, rows))
}

/// What the session did.
struct Ran {
    exam: std::path::PathBuf,
    written: Written,
    seconds: f64,
    counts: Vec<Counts>,
    kept: usize,
    /// What the process held after the first scan and after the last (bytes).
    memory: Option<(u64, u64)>,
    /// How long the processors stood still meanwhile because the machine under a virtual one had other work (s).
    stolen_s: Option<f64>,
}

fn run(seconds: f64, cell: CellFile, out: &Path, progress: &dyn Progress) -> Result<Ran, SessionError> {
    let mut session = Session::open(Opening {
        cell,
        seed: SEED,
        out: out.to_owned(),
        protocol: Protocol { name: "soak".into(), text: String::new() },
        date: None,
        operator: Operator::new(),
        progress: Arc::new(()),
    })?;
    let path = session.teach(&TeachWish { study: "SOAK".into(), ..TeachWish::default() })?;
    let scan = ScanWish { every_m: Some(KEPT_EVERY_M), ..ScanWish::default() };
    let (began, mut counts, mut kept, mut before) = (session.now(), Vec::new(), 0, None);
    let stolen = stolen_s();
    while (session.now() - began).seconds() < seconds {
        tell(progress, "soak", (session.now() - began).seconds() as u64, seconds.ceil() as u64);
        let scanned = session.scan(&path, &scan)?;
        counts.push(scanned.counts);
        kept += scanned.images.len();
        before = before.or_else(memory);
    }
    let (seconds, memory) = ((session.now() - began).seconds(), before.zip(memory()));
    let stolen_s = stolen.zip(stolen_s()).map(|(before, after)| after - before);
    let written = session.close()?.unwrap_or_default();
    Ok(Ran { exam: session.exam_path(), written, seconds, counts, kept, memory, stolen_s })
}

/// A B-scan is kept every 2 mm: ten minutes are then less than a gigabyte. Every one is taken and counted all the same.
const KEPT_EVERY_M: f64 = 0.002;

/// What the exam holds, read as anybody reads it.
#[derive(Default)]
struct Found {
    ticks: u64,
    bscans: u64,
    /// Ticks that came together with a newer one.
    overtaken: u64,
    /// Ticks of the arm that are missing between two that are there, while a motion ran.
    missing: u64,
    /// What the recording says went wrong, and what is damaged.
    complaints: u64,
    punctual: Option<Punctual>,
}

/// The part of the session's own figures that is judged here.
#[derive(Deserialize)]
struct Punctual {
    unseen_ticks: u64,
    figures: TimingFigures,
}

impl Found {
    fn of(exam: &Path) -> Result<Self, probepath_us_capture::exam::ExamError> {
        let mut reader = ExamReader::open(exam)?;
        let (mut found, mut last) = (Self::default(), None::<Seen>);
        while let Some(event) = reader.next_event()? {
            match event {
                ExamEvent::Tick(tick) => {
                    found.ticks += 1;
                    found.overtaken += u64::from(tick.overtaken);
                    let now = Seen::of(&tick);
                    found.missing += last.replace(now.clone()).map_or(0, |last| last.gap_to(&now));
                }
                ExamEvent::BScan(_) => found.bscans += 1,
                ExamEvent::Event(event) => found.complaints += u64::from(event.level == Level::Error),
                ExamEvent::Damaged { .. } => found.complaints += 1,
                ExamEvent::Attachment(file) if file.name == PUNCTUAL => {
                    found.punctual = serde_json::from_slice(&file.bytes).ok();
                }
                _ => {}
            }
        }
        found.complaints += u64::from(reader.ending() != Some(&Ending::Complete));
        Ok(found)
    }
}

/// A tick, as far as it tells whether one is missing before it.
#[derive(Clone)]
struct Seen {
    tick: u64,
    phase: std::borrow::Cow<'static, str>,
    /// Whether the arm was told to stay.
    stays: bool,
}

impl Seen {
    fn of(record: &TickRecord) -> Self {
        let stays = record.command.is_none() && !record.freedrive;
        Self { tick: record.tick, phase: record.phase.clone(), stays }
    }

    /// Ticks missing until the next one while a motion ran: between motions the arm stays, and nobody listens to it.
    fn gap_to(&self, next: &Self) -> u64 {
        let moves = self.phase == next.phase && self.phase != "plan" && !(self.stays && next.stays);
        if moves { next.tick.saturating_sub(self.tick).saturating_sub(1) } else { 0 }
    }
}

fn rows(ran: &Ran, found: &Found, served: &offline::Served, bare: Option<&Histogram>) -> Vec<Goal> {
    let (arm, machine) = (&served.controller, &served.machine);
    let none = |figure: &str, count: u64| Goal::of(figure, &[count as f64], Some(0.0), None);
    let told = |figure: &str, value: f64| Goal::of(figure, &[value], None, None);
    let of = |count: fn(&Counts) -> u64| ran.counts.iter().map(count).sum::<u64>();
    let differ = ran.written.ticks.abs_diff(found.ticks) + ran.written.bscans.abs_diff(found.bscans);
    let mut rows = vec![
        none("ticks missing in the exam while a motion ran", found.missing),
        none("B-scans lost, by the machine's own numbers", of(|c| c.lost + c.out_of_order)),
        none("B-scans kept and not in the exam", found.bscans.abs_diff(ran.kept as u64)),
        none("records written and not read back", differ),
        none("complaints of the recording, damaged records", found.complaints),
        told("ticks in the exam", found.ticks as f64),
        told("B-scans that arrived while it was looked", of(|c| c.arrived) as f64),
        told("B-scans in the exam", found.bscans as f64),
        told("scans", ran.counts.len() as f64),
        told("sent: ticks of the controller", arm.ticks as f64),
        told("sent: packages that it skipped", arm.skipped as f64),
        told("sent: slips of its clock against the wall", arm.slips as f64),
        told("sent: B-scans", machine.pictures as f64),
        told("sent: B-scans too old to be", machine.stale as f64),
    ];
    if let Some(punctual) = &found.punctual {
        rows.push(none("ticks that nobody watched", punctual.unseen_ticks));
        rows.push(none("ticks skipped, by the arm's count", punctual.figures.skipped));
        let overtaken = found.overtaken as f64;
        rows.push(told(
            "ticks that came together with a newer one, recorded and not commanded upon",
            overtaken,
        ));
        rows.extend(timing(&punctual.figures, bare.and_then(Histogram::figures).as_ref()));
    }
    rows.extend(lateness("sent: ticks begun late", served.ticks_begun));
    rows.extend(lateness("sent: packages left late", served.packages_left));
    if let Some((before, after)) = ran.memory {
        rows.push(told("memory grown since the first scan, MB", (after as f64 - before as f64) / 1e6));
    }
    if let Some(stolen_s) = ran.stolen_s {
        rows.push(told("processor time that went to others than this (virtual) machine, s", stolen_s));
    }
    rows
}

/// The figures of punctuality, and the lateness over that of a loop that only sleeps.
fn timing(figures: &TimingFigures, bare: Option<&Figures>) -> Vec<Goal> {
    let named =
        [("tick lateness", figures.lateness), ("step", figures.step), ("round trip", figures.round_trip)];
    let mut rows = Vec::new();
    for (name, found) in named.into_iter().chain([("a bare sleep's lateness", bare.copied())]) {
        rows.extend(lateness(name, found));
    }
    if let Some((ours, bare)) = figures.lateness.as_ref().zip(bare) {
        let pairs = shares(ours).into_iter().zip(shares(bare));
        rows.extend(pairs.map(|((which, ours), (_, bare))| {
            Goal::of(format!("tick lateness over the bare sleep's, {which}"), &[ours / bare], None, None)
        }));
    }
    rows
}

fn lateness(name: &str, found: Option<Figures>) -> impl Iterator<Item = Goal> {
    let each = found.map(|found| shares(&found)).into_iter().flatten();
    each.map(move |(which, us)| Goal::of(format!("{name}, {which}, us"), &[us], None, None))
}

fn shares(f: &Figures) -> [(&'static str, f64); 4] {
    [("p50", f.p50_us), ("p99", f.p99_us), ("p99.9", f.p99_9_us), ("max", f.max_us)]
}

/// How late a thread wakes that only sleeps from tick to tick and asks for what a control thread asks for.
#[expect(clippy::disallowed_methods, reason = "sleeping is what is measured")]
fn bare_sleep(enough: &AtomicBool) -> Histogram {
    let _ = be_realtime();
    let period = probepath_sim::TICK;
    let clock = Monotonic::new();
    let (mut lateness, mut next) = (Histogram::default(), clock.now());
    while !enough.load(Ordering::Relaxed) {
        next = next + period;
        let left = (next - clock.now()).nanoseconds();
        std::thread::sleep(Duration::from_nanos(u64::try_from(left).unwrap_or(0)));
        let late: Span = clock.now() - next;
        lateness.record(late);
        // Later than a tick: the next counts from now, as it does for whoever is paced from outside.
        if late > period {
            next = Stamp::from_nanoseconds((next + late).nanoseconds());
        }
    }
    lateness
}

/// What this process holds in memory (bytes), where the system says it.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}

/// How long the machine under this virtual one gave its processors to others since it began (s), all processors
/// together, where the system says it: Linux counts in hundredths.
fn stolen_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/stat").ok()?;
    let all = stat.lines().find_map(|line| line.strip_prefix("cpu "))?;
    // user, nice, system, idle, iowait, irq, softirq, steal
    all.split_whitespace().nth(7)?.parse::<u64>().ok().map(|hundredths| hundredths as f64 / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_counts_within_a_motion_only() {
        let seen = |tick, phase: &'static str, stays| Seen { tick, phase: phase.into(), stays };
        let follows = seen(7, "follow", false);
        assert_eq!(follows.gap_to(&seen(8, "follow", false)), 0);
        assert_eq!(follows.gap_to(&seen(11, "follow", false)), 3);
        assert_eq!(follows.gap_to(&seen(11, "follow", true)), 3, "on the way to rest");
        assert_eq!(seen(7, "lift", true).gap_to(&seen(900, "approach", true)), 0);
        assert_eq!(seen(7, "teach", true).gap_to(&seen(20, "teach", true)), 0, "it has not begun to move");
    }

    #[test]
    fn this_process_holds_memory() {
        assert!(!cfg!(target_os = "linux") || memory().is_some_and(|bytes| bytes > 100_000));
    }
}
