//! [`run_apart`]: the one loop on its control thread, everybody who watches on the caller's.

use std::time::Duration;

use super::grant::RealtimeReport;
use super::tape::{ROOM, TapeReader, tape};
use super::thread::control_thread;
use super::timings::{Monotonic, Timed, Timings};
use crate::{Arm, BlackBox, Controller, Ending, Finished, Guard, RunError, StopReason, Tick, Wish, run};

/// How long the reader sleeps when nothing waits: short against the tape's room, long against a processor's time.
const NAP: Duration = Duration::from_millis(1);

/// How a motion on its control thread went.
#[derive(Debug)]
pub struct Apart {
    /// How it ended, as [`run`] gives it.
    pub done: Result<Finished, Box<RunError>>,
    /// What the system granted.
    pub realtime: RealtimeReport,
    /// Ticks that were not seen by the watcher, because it was too slow: say so where ticks are recorded.
    pub lost: u64,
}

/// Runs a controller on an arm as [`run`] does, on a thread of its own that is real time where the system allows it:
/// no heap, no lock and no log on it. `watch` hears of every tick on the caller's thread, a little later, with the
/// `mark` that was put on it on the control thread; it may take its time, and what it asks for reaches the loop within
/// a tick or two.
///
/// For hardware, whose ticks are as far apart as its clock says. Where time is simulated, [`run`] keeps the ticks and
/// their watchers in step.
pub fn run_apart<M: Copy + Send>(
    arm: &mut (dyn Arm + Send),
    controller: &mut (dyn Controller + Send),
    guard: &mut Guard,
    timings: &mut Timings,
    mark: impl FnMut() -> M + Send,
    watch: &mut dyn FnMut(&Tick, M) -> Wish,
) -> Apart {
    let (mut writer, reader) = tape(ROOM, mark);
    let mut realtime = RealtimeReport::not_asked();
    let given = &mut realtime;
    let work = move |report| {
        *given = report;
        let mut timed = Timed::new(arm, Monotonic::new(), timings);
        // The writer is dropped here, when the loop has ended: that is how its reader knows.
        let done = run(&mut timed, controller, guard, &mut writer);
        drop(writer);
        done
    };
    match control_thread("control", work, || listen(reader, watch)) {
        Ok((done, Heard { why, lost })) => Apart { done: named(done, why), realtime, lost },
        Err(error) => Apart { done: Err(broken(error.to_string())), realtime, lost: 0 },
    }
}

/// What the reader has to say at the end.
struct Heard {
    /// Why it asked for a stop, if it did.
    why: Option<String>,
    lost: u64,
}

#[expect(
    clippy::disallowed_methods,
    reason = "the control thread never wakes anybody: its reader looks now and then"
)]
fn listen<M>(mut reader: TapeReader<M>, watch: &mut dyn FnMut(&Tick, M) -> Wish) -> Heard {
    let mut why = None;
    loop {
        let ended = reader.has_ended();
        while let Some((tick, mark)) = reader.take() {
            if let Wish::Stop(reason) = watch(&tick, mark) {
                reader.stop();
                why.get_or_insert(reason);
            }
        }
        if ended {
            return Heard { why, lost: reader.lost() };
        }
        std::thread::sleep(NAP);
    }
}

/// The reader's reason in place of the empty one that the control thread could give.
fn named(done: Result<Finished, Box<RunError>>, why: Option<String>) -> Result<Finished, Box<RunError>> {
    let mut finished = done?;
    if let (Ending::Observer(reason), Some(why)) = (&mut finished.ending, why) {
        *reason = why;
    }
    Ok(finished)
}

/// The control thread ended by itself, or never began; the arm's own watchdog has stopped it.
fn broken(message: String) -> Box<RunError> {
    let reason = StopReason::Panicked { who: "control thread", message };
    Box::new(RunError { reason, last: None, at_rest: false, black_box: BlackBox::new(1) })
}
