//! [`MachineClock`]: whose clock the headers' stamps are read from.

use probepath_frames::{ClockOffset, ExamClock, HostClock, ImageClock, Span, Stamp};
use serde::{Deserialize, Serialize};

/// Whose clock the machine stamps its pictures with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MachineClock {
    /// The arm's controller's: a stamp is the exam's as it is.
    OfArm,
    /// Its own: brought to the exam's by the smallest delays seen, of its pictures and of the arm's states. What is
    /// left of both (the least time that a picture is under way, less a state's) is constant, and belongs to the lag
    /// that `probepath calibrate temporal` measures: calibrate with the same setting.
    #[default]
    Own,
}

/// How long a smallest delay counts: clocks drift, and are set.
const MEMORY: Span = Span::from_milliseconds(60_000);

/// A stamp this far from now is of another clock.
const FARTHEST: Span = Span::from_milliseconds(10_000);

/// Brings stamps to the exam's clock. Time is an argument.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dating {
    whose: MachineClock,
    arm: ClockOffset<ExamClock, HostClock>,
    machine: ClockOffset<ImageClock, HostClock>,
}

impl Dating {
    pub(super) fn new(whose: MachineClock) -> Self {
        Self { whose, arm: ClockOffset::with_memory(MEMORY), machine: ClockOffset::with_memory(MEMORY) }
    }

    /// The exam's clock was `now` when this computer's was `here`.
    pub(super) fn tick(&mut self, now: Stamp, here: Stamp<HostClock>) {
        self.arm.hear(now, here);
    }

    /// When a picture was formed and when it arrived, by the exam's clock.
    ///
    /// # Errors
    /// The words that say why its stamp cannot be of the clock that it should be.
    pub(super) fn of(
        &mut self,
        stamp: Stamp<ImageClock>,
        here: Stamp<HostClock>,
        now: Stamp,
    ) -> Result<(Stamp, Stamp), String> {
        self.machine.hear(stamp, here);
        let back = |here| self.arm.taken_back(here).unwrap_or(now);
        let arrived = back(here);
        let formed = match self.whose {
            MachineClock::OfArm => Stamp::from_nanoseconds(stamp.nanoseconds()),
            MachineClock::Own => self.machine.brought(stamp, here).map_or(arrived, back).min(arrived),
        };
        let apart = (now - formed).nanoseconds().unsigned_abs();
        if apart > FARTHEST.nanoseconds().unsigned_abs() {
            return Err(format!(
                "a picture is stamped {:.3} s and the arm's clock says {:.3} s: they are two clocks; say in the cell \
                 file that the machine has its own",
                formed.seconds(),
                now.seconds()
            ));
        }
        Ok((formed, arrived))
    }
}
