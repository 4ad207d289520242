//! One turn of the wire: an order out, a package in, counted and judged.

use std::time::{Duration, Instant};

use probepath_frames::Span;

use super::super::link::{Link, Order, Received};
use super::super::measured::Measured;
use super::super::registers::{command, state};
use super::super::{UrError, clock, safety};
use super::{KEPT, UrArm, ticks};
use crate::ArmFault;

/// When nobody asked for longer than this, what came meanwhile is read away first.
const AWAY: Duration = Duration::from_millis(10);

/// Words belong to a stop when they came so long before it, or after it.
const SAID_BEFORE: Duration = Duration::from_millis(500);
const SAID_AFTER: Duration = Duration::from_millis(100);

/// Packages with one and the same echo until the script is taken to be hung. Its own watchdogs are quicker.
const DEAF: u32 = 50;

impl UrArm {
    /// One tick, or the fault that lasts.
    pub(super) fn turn(&mut self, command: i32, setpoint: [f64; 6]) -> Result<(), ArmFault> {
        let turned = self.sent_and_received(command, setpoint).and_then(|()| self.judge());
        turned.map_err(|mut fault| {
            self.counts.faults += 1;
            self.fault = Some(fault.clone());
            self.last_word();
            self.explain(&mut fault);
            self.fault = Some(fault.clone());
            fault
        })
    }

    /// The controller's own words for a stop that it made by itself. The arm is told to stay, and its words may be a
    /// moment behind its data.
    fn explain(&self, fault: &mut ArmFault) {
        let (ArmFault::ProtectiveStop { why, .. }
        | ArmFault::SafetyFault { why, .. }
        | ArmFault::WatchdogStop { why, .. }) = fault
        else {
            return;
        };
        let words = self.words.lately(SAID_BEFORE, SAID_AFTER);
        if !words.is_empty() {
            *why = format!("{why}; the controller says: {words}");
        }
    }

    fn sent_and_received(&mut self, command: i32, setpoint: [f64; 6]) -> Result<(), ArmFault> {
        let (tick, patience) = (self.tick(), self.settings.patience());
        let lost = |error: UrError| ArmFault::ConnectionLost { tick, why: error.to_string() };
        let away = !self.settings.stepped && self.heard.elapsed() > AWAY;
        let Some(link) = &mut self.link else {
            return Err(ArmFault::ConnectionLost { tick, why: "it was lost before".into() });
        };
        let mut drained = 0;
        self.emptied = None;
        link.forget();
        if away {
            drained = link.drain().map_err(lost)?;
            self.emptied = Some(clock::now());
        }
        self.sequence = self.sequence.wrapping_add(1).max(1);
        link.send(&Order { sequence: self.sequence, command, session: self.session, setpoint })
            .map_err(lost)?;
        let now = clock::now();
        if let Some(slot) = self.sent.get_mut(self.sequence as usize % KEPT) {
            *slot = now;
        }
        let received = link.receive(patience).map_err(lost)?;
        self.counts.texts = link.texts;
        self.heard = clock::now();
        self.take(&Received { older: received.older + drained, ..received })
    }

    /// Counts what came, and what did not.
    fn take(&mut self, received: &Received) -> Result<(), ArmFault> {
        let Received { newest, older } = *received;
        let (tick, seconds) = (self.tick(), newest.timestamp_s);
        let passed = ticks(seconds) - ticks(self.last.timestamp_s);
        if !seconds.is_finite() || passed < 0 {
            let why = format!("its clock went from {} s to {seconds} s", self.last.timestamp_s);
            return Err(ArmFault::ConnectionLost { tick, why });
        }
        if newest.position.iter().chain(&newest.target).any(|q| !q.is_finite()) {
            let why = format!("it measured joints at {:?} rad", newest.position);
            return Err(ArmFault::ConnectionLost { tick, why });
        }
        let counts = &mut self.counts;
        counts.packages += older + 1;
        counts.late += older;
        let missing = passed.unsigned_abs().saturating_sub(older + 1);
        counts.gaps += missing;
        counts.longest_gap = counts.longest_gap.max(missing);
        self.same_echo = if newest.sequence == self.last.sequence { self.same_echo + 1 } else { 0 };
        self.last = newest;
        Ok(())
    }

