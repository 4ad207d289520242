//! [`Timings`]: how punctual the ticks are, how long a step takes, how long an exchange.

use std::fmt;
use std::time::Instant;

use probepath_frames::{ClockOffset, ExamClock, HostClock, Span, Stamp};
use serde::{Deserialize, Serialize};

use super::histogram::{Figures, Histogram};
use crate::{Arm, ArmFault, Command, State};

/// The clock that arrivals are read from. A trait, so that a test gives its own instants.
pub trait Clock {
    /// Now.
    fn now(&self) -> Stamp<HostClock>;
}

/// This computer's monotone clock, counted from when it was made.
#[derive(Clone, Copy, Debug)]
pub struct Monotonic(Instant);

impl Monotonic {
    /// Zero is now.
    #[allow(clippy::new_without_default, reason = "a default that reads a clock would surprise")]
    #[expect(
        clippy::disallowed_methods,
        reason = "the one clock that punctuality is measured by; no step asks it"
    )]
    pub fn new() -> Self {
        Self(Instant::now())
    }
}

impl Clock for Monotonic {
    fn now(&self) -> Stamp<HostClock> {
        let nanoseconds = i64::try_from(self.0.elapsed().as_nanos()).unwrap_or(i64::MAX);
        Stamp::from_nanoseconds(nanoseconds)
    }
}

/// What a control loop is measured by. Three histograms of a fixed room: measuring touches no heap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timings {
    /// How late a state arrived against its own stamp, beyond the smallest delay: what network, scheduler and this
    /// computer's other work add. See [`ClockOffset`].
    pub lateness: Histogram,
    /// From a state's arrival until the next command goes out: controller, limits, guard and observer.
    pub step: Histogram,
    /// From a command's going out until the next state is here: the wire both ways and the wait for the arm's tick.
    pub round_trip: Histogram,
    /// How many states came.
    pub ticks: u64,
    /// How many ticks were skipped, by the arm's own count: no state of theirs came.
    pub skipped: u64,
    /// How many states came together with a newer one, because this computer was late: seen, and nothing commanded upon
    /// them. They are in `lateness`, and not in `ticks`.
    pub overtaken: u64,
}

impl Timings {
    /// Adds another's.
    pub fn merge(&mut self, other: &Self) {
        self.lateness.merge(&other.lateness);
        self.step.merge(&other.step);
        self.round_trip.merge(&other.round_trip);
        self.ticks += other.ticks;
        self.skipped += other.skipped;
        self.overtaken += other.overtaken;
    }

    /// Its figures, for a file or a screen.
    pub fn figures(&self) -> TimingFigures {
        TimingFigures {
            ticks: self.ticks,
            skipped: self.skipped,
            overtaken: self.overtaken,
            lateness: self.lateness.figures(),
            step: self.step.figures(),
            round_trip: self.round_trip.figures(),
        }
    }
}

/// What [`Timings`] say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimingFigures {
    /// How many states came.
    pub ticks: u64,
    /// How many ticks were skipped, by the arm's own count: no state of theirs came.
    pub skipped: u64,
    /// How many states came together with a newer one, because this computer was late.
    pub overtaken: u64,
    /// How late a state arrived beyond the smallest delay.
    pub lateness: Option<Figures>,
    /// From a state's arrival until the next command goes out.
    pub step: Option<Figures>,
    /// From a command's going out until the next state is here.
    pub round_trip: Option<Figures>,
}

impl fmt::Display for TimingFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |f: &mut fmt::Formatter<'_>, name, figures: Option<Figures>| match figures {
            Some(figures) => writeln!(f, "{name:<14} {figures}"),
            None => writeln!(f, "{name:<14} nothing counted"),
        };
        line(f, "tick lateness", self.lateness)?;
        line(f, "step", self.step)?;
        line(f, "round trip", self.round_trip)?;
        let Self { ticks, skipped, overtaken, .. } = self;
        write!(
            f,
            "{ticks} ticks, {skipped} skipped by the arm's count, {overtaken} came together with a newer one"
        )
    }
}

/// How long the smallest delay counts: a controller that slips behind, as an overloaded simulated one does, is soon
/// its own measure again.
const PACE: Span = Span::from_milliseconds(500);

/// An arm whose ticks are measured on the way through.
pub struct Timed<'a, A: Arm + ?Sized, C> {
    arm: &'a mut A,
    clock: C,
    timings: &'a mut Timings,
    pace: ClockOffset<ExamClock, HostClock>,
    /// When the last state was here.
    here: Option<Stamp<HostClock>>,
    tick: Option<u64>,
}

impl<'a, A: Arm + ?Sized, C: Clock> Timed<'a, A, C> {
    /// Measures every exchange with `arm` into `timings`.
    pub fn new(arm: &'a mut A, clock: C, timings: &'a mut Timings) -> Self {
        Self { arm, clock, timings, pace: ClockOffset::with_memory(PACE), here: None, tick: None }
    }

    fn count(&mut self, sent: Stamp<HostClock>, here: Stamp<HostClock>, state: &State) {
        if let Some(before) = self.here {
            self.timings.step.record(sent - before);
        }
        self.timings.round_trip.record(here - sent);
        // The clock of the first state starts the pace: there is nothing yet to be late against. What came with it
        // waited while nobody asked.
        if let Some(before) = self.tick {
            let older = self.arm.overtaken();
            for overtaken in older {
                self.timings.lateness.record(self.pace.hear(overtaken.stamp, here));
            }
            self.timings.lateness.record(self.pace.hear(state.stamp, here));
            let came = older.len() as u64 + 1;
            self.timings.overtaken += came - 1;
            self.timings.skipped += state.tick.saturating_sub(before).saturating_sub(came);
        } else {
            self.pace.hear(state.stamp, here);
        }
        self.timings.ticks += 1;
        (self.here, self.tick) = (Some(here), Some(state.tick));
    }
}

impl<A: Arm + ?Sized, C: Clock> Arm for Timed<'_, A, C> {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let sent = self.clock.now();
        let state = self.arm.exchange(command)?;
        let here = self.clock.now();
        self.count(sent, here, &state);
        Ok(state)
    }

    fn overtaken(&self) -> &[State] {
        self.arm.overtaken()
    }

    fn period(&self) -> Span {
        self.arm.period()
    }

    fn joints(&self) -> usize {
        self.arm.joints()
    }
}
