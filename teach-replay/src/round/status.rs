//! Where a round is, for whoever watches it while the loop runs it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a round is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RoundPhase {
    /// On its way, or resting where nobody looks.
    #[default]
    Going,
    /// On a way on which what is seen counts.
    Sweeping,
    /// At rest, where what is seen counts.
    Looking,
    /// At its end.
    Done,
    /// Not begun: the arm is not where the round was planned from.
    StartMoved,
}

/// Where a round is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RoundStatus {
    /// What it is doing.
    pub phase: RoundPhase,
    /// The stop that it goes to or rests at, counted from zero.
    pub stop: usize,
    /// How many there are.
    pub of: usize,
}

/// A handle on a round's status: reading it waits for nobody.
#[derive(Clone, Debug)]
pub struct RoundWatch {
    board: Board,
}

impl RoundWatch {
    /// Where the round is now.
    pub fn status(&self) -> RoundStatus {
        self.board.read()
    }
}

/// What a round writes at every tick: one number, so that a reader never sees a phase with another's stop.
#[derive(Clone, Debug)]
pub(super) struct Board {
    number: Arc<AtomicU64>,
    of: usize,
}

const PHASES: [RoundPhase; 5] =
    [RoundPhase::Going, RoundPhase::Sweeping, RoundPhase::Looking, RoundPhase::Done, RoundPhase::StartMoved];

impl Board {
    pub(super) fn new(of: usize) -> Self {
        Self { number: Arc::default(), of }
    }

    pub(super) fn write(&self, phase: RoundPhase, stop: usize) {
        self.number.store(((stop as u64) << 8) | phase as u64, Ordering::Release);
    }

    fn read(&self) -> RoundStatus {
        let number = self.number.load(Ordering::Acquire);
        let phase = PHASES.get((number & 0xff) as usize).copied().unwrap_or_default();
        RoundStatus { phase, stop: (number >> 8) as usize, of: self.of }
    }

    pub(super) fn watch(&self) -> RoundWatch {
        RoundWatch { board: self.clone() }
    }
}
