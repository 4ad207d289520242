//! The probe at an instant: its pose, and how it moves.
//!
//! A pose that is repeated while stamps go on may be a stale encoder, or a probe at rest (the stepper of PLUS's data
//! pauses between two moves for 0.3 s: poses and dots rest together). Nothing is left out for it: the poses of a stale
//! encoder make outliers of their images, and the fit weighs them down.

use nalgebra::Isometry3;
use probepath_frames::{Pose, Probe, Span, Stamp, Track, Twist, World};

/// Half of the time over which a velocity is taken (s). A track is straight between its samples, and a tracker trembles:
/// a shorter time would take corners and trembling for motion, and a probe in a hand keeps its velocity for longer.
const HALF_STEP_S: f64 = 50e-3;

/// Where the probe is, and how it moves there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) world_from_probe: Pose<World, Probe>,
    /// In the probe.
    pub(super) twist: Twist<Probe>,
}

impl Moment {
    /// At rest: of images that have no pose.
    pub(super) fn rest() -> Self {
        // FRAMES: a place holder; an image that has no pose takes no part.
        Self { world_from_probe: Pose::assume(Isometry3::identity()), twist: Twist::zero() }
    }

    /// At this instant; `None` where the track has no pose. At its ends the velocity is taken on one side.
    pub(super) fn at(track: &Track<World, Probe>, stamp: Stamp, lag_s: f64) -> Option<Self> {
        let here = pose(track, stamp, lag_s)?;
        let (before, after) =
            (pose(track, stamp, lag_s - HALF_STEP_S), pose(track, stamp, lag_s + HALF_STEP_S));
        let sides = f64::from(u8::from(before.is_some()) + u8::from(after.is_some()));
        let twist = before.unwrap_or(here).twist_to(&after.unwrap_or(here));
        let per_s = 1.0 / (sides.max(1.0) * HALF_STEP_S);
        Some(Self { world_from_probe: here, twist: Twist::new(twist.linear * per_s, twist.angular * per_s) })
    }

    /// The pose a little later.
    pub(super) fn after(&self, seconds: f64) -> Isometry3<f64> {
        if seconds == 0.0 {
            return *self.world_from_probe.isometry();
        }
        *self.world_from_probe.moved_by(&self.twist, seconds).isometry()
    }
}

/// The pose alone; `None` where the track has none.
pub(super) fn pose(track: &Track<World, Probe>, stamp: Stamp, lag_s: f64) -> Option<Pose<World, Probe>> {
    track.at(stamp + Span::from_seconds(lag_s)).ok()
}
