//! [`Capture`]: B-scans meet the probe's track, and are kept at uniform spacing along the path.
//!
//! Every tick of the control loop gives a pose of the probe and the wrench; B-scans come later than they were formed.
//! A B-scan waits until the track covers the instant it was formed (its stamp and the calibration's lag), gets the
//! pose and the wrench of that instant, interpolated, and is kept or dropped; whatever is dropped is counted by
//! reason. Nothing is extrapolated.

mod spacing;

use std::collections::VecDeque;

use probepath_frames::{Pose, Probe, Span, Stamp, Track, TrackError, World, Wrench};
use thiserror::Error;

use crate::{BScan, BScanSource, BadCalibration, Calibration, PlacedBScan, SourceFault};
use spacing::Spacing;

/// Poses further apart than this are not interpolated between: a control loop that missed ten ticks.
const WIDEST_GAP: Span = Span::from_milliseconds(20);
/// Poses older than this are forgotten: no machine is later with an image.
const KEPT: Span = Span::from_milliseconds(2_000);
/// How old the oldest pose may get before the old ones are forgotten.
const FORGET_AFTER: Span = Span::from_milliseconds(4_000);
/// Images that may wait for their pose; more means that the poses have stopped.
const MOST_WAITING: usize = 128;
/// Without an image for this long the machine has stalled (FIELD.md, section 10).
const STALLED_AFTER: Span = Span::from_milliseconds(200);

/// Which B-scans are kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Keeping {
    /// Every one.
    All,
    /// The nearest to each mark along the path, the marks this far apart (m), as in [P1].
    Spaced {
        /// From one mark to the next, along the way of the probe's origin (m).
        every_m: f64,
    },
}

/// What became of the B-scans that came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Came from the source.
    pub arrived: u64,
    /// Kept.
    pub kept: u64,
    /// Dropped because another was nearer to its mark along the path.
    pub between_marks: u64,
    /// Dropped because they were formed before the track began, or so long ago that it was forgotten.
    pub before_track: u64,
    /// Dropped because they were formed after the track ended.
    pub after_track: u64,
    /// Dropped because the track has a gap there.
    pub in_gap: u64,
    /// Dropped because their number or stamp did not increase.
    pub out_of_order: u64,
    /// Lost on the way: numbers that were skipped.
    pub lost: u64,
    /// Marks that no B-scan was nearest to: the probe went too fast for the machine's rate.
    pub marks_without: u64,
}

impl Counts {
    /// All that arrived and were not kept.
    pub const fn dropped(&self) -> u64 {
        self.between_marks + self.before_track + self.after_track + self.in_gap + self.out_of_order
    }
}

