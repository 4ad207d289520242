//! [`ClockOffset`]: one clock against another, from messages that are never early.

use std::marker::PhantomData;

use crate::stamp::{Clock, Span, Stamp};

/// How far two good quartz clocks drift apart: 100 nanoseconds in a millisecond (100 ppm).
const DRIFT_PPM: i64 = 100;

/// How clock `B` stands against clock `A`, learned from messages stamped by `A` and received by `B`.
///
/// A message is never received before it is sent, so the smallest delay seen is the best one. What that smallest delay
/// itself is cannot be known from one side: it stays in the offset as a constant, and belongs to whatever lag is
/// calibrated. The clocks may drift: a smallest delay of long ago is believed 100 ppm less for every second since, and
/// is forgotten after one to two memories, because clocks are also set.
///
/// ```
/// use probepath_frames::{ClockOffset, HostClock, ImageClock, Span, Stamp};
///
/// let mut offset = ClockOffset::<ImageClock, HostClock>::with_memory(Span::from_milliseconds(60_000));
/// let at = |ms: i64| Stamp::from_nanoseconds(1_000_000 * ms);
/// let here = |ms: i64| Stamp::from_nanoseconds(1_000_000 * ms);
/// assert_eq!(offset.hear(at(0), here(107)), Span::ZERO);
/// offset.hear(at(10), here(115));
/// assert_eq!(offset.hear(at(20), here(128)), Span::from_nanoseconds(3_000_000 - 1_300));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ClockOffset<A, B: Clock> {
    memory: Span,
    /// The smallest of this memory, and of the one before.
    now: Option<Least<B>>,
    before: Option<Least<B>>,
    /// When this memory began.
    began: Stamp<B>,
    from: PhantomData<A>,
}

/// The smallest of `B - A`, in nanoseconds, and when it was seen.
#[derive(Clone, Copy, Debug)]
struct Least<B: Clock> {
    offset: i64,
    seen: Stamp<B>,
}

impl<B: Clock> Least<B> {
    /// What is believed of it later, in nanoseconds.
    fn at(&self, now: Stamp<B>) -> i64 {
        self.offset.saturating_add((now - self.seen).nanoseconds().max(0) / (1_000_000 / DRIFT_PPM))
    }
}

impl<A: Clock, B: Clock> ClockOffset<A, B> {
    /// Knows nothing yet, and will remember a delay for one to two times `memory`.
    pub fn with_memory(memory: Span) -> Self {
        Self { memory, now: None, before: None, began: Stamp::ZERO, from: PhantomData }
    }

    /// A message sent at `sent` arrived at `arrived`; gives its delay beyond the smallest.
    pub fn hear(&mut self, sent: Stamp<A>, arrived: Stamp<B>) -> Span {
        if self.now.is_none() || arrived - self.began > self.memory {
            (self.before, self.now, self.began) = (self.now, None, arrived);
        }
        let offset = arrived.nanoseconds().saturating_sub(sent.nanoseconds());
        if self.now.is_none_or(|least| offset <= least.at(arrived)) {
            self.now = Some(Least { offset, seen: arrived });
        }
        let least = self.at(arrived).unwrap_or_default();
        Span::from_nanoseconds(offset.saturating_sub(least.nanoseconds()).max(0))
    }

    /// The offset as it is believed at an instant of `B`, once a message was heard: `B` minus `A`.
    pub fn at(&self, now: Stamp<B>) -> Option<Span> {
        let both = self.now.iter().chain(&self.before);
        both.map(|least| least.at(now)).min().map(Span::from_nanoseconds)
    }

    /// An instant of `A` as `B` would have stamped it, had it been told with the smallest delay.
    pub fn brought(&self, instant: Stamp<A>, now: Stamp<B>) -> Option<Stamp<B>> {
        self.at(now).map(|offset| instant.on(offset))
    }

    /// An instant of `B` as `A` stood then, the smallest delay taken for none.
    pub fn taken_back(&self, instant: Stamp<B>) -> Option<Stamp<A>> {
        self.at(instant)
            .map(|offset| instant.on(Span::from_nanoseconds(offset.nanoseconds().saturating_neg())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArmClock, HostClock};

    const MS: i64 = 1_000_000;

    fn fresh() -> ClockOffset<ArmClock, HostClock> {
        ClockOffset::with_memory(Span::from_milliseconds(1000))
    }

    fn stamp<C: Clock>(nanoseconds: i64) -> Stamp<C> {
        Stamp::from_nanoseconds(nanoseconds)
    }

    #[test]
    fn the_smallest_delay_is_the_offset() {
        let mut offset = fresh();
        let delays = [9, 4, 7, 3, 11, 5];
        let late: Vec<_> = (0_i64..)
            .zip(delays)
            .map(|(n, delay)| {
                let sent = 2 * MS * n;
                offset.hear(stamp(sent), stamp(sent + (100 + delay) * MS)).nanoseconds()
            })
            .collect();
        // The drift that is allowed for is 100 ns a millisecond.
        let expected = [0, 0, 3 * MS - 500, 0, 8 * MS - 1000, 2 * MS - 800];
        for (late, expected) in late.iter().zip(expected) {
            assert!((late - expected).abs() < 500, "{late} is not {expected}");
        }
        let now = stamp(6 * MS + 103 * MS);
        assert_eq!(offset.at(now), Some(Span::from_milliseconds(103)));
        assert_eq!(offset.taken_back(now), Some(stamp(6 * MS)));
        assert_eq!(offset.brought(stamp(6 * MS), now), Some(now));
    }

    #[test]
    fn a_clock_that_drifts_is_followed() {
        let mut offset = fresh();
        let mut late = Span::ZERO;
        for n in 0..500_000_i64 {
            // B is 80 ppm slow against A, over 1000 s.
            let sent = 2 * MS * n;
            late = offset.hear(stamp(sent), stamp(sent + sent / 12_500));
        }
        assert!(late < Span::from_nanoseconds(100_000), "late by {late:?}");
    }

    #[test]
    fn a_clock_that_was_set_is_believed_after_its_memory() {
        let mut offset = fresh();
        let mut late = |ms: i64, set: i64| offset.hear(stamp(ms * MS), stamp((ms + set) * MS));
        assert!((0..1500).all(|ms| late(ms, 20) == Span::ZERO));
        assert!(late(1500, 50) > Span::from_milliseconds(29));
        let _ = (1501..4000).map(|ms| late(ms, 50)).max();
        assert_eq!(late(4000, 50), Span::ZERO);
        assert_eq!(late(4001, 20), Span::ZERO, "an earlier arrival is believed at once");
    }

    #[test]
    fn nothing_is_known_before_the_first_message() {
        assert_eq!(fresh().at(stamp(0)), None);
    }

    #[test]
    fn the_wildest_stamps_do_no_harm() {
        let mut offset = fresh();
        for (sent, arrived) in [(i64::MIN, i64::MAX), (i64::MAX, i64::MIN), (0, 0), (i64::MIN, i64::MIN)] {
            offset.hear(stamp(sent), stamp(arrived));
            offset.at(stamp(i64::MIN));
        }
    }
}
