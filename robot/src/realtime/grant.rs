//! [`be_realtime`]: asks the system to be punctual, and says in words what it gave.

use std::fmt;

use serde::{Deserialize, Serialize};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// What a thread that must be punctual stands for. All run before whatever is not real time (SCHED_FIFO).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Rank {
    /// A device that is emulated on this computer, and sends something now and then: an ultrasound machine.
    Device,
    /// The loop that moves an arm.
    Control,
    /// An arm's controller that is emulated on this computer. In truth it is a machine of its own, whose ticks wait
    /// for nothing that happens here.
    Controller,
}

impl Rank {
    /// The kernel's own threads for interrupts have 50, its watchdogs 99.
    const fn priority(self) -> u8 {
        match self {
            Self::Device => 40,
            Self::Control => 80,
            Self::Controller => 85,
        }
    }
}

/// What the system gave of one wish, in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Grant {
    /// It was given.
    Granted(String),
    /// It was not.
    Refused {
        /// Why, as the system says it.
        why: String,
        /// What somebody who runs this computer can do.
        what_to_do: String,
    },
    /// It was not asked for: time is simulated, nobody waits for this thread.
    NotAsked,
}

impl Grant {
    /// Whether it was given.
    pub const fn is_granted(&self) -> bool {
        matches!(self, Self::Granted(_))
    }
}

impl fmt::Display for Grant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Granted(what) => write!(f, "granted: {what}"),
            Self::Refused { why, what_to_do } => write!(f, "not granted: {why}; {what_to_do}"),
            Self::NotAsked => write!(f, "not asked for: time is simulated"),
        }
    }
}

/// How punctual the system lets a control thread be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RealtimeReport {
    /// Whether the thread runs before all others (SCHED_FIFO).
    pub scheduling: Grant,
    /// Whether the process's memory stays in memory.
    pub memory: Grant,
}

impl RealtimeReport {
    /// Nothing was asked for.
    pub const fn not_asked() -> Self {
        Self { scheduling: Grant::NotAsked, memory: Grant::NotAsked }
    }
}

impl fmt::Display for RealtimeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "real-time scheduling {}", self.scheduling)?;
        write!(f, "locked memory {}", self.memory)
    }
}

/// Asks that the calling thread runs before all others (SCHED_FIFO), and that the process's memory is never written to
/// a disk (mlockall). Neither is needed to go on: whoever starts an arm shows the report.
///
/// A thread that was given SCHED_FIFO passes it on to the threads it starts: start none from it.
pub fn be_realtime() -> RealtimeReport {
    RealtimeReport { scheduling: take_rank(Rank::Control), memory: memory() }
}

/// Asks that the calling thread runs before all that rank lower (SCHED_FIFO). The threads that it starts from now on
/// do so too.
pub fn take_rank(rank: Rank) -> Grant {
    let (policy, priority) =
        (ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo), rank.priority());
    let asked =
        ThreadPriorityValue::try_from(priority).map(ThreadPriority::Crossplatform).and_then(|priority| {
            set_thread_priority_and_policy(thread_native_id(), priority, policy).map_err(in_words)
        });
    match asked {
        Ok(()) => Grant::Granted(format!("SCHED_FIFO, priority {priority}")),
        Err(why) => Grant::Refused { why, what_to_do: SCHEDULING_TO_DO.into() },
    }
}

const SCHEDULING_TO_DO: &str = "allow the user real-time priority (`@realtime - rtprio 90` in \
    /etc/security/limits.d, then log in again), or give the program cap_sys_nice; until then other programs make \
    ticks late";

fn in_words(error: thread_priority::Error) -> String {
    match error {
        thread_priority::Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
        other => format!("{other:?}"),
    }
}

#[cfg(target_os = "linux")]
fn memory() -> Grant {
    use nix::sys::mman::{MlockAllFlags, mlockall};
    // What is mapped later is locked only where no limit can be met: past one, asking for memory fails, and a
    // program that gets no memory ends with the arm in motion.
    let all = unlimited();
    let (flags, what) = if all {
        (MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE, "all memory, now and later")
    } else {
        (
            MlockAllFlags::MCL_CURRENT,
            "the memory mapped by now; later memory is not, because locking is limited",
        )
    };
    match mlockall(flags) {
        Ok(()) => Grant::Granted(what.into()),
        Err(errno) => Grant::Refused {
            why: std::io::Error::from(errno).to_string(),
            what_to_do: "allow the user to lock memory (`@realtime - memlock unlimited` in \
                /etc/security/limits.d, then log in again), or give the program cap_ipc_lock; until then a page \
                that was swapped out makes a tick late"
                .into(),
        },
    }
}

#[cfg(not(target_os = "linux"))]
fn memory() -> Grant {
    Grant::Refused {
        why: "probepath knows how to lock memory on Linux only".into(),
        what_to_do: "run the arm from Linux, or switch swapping off".into(),
    }
}

/// Whether locking can never meet a limit: none is set, or the process stands above it.
#[cfg(target_os = "linux")]
fn unlimited() -> bool {
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
    getrlimit(Resource::RLIMIT_MEMLOCK).is_ok_and(|(soft, _)| soft == RLIM_INFINITY) || may_lock_any()
}

/// The capability to lock memory beyond the limit (CAP_IPC_LOCK, bit 14), as the kernel says it.
#[cfg(target_os = "linux")]
fn may_lock_any() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    effective
        .and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok())
        .is_some_and(|bits| bits >> 14 & 1 == 1)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

    use super::*;

    #[test]
    fn what_was_not_given_says_why_and_what_to_do() {
        // On a thread of its own: the scheduling of the test's must not change.
        let report = std::thread::spawn(|| RealtimeReport {
            scheduling: take_rank(Rank::Control),
            ..RealtimeReport::not_asked()
        });
        let text = report.join().unwrap().to_string();
        assert!(
            text.contains("granted: SCHED_FIFO")
                || (text.contains("not granted: ") && text.contains("rtprio")),
            "{text}"
        );
        assert!(text.contains("locked memory not asked for"), "{text}");
    }

    #[test]
    fn a_report_is_read_back_as_it_was_written() {
        let report = RealtimeReport {
            scheduling: Grant::Granted("SCHED_FIFO".into()),
            memory: Grant::Refused { why: "no".into(), what_to_do: "ask".into() },
        };
        let text = serde_json::to_string(&report).unwrap();
        assert_eq!(serde_json::from_str::<RealtimeReport>(&text).unwrap(), report);
    }
}
