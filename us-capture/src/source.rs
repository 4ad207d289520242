//! Where B-scans come from.

use probepath_frames::Stamp;
use thiserror::Error;

use crate::BScan;

/// A stream of B-scans: the simulated machine, a sequence from disk, later a frame grabber or a network.
pub trait BScanSource {
    /// The next B-scan that has arrived by `now`, oldest first; `None` when there is none yet.
    ///
    /// # Errors
    /// When the stream is broken: it ended, or what arrived is no B-scan.
    fn poll(&mut self, now: Stamp) -> Result<Option<BScan>, SourceFault>;

    /// Whether a machine that is silent for long has stopped. Not so where only the B-scans that were kept are given
    /// again: on slow stretches of a path they are far apart in time.
    fn silence_is_a_fault(&self) -> bool {
        true
    }

    /// Lets go of the B-scans that have arrived by `now`: nobody wants them. A source that makes its B-scans only when
    /// they are asked for need not make these.
    ///
    /// # Errors
    /// As [`Self::poll`].
    fn skip(&mut self, now: Stamp) -> Result<(), SourceFault> {
        while self.poll(now)?.is_some() {}
        Ok(())
    }
}

/// Why a source has no more B-scans.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SourceFault {
    /// The connection is gone.
    #[error("the ultrasound machine's connection was lost at {at}: {why}")]
    ConnectionLost {
        /// When it was noticed.
        at: Stamp,
        /// The cause, in words.
        why: String,
    },
    /// Nobody answers.
    #[error(
        "no ultrasound machine answers at {place}: {why}; is it on, does it serve OpenIGTLink, is the port open?"
    )]
    Unreachable {
        /// Host and port.
        place: String,
        /// The cause, in words.
        why: String,
    },
    /// What came is no B-scan.
    #[error("what the ultrasound machine sent by {at} cannot be used: {why}")]
    Unreadable {
        /// When it was noticed.
        at: Stamp,
        /// The cause, in words.
        why: String,
    },
    /// A sequence from disk is over.
    #[error("the sequence ended after {count} B-scans")]
    Ended {
        /// How many there were.
        count: u64,
    },
}