/// Why nothing more can be captured.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// A spacing that is none.
    #[error("B-scans cannot be kept every {every_mm} mm: the spacing has to be more than zero")]
    Spacing {
        /// What came.
        every_mm: f64,
    },
    /// A pose that the track refuses.
    #[error("the probe's pose: {0}")]
    Pose(#[from] TrackError),
    /// The machine is set otherwise than it was calibrated.
    #[error("B-scan {number}: {source}")]
    Setting {
        /// The B-scan.
        number: u64,
        /// What differs.
        source: BadCalibration,
    },
    /// The machine's stream broke.
    #[error(transparent)]
    Source(#[from] SourceFault),
}

/// Joins B-scans to the probe's track, and keeps those that are wanted.
pub struct Capture {
    calibration: Calibration,
    track: Track<World, Probe>,
    wrenches: VecDeque<(Stamp, Wrench<Probe>)>,
    waiting: VecDeque<BScan>,
    last: Option<(u64, Stamp)>,
    heard: Option<Stamp>,
    spacing: Option<Spacing>,
    ready: VecDeque<PlacedBScan>,
    counts: Counts,
}

impl Capture {
    /// A capture through this calibration.
    ///
    /// # Errors
    /// When the spacing is not a length.
    pub fn new(calibration: Calibration, keeping: Keeping) -> Result<Self, CaptureError> {
        let spacing = match keeping {
            Keeping::All => None,
            Keeping::Spaced { every_m } if every_m > 0.0 && every_m.is_finite() => {
                Some(Spacing::new(every_m))
            }
            Keeping::Spaced { every_m } => return Err(CaptureError::Spacing { every_mm: every_m * 1e3 }),
        };
        Ok(Self {
            calibration,
            track: Track::new(WIDEST_GAP),
            wrenches: VecDeque::new(),
            waiting: VecDeque::new(),
            last: None,
            heard: None,
            spacing,
            ready: VecDeque::new(),
            counts: Counts::default(),
        })
    }

    /// Where the probe was at a tick and, with a sensor, what pushed it. Ticks outside the scan are simply not given:
    /// B-scans formed then are dropped and counted.
    ///
    /// # Errors
    /// When the stamp is not after the last one, or the pose is not finite.
    pub fn tick(
        &mut self,
        stamp: Stamp,
        world_from_probe: Pose<World, Probe>,
        wrench: Option<Wrench<Probe>>,
    ) -> Result<(), CaptureError> {
        self.track.push(stamp, world_from_probe)?;
        if let Some(wrench) = wrench.filter(Wrench::is_finite) {
            self.wrenches.push_back((stamp, wrench));
        }
        self.forget(stamp);
        self.place_waiting();
        Ok(())
    }

    /// Listens to the machine from now on: that nobody did before is no silence of its.
    pub const fn listen(&mut self, now: Stamp) {
        self.heard = Some(now);
    }

    /// Takes every B-scan that has arrived by `now`.
    ///
    /// # Errors
    /// When the machine's stream broke, or it is set otherwise than it was calibrated.
    pub fn poll(&mut self, source: &mut dyn BScanSource, now: Stamp) -> Result<(), CaptureError> {
        self.heard.get_or_insert(now);
        while let Some(bscan) = source.poll(now)? {
            self.heard = Some(now);
            self.arrive(bscan)?;
        }
        self.place_waiting();
        Ok(())
    }

    /// The next B-scan that is kept, in the order they were formed.
    pub fn take(&mut self) -> Option<PlacedBScan> {
        self.ready.pop_front()
    }

    /// Ends the scan: B-scans that still wait have no pose, and the last mark gets its nearest. Then
    /// [`Capture::take`] gives the rest.
    pub fn finish(&mut self) {
        self.counts.after_track += self.waiting.len() as u64;
        self.waiting.clear();
        if let Some(held) = self.spacing.as_mut().and_then(Spacing::finish) {
            self.keep(held);
        }
    }

    /// What became of the B-scans so far.
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    /// How long the machine has been silent, when that is longer than 200 ms: pause the scan.
    pub fn stalled(&self, now: Stamp) -> Option<Span> {
        self.heard.map(|heard| now - heard).filter(|silence| *silence > STALLED_AFTER)
    }

    fn arrive(&mut self, bscan: BScan) -> Result<(), CaptureError> {
        self.counts.arrived += 1;
        let number = bscan.number;
        self.calibration
            .check_setting(&bscan.setting)
            .map_err(|source| CaptureError::Setting { number, source })?;
        if let Some((last, formed)) = self.last {
            if number <= last || bscan.formed <= formed {
                self.counts.out_of_order += 1;
                return Ok(());
            }
            self.counts.lost += number - last - 1;
        }
        self.last = Some((number, bscan.formed));
        self.waiting.push_back(bscan);
        if self.waiting.len() > MOST_WAITING && self.waiting.pop_front().is_some() {
            self.counts.after_track += 1;
        }
        Ok(())
    }

    /// Places every waiting B-scan whose instant the track covers.
    fn place_waiting(&mut self) {
        let Some((_, newest)) = self.track.span() else { return };
        while let Some(bscan) =
            self.waiting.pop_front_if(|bscan| bscan.formed + self.calibration.image_lag <= newest)
        {
            self.place(bscan);
        }
    }

    fn place(&mut self, bscan: BScan) {
        let instant = bscan.formed + self.calibration.image_lag;
        let world_from_probe = match self.track.at(instant) {
            Ok(pose) => pose,
            Err(TrackError::Gap { .. }) => return self.counts.in_gap += 1,
            Err(_) => return self.counts.before_track += 1,
        };
        let placed = PlacedBScan {
            bscan,
            world_from_probe,
            world_from_image: world_from_probe * self.calibration.probe_from_image,
            wrench: self.wrench_at(instant),
        };
        match &mut self.spacing {
            None => self.keep(placed),
            Some(spacing) => {
                if let Some(kept) = spacing.offer(placed, &mut self.counts) {
                    self.keep(kept);
                }
            }
        }
    }

    fn keep(&mut self, placed: PlacedBScan) {
        self.counts.kept += 1;
        self.ready.push_back(placed);
    }

    /// The wrench between the two samples around `instant`; none where one is missing or they are too far apart.
    fn wrench_at(&self, instant: Stamp) -> Option<Wrench<Probe>> {
        let after = self.wrenches.partition_point(|(stamp, _)| *stamp < instant);
        let (t1, w1) = self.wrenches.get(after)?;
        if *t1 == instant {
            return Some(*w1);
        }
        let (t0, w0) = self.wrenches.get(after.checked_sub(1)?)?;
        let gap = *t1 - *t0;
        let part = (instant - *t0).seconds() / gap.seconds();
        (gap <= WIDEST_GAP)
            .then(|| Wrench::new(w0.force.lerp(&w1.force, part), w0.torque.lerp(&w1.torque, part)))
    }

    /// Forgets old poses and wrenches, now and then: moving the rest down costs more than a few seconds of poses.
    fn forget(&mut self, now: Stamp) {
        let Some((first, _)) = self.track.span() else { return };
        if now - first > FORGET_AFTER {
            self.track.forget_before(now - KEPT);
            let keep_from =
                self.wrenches.partition_point(|(stamp, _)| *stamp <= now - KEPT).saturating_sub(1);
            self.wrenches.drain(..keep_from);
        }
    }
}

#[cfg(test)]
mod tests;
