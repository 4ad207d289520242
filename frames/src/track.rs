//! A pose that moves.

use crate::{Clock, ExamClock, Frame, Pose, Span, Stamp, TrackError};

/// System `B` in `A` over time: samples in order of their stamps, asked in between.
#[derive(Clone, Debug)]
pub struct Track<A: Frame, B: Frame, C: Clock = ExamClock> {
    samples: Vec<(Stamp<C>, Pose<A, B>)>,
    widest_gap: Span,
}

impl<A: Frame, B: Frame, C: Clock> Track<A, B, C> {
    /// An empty track that refuses to interpolate between samples further apart than `widest_gap`.
    pub const fn new(widest_gap: Span) -> Self {
        Self { samples: Vec::new(), widest_gap }
    }

    /// Adds the next sample.
    ///
    /// # Errors
    /// When its stamp is not after the last one, or a number is not finite.
    pub fn push(&mut self, stamp: Stamp<C>, pose: Pose<A, B>) -> Result<(), TrackError> {
        if !pose.is_finite() {
            return Err(TrackError::NotFinite { at_s: stamp.seconds() });
        }
        if let Some((last, _)) = self.samples.last()
            && stamp <= *last
        {
            return Err(TrackError::OutOfOrder { at_s: stamp.seconds(), last_s: last.seconds() });
        }
        self.samples.push((stamp, pose));
        Ok(())
    }

    /// The pose at `stamp`, along the screw between its neighbours.
    ///
    /// # Errors
    /// When the track is empty, the stamp lies outside its span (nothing is extrapolated), or its neighbours are
    /// further apart than the widest gap; each says how far.
    pub fn at(&self, stamp: Stamp<C>) -> Result<Pose<A, B>, TrackError> {
        let (Some(first), Some(last)) = (self.samples.first(), self.samples.last()) else {
            return Err(TrackError::Empty);
        };
        let outside = |by: Span| TrackError::Outside {
            at_s: stamp.seconds(),
            first_s: first.0.seconds(),
            last_s: last.0.seconds(),
            by_s: by.seconds(),
        };
        if stamp < first.0 {
            return Err(outside(first.0 - stamp));
        }
        if stamp > last.0 {
            return Err(outside(stamp - last.0));
        }
        let after = self.samples.partition_point(|(s, _)| *s < stamp);
        let (t1, p1) = self.samples[after];
        if t1 == stamp {
            return Ok(p1);
        }
        let (t0, p0) = self.samples[after - 1];
        let gap = t1 - t0;
        if gap > self.widest_gap {
            return Err(TrackError::Gap {
                at_s: stamp.seconds(),
                from_s: t0.seconds(),
                until_s: t1.seconds(),
                widest_s: self.widest_gap.seconds(),
            });
        }
        Ok(p0.interpolate(&p1, (stamp - t0).seconds() / gap.seconds()))
    }

    /// The samples, in order.
    pub fn samples(&self) -> &[(Stamp<C>, Pose<A, B>)] {
        &self.samples
    }

    /// Samples further apart than this are not interpolated between.
    pub const fn widest_gap(&self) -> Span {
        self.widest_gap
    }

    /// First and last stamp, if there is any sample.
    pub fn span(&self) -> Option<(Stamp<C>, Stamp<C>)> {
        Some((self.samples.first()?.0, self.samples.last()?.0))
    }

    /// Forgets the samples before `stamp`, but keeps the last of them so that `stamp` itself can still be asked.
    pub fn forget_before(&mut self, stamp: Stamp<C>) {
        let keep_from = self.samples.partition_point(|(s, _)| *s <= stamp).saturating_sub(1);
        self.samples.drain(..keep_from);
    }
}
