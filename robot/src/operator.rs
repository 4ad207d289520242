//! [`Operator`]: pause, resume and stop, from any thread, at any tick.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};

/// What the operator asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Go on.
    Go,
    /// Slow down along the path to rest, and wait there; the contact force is kept.
    Pause,
    /// End the motion: the loop brakes the arm to rest.
    Stop,
}

/// A handle that any thread (the console, a script, Ctrl-C) may hold. A stop stays until it is taken back by
/// [`allow`](Self::allow): a resume never undoes it.
#[derive(Clone, Debug, Default)]
pub struct Operator {
    asked: Arc<AtomicU8>,
    stops: Arc<AtomicU32>,
}

const GO: u8 = 0;
const PAUSE: u8 = 1;
const STOP: u8 = 2;

impl Operator {
    /// Nothing is asked yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Pauses what runs; a stop stays a stop.
    pub fn pause(&self) {
        self.change(GO, PAUSE);
    }

    /// Goes on after a pause; a stop stays a stop.
    pub fn resume(&self) {
        self.change(PAUSE, GO);
    }

    /// Stops what runs, and refuses what would run next until [`allow`](Self::allow).
    pub fn stop(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
        self.asked.store(STOP, Ordering::SeqCst);
    }

    /// How often a stop was asked for: who has heard one can tell whether another came.
    pub fn stops(&self) -> u32 {
        self.stops.load(Ordering::SeqCst)
    }

    /// Takes a stop back: a fresh decision that the arm may move.
    pub fn allow(&self) {
        self.change(STOP, GO);
    }

    /// What is asked now.
    pub fn wish(&self) -> Asked {
        match self.asked.load(Ordering::SeqCst) {
            GO => Asked::Go,
            PAUSE => Asked::Pause,
            _ => Asked::Stop,
        }
    }

    fn change(&self, from: u8, to: u8) {
        // Refused when something else was asked meanwhile, which is then what counts.
        let _ = self.asked.compare_exchange(from, to, Ordering::SeqCst, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_not_undone_by_a_pause_or_a_resume() {
        let operator = Operator::new();
        operator.pause();
        assert_eq!(operator.wish(), Asked::Pause);
        operator.stop();
        operator.pause();
        operator.resume();
        assert_eq!(operator.wish(), Asked::Stop);
        operator.clone().stop();
        assert_eq!(operator.stops(), 2);
        operator.allow();
        assert_eq!(operator.wish(), Asked::Go);
    }
}
