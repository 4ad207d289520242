//! One motion of the session: a controller, the one loop, who watches it, and what its end means.

use probepath_robot::realtime::{RealtimeReport, TimingFigures, Timings, run_apart};
use probepath_robot::{
    Arm, BlackBox, Command, Controller, Ending, Finished, Guard, Observer, RunError, State, StopReason, Tick,
    Wish, run,
};
use probepath_us_capture::exam::{ExamWriter, TickRecord};
use serde::Serialize;

use super::SessionError;
use super::bedside::Bedside;
use super::recorder::{Facts, Stand, Taped, record};

/// Who watches a motion: every tick, with where the motion was then.
pub(super) trait Watcher {
    /// Hears of one tick.
    fn see(&mut self, tick: &Tick, stand: &Stand) -> Wish;
}

/// Nobody watches, but for the exam.
impl Watcher for () {
    fn see(&mut self, _tick: &Tick, _stand: &Stand) -> Wish {
        Wish::GoOn
    }
}

/// What a motion is made with.
pub(super) struct Motion<'a> {
    pub(super) step: &'static str,
    pub(super) arm: &'a mut dyn Bedside,
    pub(super) exam: &'a ExamWriter,
    pub(super) facts: &'a Facts,
    pub(super) stand: &'a (dyn Fn() -> Stand + Sync),
    /// For an arm in real time: the loop then has a thread of its own, and whoever watches hears of it a little later.
    pub(super) punctual: Option<&'a mut Punctual>,
}

/// How punctual the motions of a session in real time were.
#[derive(Clone, Debug, Default)]
pub(super) struct Punctual {
    timings: Timings,
    realtime: Option<RealtimeReport>,
    /// Ticks that nobody saw and the exam misses, because whoever watched was too slow.
    unseen: u64,
}

/// The same in a file.
#[derive(Debug, Serialize)]
struct PunctualFile {
    realtime: Option<RealtimeReport>,
    unseen_ticks: u64,
    figures: TimingFigures,
    /// Every bucket that something fell into: its largest (us) and how many.
    lateness_us: Vec<(f64, u64)>,
    step_us: Vec<(f64, u64)>,
    round_trip_us: Vec<(f64, u64)>,
}

impl Punctual {
    /// What the exam keeps; nothing when nothing moved.
    pub(super) fn text(&self) -> Option<Result<Vec<u8>, serde_json::Error>> {
        let buckets = |histogram: &probepath_robot::realtime::Histogram| {
            histogram.buckets().map(|(span, count)| (span.seconds() * 1e6, count)).collect()
        };
        let timings = &self.timings;
        let file = || PunctualFile {
            realtime: self.realtime.clone(),
            unseen_ticks: self.unseen,
            figures: timings.figures(),
            lateness_us: buckets(&timings.lateness),
            step_us: buckets(&timings.step),
            round_trip_us: buckets(&timings.round_trip),
        };
        (timings.ticks > 0).then(|| serde_json::to_vec_pretty(&file()))
    }

    /// Ticks that nobody saw.
    pub(super) const fn unseen(&self) -> u64 {
        self.unseen
    }
}

/// Runs a motion to its end.
///
/// # Errors
/// When it was stopped, by a fault, by the operator or by whoever watched.
pub(super) fn perform(
    motion: Motion<'_>,
    controller: &mut (dyn Controller + Send),
    guard: &mut Guard,
    watcher: &mut dyn Watcher,
) -> Result<(), SessionError> {
    let step = motion.step;
    let done = match motion.punctual {
        Some(_) => apart(motion, controller, guard, watcher),
        None => in_step(motion, controller, guard, watcher),
    };
    let finished = done.map_err(|source| SessionError::Motion { step, source })?;
    match finished.ending {
        Ending::Done => Ok(()),
        Ending::Operator => Err(SessionError::Stopped { step }),
        Ending::Observer(why) => Err(SessionError::Ended { step, why }),
    }
}

/// Whoever watches hears of a tick before the next begins.
fn in_step(
    motion: Motion<'_>,
    controller: &mut dyn Controller,
    guard: &mut Guard,
    watcher: &mut dyn Watcher,
) -> Result<Finished, Box<RunError>> {
    let Motion { arm, exam, facts, stand, .. } = motion;
    let mut taped = Taped { arm, exam, facts, stand };
    run(&mut taped, controller, guard, &mut InStep { watcher, stand })
}

/// The loop on its own thread, everybody else on this one.
fn apart(
    motion: Motion<'_>,
    controller: &mut (dyn Controller + Send),
    guard: &mut Guard,
    watcher: &mut dyn Watcher,
) -> Result<Finished, Box<RunError>> {
    let Motion { arm, exam, facts, stand, punctual, .. } = motion;
    let mut unmeasured = Punctual::default();
    let punctual = punctual.unwrap_or(&mut unmeasured);
    let mut watch = |tick: &Tick, stand: Stand| {
        let record = record(&tick.command, &tick.state, &stand, facts);
        exam.tick(TickRecord { overtaken: tick.overtaken, ..record });
        watcher.see(tick, &stand)
    };
    let gone = run_apart(arm, controller, guard, &mut punctual.timings, stand, &mut watch);
    punctual.unseen += gone.lost;
    punctual.realtime = Some(gone.realtime);
    gone.done
}

struct InStep<'a> {
    watcher: &'a mut dyn Watcher,
    stand: &'a dyn Fn() -> Stand,
}

impl Observer for InStep<'_> {
    fn tick(&mut self, tick: &Tick) -> Wish {
        self.watcher.see(tick, &(self.stand)())
    }
}

/// What the arm measures now; it stays where it is.
///
/// # Errors
/// When it does not answer.
pub(super) fn ask(step: &'static str, arm: &mut dyn Arm) -> Result<State, SessionError> {
    arm.exchange(&Command::Stay).map_err(|fault| {
        let black_box = BlackBox::default();
        let source = RunError { reason: StopReason::Arm(fault), last: None, at_rest: true, black_box };
        SessionError::Motion { step, source: Box::new(source) }
    })
}
