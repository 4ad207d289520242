//! Where a replay is, for whoever watches it while the loop runs it.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use probepath_robot::step::Binding;

use super::joints;

/// The phases of a replay, in order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReplayPhase {
    /// Through the air.
    #[default]
    Approach,
    /// Down to the skin.
    Descend,
    /// The force is raised.
    Settle,
    /// Along the path.
    Follow,
    /// Off the skin.
    Lift,
    /// At an end.
    Done,
}

impl ReplayPhase {
    const ALL: [Self; 6] =
        [Self::Approach, Self::Descend, Self::Settle, Self::Follow, Self::Lift, Self::Done];
}

/// How a replay ended.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReplayEnding {
    /// The whole path was followed.
    Completed,
    /// The skin was not where it was taught.
    NoSkin,
    /// The sensor reads a force in the air.
    ForceInAir {
        /// The force (N).
        force_n: f64,
    },
    /// The force did not settle.
    NotSettled {
        /// The force at last (N).
        force_n: f64,
    },
    /// The skin was lost.
    ContactLost {
        /// Distance along the path (m).
        at_m: f64,
    },
    /// No joints for the next pose.
    OutOfReach {
        /// Distance along the path (m).
        at_m: f64,
    },
    /// The arm is not where the plan begins.
    StartMoved {
        /// The joint that is off the most (rad, m).
        away: f64,
    },
}

impl fmt::Display for ReplayEnding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Completed => write!(f, "the whole path was followed"),
            Self::NoSkin => write!(f, "no skin where it was taught: has the leg moved? teach again"),
            Self::ForceInAir { force_n } => write!(
                f,
                "the sensor reads {force_n:.1} N in the air: free the probe, check the tool's weight, zero it"
            ),
            Self::NotSettled { force_n } => {
                write!(f, "the force does not settle ({force_n:.1} N): let the leg rest, then start again")
            }
            Self::ContactLost { at_m } => {
                write!(f, "contact was lost {:.1} mm along the path: add gel or lower the probe", at_m * 1e3)
            }
            Self::OutOfReach { at_m } => {
                write!(f, "the arm cannot follow {:.1} mm along the path: plan again", at_m * 1e3)
            }
            Self::StartMoved { away } => {
                write!(f, "the arm is {away:.4} (rad, m) from where the plan begins: plan again")
            }
        }
    }
}

/// Where a replay is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReplayStatus {
    /// The phase.
    pub phase: ReplayPhase,
    /// Distance along the path (m).
    pub at_m: f64,
    /// Speed along the path (m/s).
    pub speed_m_s: f64,
    /// Distance off the path along the probe's axis (m); into the tissue is positive.
    pub offset_m: f64,
    /// The force along the probe's axis (N), filtered, its zero taken off; pressing is positive.
    pub force_n: f64,
    /// The force to hold now (N).
    pub set_n: f64,
    /// The limit that holds the probe back on its path, if any does.
    pub held_by: Option<Binding>,
    /// How it ended, once it has.
    pub ending: Option<ReplayEnding>,
}

/// Says where a replay is, from anywhere.
#[derive(Clone, Debug)]
pub struct ReplayWatch {
    board: Arc<Numbers>,
}

impl ReplayWatch {
    /// Where it is now.
    pub fn status(&self) -> ReplayStatus {
        self.board.read()
    }
}

#[derive(Debug, Default)]
struct Numbers {
    phase: AtomicU8,
    numbers: [AtomicU64; 5],
    held_by: AtomicU64,
    /// Which ending, and its number; zero is none.
    ending: (AtomicU8, AtomicU64),
}

impl Numbers {
    fn read(&self) -> ReplayStatus {
        let number = |i: usize| f64::from_bits(self.numbers[i].load(Ordering::Relaxed));
        let phase = usize::from(self.phase.load(Ordering::Acquire));
        ReplayStatus {
            phase: ReplayPhase::ALL.get(phase).copied().unwrap_or(ReplayPhase::Done),
            at_m: number(0),
            speed_m_s: number(1),
            offset_m: number(2),
            force_n: number(3),
            set_n: number(4),
            held_by: joints::of_number(self.held_by.load(Ordering::Relaxed)),
            ending: self.ending(),
        }
    }

    fn ending(&self) -> Option<ReplayEnding> {
        let which = self.ending.0.load(Ordering::Acquire);
        let number = f64::from_bits(self.ending.1.load(Ordering::Relaxed));
        match which {
            1 => Some(ReplayEnding::Completed),
            2 => Some(ReplayEnding::NoSkin),
            3 => Some(ReplayEnding::ForceInAir { force_n: number }),
            4 => Some(ReplayEnding::NotSettled { force_n: number }),
            5 => Some(ReplayEnding::ContactLost { at_m: number }),
            6 => Some(ReplayEnding::OutOfReach { at_m: number }),
            7 => Some(ReplayEnding::StartMoved { away: number }),
            _ => None,
        }
    }
}

/// What a replay writes at every tick: numbers only, so that writing waits for nobody and touches no heap.
#[derive(Clone, Debug, Default)]
pub(super) struct Board {
    numbers: Arc<Numbers>,
}

impl Board {
    pub(super) fn write(&self, phase: ReplayPhase, numbers: [f64; 5]) {
        for (cell, number) in self.numbers.numbers.iter().zip(numbers) {
            cell.store(number.to_bits(), Ordering::Relaxed);
        }
        self.numbers.phase.store(phase as u8, Ordering::Release);
    }

    pub(super) fn hold(&self, by: Option<Binding>) {
        self.numbers.held_by.store(joints::to_number(by), Ordering::Relaxed);
    }

    pub(super) fn end(&self, ending: ReplayEnding) {
        let (which, number) = match ending {
            ReplayEnding::Completed => (1, 0.0),
            ReplayEnding::NoSkin => (2, 0.0),
            ReplayEnding::ForceInAir { force_n } => (3, force_n),
            ReplayEnding::NotSettled { force_n } => (4, force_n),
            ReplayEnding::ContactLost { at_m } => (5, at_m),
            ReplayEnding::OutOfReach { at_m } => (6, at_m),
            ReplayEnding::StartMoved { away } => (7, away),
        };
        self.numbers.ending.1.store(number.to_bits(), Ordering::Relaxed);
        self.numbers.ending.0.store(which, Ordering::Release);
    }

    pub(super) fn read(&self) -> ReplayStatus {
        self.numbers.read()
    }

    pub(super) fn watch(&self) -> ReplayWatch {
        ReplayWatch { board: Arc::clone(&self.numbers) }
    }
}