    /// Whether the arm may go on.
    fn judge(&self) -> Result<(), ArmFault> {
        let (tick, last) = (self.tick(), &self.last);
        if let Some(fault) = safety::fault(last.safety_bits, tick) {
            return Err(fault);
        }
        let stopped = |why| Err(ArmFault::WatchdogStop { tick, why });
        if last.mode != safety::RUNNING {
            let why = format!("it is {}", safety::mode_words(last.mode));
            return Err(ArmFault::SafetyFault { tick, why });
        }
        if last.runtime != safety::PLAYING {
            let runtime = safety::runtime_words(last.runtime);
            let said = self.link.as_ref().map(Link::said).unwrap_or_default();
            return stopped(format!("our program on the controller is {runtime} ({said})"));
        }
        if last.session != self.session {
            let why = format!("another host shook hands with our script (session {})", last.session);
            return Err(ArmFault::ConnectionLost { tick, why });
        }
        match last.state {
            state::TIMED_OUT => stopped(format!(
                "the script heard nothing for more than {} ms while the arm was not at rest",
                self.settings.watchdog.nanoseconds() / 1_000_000
            )),
            state::REFUSED => {
                let why =
                    "the script on the controller found the setpoint too far from where the arm is".into();
                Err(ArmFault::ProtectiveStop { tick, why })
            }
            state::HUNG => stopped("the script's moving thread hung, and was ended".into()),
            _ if self.same_echo > DEAF => {
                stopped(format!("the script has not echoed a command for {} packages", self.same_echo))
            }
            _ => Ok(()),
        }
    }

    /// The last word to an arm that failed: it may hear without being heard. Then the script stops by its watchdog
    /// at the latest.
    pub(super) fn last_word(&mut self) {
        let (sequence, session) = (self.sequence.wrapping_add(1).max(1), self.session);
        if let Some(link) = &mut self.link {
            let _ = link.send(&Order { sequence, command: command::STAY, session, setpoint: [0.0; 6] });
        }
        self.sequence = sequence;
        if matches!(self.fault, Some(ArmFault::ConnectionLost { .. })) {
            self.link = None;
        }
    }

    /// Ticks of the controller since we connected.
    pub(super) fn tick(&self) -> u64 {
        self.tick_of(&self.last)
    }

    /// The same, when a package was sent.
    pub(super) fn tick_of(&self, package: &Measured) -> u64 {
        u64::try_from(ticks(package.timestamp_s) - self.first_tick).unwrap_or(0)
    }

    /// How old the newest package is: it was measured after the script had the sequence number that it echoes, so it
    /// is younger than that number's sending; half of the best round trip so far was the way there. After an absence
    /// the echo says little, but the package came after the buffer was empty.
    pub(super) fn age(&mut self) -> Span {
        if self.settings.stepped {
            return Span::ZERO;
        }
        let behind = self.sequence.wrapping_sub(self.last.sequence).clamp(0, KEPT as i32 - 1);
        let echoed = self.sequence.wrapping_sub(behind) as usize % KEPT;
        let round = self.sent.get(echoed).map_or(Duration::ZERO, Instant::elapsed);
        let age = match self.emptied {
            Some(emptied) => round.min(emptied.elapsed().saturating_add(self.round_trip)),
            None => {
                self.round_trip = self.round_trip.min(round);
                round.saturating_sub(self.round_trip / 2)
            }
        };
        let age = Span::from_nanoseconds(i64::try_from(age.as_nanos()).unwrap_or(i64::MAX));
        self.counts.oldest = self.counts.oldest.max(age);
        age
    }
}
