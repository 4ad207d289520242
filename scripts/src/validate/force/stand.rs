//! [`Stand`]: an operator who pauses a scan for a while, by its bar and not by a clock.

use std::sync::atomic::{AtomicU64, Ordering};

use probepath_robot::Operator;

use crate::progress::Progress;

/// Where the pause begins, as a part of the path.
const FROM: f64 = 0.5;
/// The bar moves five times a second of exam time: four seconds of pause.
const BARS: u64 = 20;

/// Hears how far a scan is, pauses it once, and resumes it.
pub(super) struct Stand {
    operator: Operator,
    bars: AtomicU64,
}

impl Stand {
    pub(super) fn new(operator: Operator) -> Self {
        Self { operator, bars: AtomicU64::new(0) }
    }
}

impl Progress for Stand {
    fn at(&self, step: &str, fraction: f64) {
        if step != "scanning" || !(FROM..=0.99).contains(&fraction) {
            return;
        }
        match self.bars.fetch_add(1, Ordering::Relaxed) {
            0 => self.operator.pause(),
            BARS => self.operator.resume(),
            _ => {}
        }
    }

    fn say(&self, _: &str) {}
}
