//! [`Histogram`]: how long something took, over millions of ticks, in a fixed room.

use std::fmt;

use probepath_frames::Span;
use serde::{Deserialize, Serialize};

/// Buckets of one doubling: each is 1/32 of it wide, so a percentile is never more than 3.2 % too large.
const PER_DOUBLING: usize = 32;
const SHIFT: u32 = PER_DOUBLING.trailing_zeros();

/// Up to 2^38 ns, 4.6 minutes; what is longer counts as that, and the largest is kept exactly.
const DOUBLINGS: usize = 34;
const BUCKETS: usize = PER_DOUBLING * DOUBLINGS;

/// Counts of lengths of time in log-spaced buckets. Its room is fixed: counting touches no heap.
#[derive(Clone, PartialEq, Eq)]
pub struct Histogram {
    counts: [u64; BUCKETS],
    count: u64,
    longest: Span,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: [0; BUCKETS], count: 0, longest: Span::ZERO }
    }
}

impl Histogram {
    /// Counts one; what is negative counts as zero.
    pub fn record(&mut self, span: Span) {
        let nanoseconds = span.nanoseconds().max(0).unsigned_abs();
        if let Some(bucket) = self.counts.get_mut(bucket(nanoseconds)) {
            *bucket += 1;
        }
        self.count += 1;
        self.longest = self.longest.max(span);
    }

    /// How many were counted.
    pub const fn count(&self) -> u64 {
        self.count
    }

    /// The longest, exactly.
    pub const fn longest(&self) -> Span {
        self.longest
    }

    /// The length that a share (0 to 1) of all stayed within; never too short, at most 3.2 % too long. `None` when
    /// nothing was counted.
    pub fn within(&self, share: f64) -> Option<Span> {
        if self.count == 0 {
            return None;
        }
        let rank = ((share.clamp(0.0, 1.0) * self.count as f64).ceil() as u64).clamp(1, self.count);
        let mut seen = 0;
        for (bucket, count) in self.counts.iter().enumerate() {
            seen += count;
            if seen >= rank {
                return Some(Span::from_nanoseconds(longest_of(bucket)).min(self.longest));
            }
        }
        Some(self.longest)
    }

    /// Adds another's counts to its own.
    pub fn merge(&mut self, other: &Self) {
        for (mine, theirs) in self.counts.iter_mut().zip(&other.counts) {
            *mine += theirs;
        }
        self.count += other.count;
        self.longest = self.longest.max(other.longest);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Its figures; `None` when nothing was counted.
    pub fn figures(&self) -> Option<Figures> {
        let us = |share| self.within(share).map(|span| span.seconds() * 1e6);
        Some(Figures {
            count: self.count,
            p50_us: us(0.5)?,
            p99_us: us(0.99)?,
            p99_9_us: us(0.999)?,
            max_us: self.longest.seconds() * 1e6,
        })
    }

    /// The buckets that hold any: the longest that falls into each, and how many did.
    pub fn buckets(&self) -> impl Iterator<Item = (Span, u64)> {
        let all = self.counts.iter().enumerate();
        all.filter(|(_, count)| **count > 0).map(|(i, count)| (Span::from_nanoseconds(longest_of(i)), *count))
    }
}

/// What a histogram says, in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// How many were counted.
    pub count: u64,
    /// The median.
    pub p50_us: f64,
    /// What 99 of 100 stayed within.
    pub p99_us: f64,
    /// What 999 of 1,000 stayed within.
    pub p99_9_us: f64,
    /// The longest.
    pub max_us: f64,
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, p50_us, p99_us, p99_9_us, max_us } = self;
        write!(
            f,
            "p50 {p50_us:.1} us, p99 {p99_us:.1} us, p99.9 {p99_9_us:.1} us, max {max_us:.1} us ({count} counted)"
        )
    }
}

impl fmt::Display for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.figures() {
            Some(figures) => figures.fmt(f),
            None => write!(f, "nothing counted"),
        }
    }
}

/// Short: a thousand buckets help nobody.
impl fmt::Debug for Histogram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Histogram({self})")
    }
}

/// The bucket of a length: the first doubling (below 32 ns) is exact, the others are cut into 32 equal parts.
fn bucket(nanoseconds: u64) -> usize {
    let doubling = (u64::BITS - nanoseconds.leading_zeros()).saturating_sub(SHIFT + 1);
    let part = usize::try_from(nanoseconds >> doubling).unwrap_or(usize::MAX);
    (doubling as usize * PER_DOUBLING + part).min(BUCKETS - 1)
}

/// The longest that falls into a bucket.
fn longest_of(bucket: usize) -> i64 {
    if bucket < 2 * PER_DOUBLING {
        return i64::try_from(bucket).unwrap_or(i64::MAX);
    }
    let doubling = bucket / PER_DOUBLING - 1;
    let part = bucket - doubling * PER_DOUBLING;
    i64::try_from(((part + 1) << doubling) - 1).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn of(values: &[i64]) -> Histogram {
        let mut histogram = Histogram::default();
        values.iter().for_each(|ns| histogram.record(Span::from_nanoseconds(*ns)));
        histogram
    }

    #[test]
    fn every_length_falls_into_the_bucket_that_ends_with_it_or_later() {
        let mut last = 0;
        for ns in (0..100_000).chain((17..38).flat_map(|n| [(1_u64 << n) - 1, 1 << n, (1 << n) + 1])) {
            let bucket = bucket(ns);
            assert!(bucket >= last || ns < 200_000, "{ns}");
            last = bucket;
            let longest = longest_of(bucket);
            let ns = i64::try_from(ns).unwrap();
            assert!(longest >= ns && longest as f64 <= ns as f64 * 1.032, "{ns} in a bucket up to {longest}");
            assert!(bucket == 0 || longest_of(bucket - 1) < ns, "{ns} belongs into the bucket before");
        }
    }

    #[test]
    fn percentiles_are_those_of_the_sorted_list() {
        let mut dice = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..200 {
            let count = dice.random_range(1..3000);
            let mut values: Vec<i64> =
                (0..count).map(|_| 10_f64.powf(dice.random_range(0.0..10.0)) as i64).collect();
            let histogram = of(&values);
            values.sort_unstable();
            for share in [0.0, 0.5, 0.99, 0.999, 1.0] {
                let rank = ((share * values.len() as f64).ceil() as usize).max(1);
                let (exact, found) = (values[rank - 1], histogram.within(share).unwrap().nanoseconds());
                assert!(found >= exact && found as f64 <= exact as f64 * 1.032, "{found} for {exact}");
            }
            assert_eq!(histogram.longest().nanoseconds(), values[values.len() - 1]);
        }
    }

    #[test]
    fn merging_is_counting_together() {
        let (one, two) = (of(&[5, 700, 9_000_000]), of(&[6, 700, 80]));
        let mut both = one.clone();
        both.merge(&two);
        assert_eq!(both, of(&[5, 700, 9_000_000, 6, 700, 80]));
        assert_eq!(both.buckets().map(|(_, count)| count).sum::<u64>(), 6);
        both.clear();
        assert_eq!(both.figures(), None);
        assert_eq!(both.to_string(), "nothing counted");
    }

    #[test]
    fn the_longest_and_the_negative_have_a_place() {
        let wild = of(&[-5, i64::MAX, i64::MIN]);
        assert_eq!(wild.count(), 3);
        assert_eq!(wild.within(0.5), Some(Span::ZERO));
        assert_eq!(wild.longest(), Span::from_nanoseconds(i64::MAX));
    }
}
