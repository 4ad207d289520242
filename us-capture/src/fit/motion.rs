//! The probe at an instant: its pose, and how it moves.

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Probe, Span, Stamp, Track, World};

/// Half of the time over which a velocity is taken, at least and at most (s).
const HALF_STEP_S: (f64, f64) = (1e-3, 50e-3);

/// Where the probe is, and how it moves there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) world_from_probe: Isometry3<f64>,
    /// Velocity of the probe's origin, in the probe (m/s).
    pub(super) linear: Vector3<f64>,
    /// In the probe (rad/s).
    pub(super) angular: Vector3<f64>,
}

/// Half of the median time between samples: a track is straight between them, so that a shorter step would see its
/// corners, and a tracker's noise, as motion.
pub(super) fn half_step_s(track: &Track<World, Probe>) -> f64 {
    let mut steps: Vec<f64> = track.samples().windows(2).map(|w| (w[1].0 - w[0].0).seconds()).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return HALF_STEP_S.0;
    }
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    (*median / 2.0).clamp(HALF_STEP_S.0, HALF_STEP_S.1)
}

/// The pose alone; `None` outside the track.
pub(super) fn pose(track: &Track<World, Probe>, stamp: Stamp, lag_s: f64) -> Option<Isometry3<f64>> {
    track.at(stamp + Span::from_seconds(lag_s)).ok().map(|pose| *pose.isometry())
}

/// Pose and velocity; `None` outside the track. At its ends the velocity is taken on one side.
pub(super) fn moment(
    track: &Track<World, Probe>,
    stamp: Stamp,
    lag_s: f64,
    half_step_s: f64,
) -> Option<Moment> {
    let here = track.at(stamp + Span::from_seconds(lag_s)).ok()?;
    let side = |by: f64| track.at(stamp + Span::from_seconds(lag_s + by)).ok();
    let (before, after) = (side(-half_step_s), side(half_step_s));
    let seconds = half_step_s * f64::from(u8::from(before.is_some()) + u8::from(after.is_some()));
    let (before, after): (Pose<World, Probe>, _) = (before.unwrap_or(here), after.unwrap_or(here));
    let twist = before.twist_to(&after);
    let per_second = if seconds > 0.0 { 1.0 / seconds } else { 0.0 };
    Some(Moment {
        world_from_probe: *here.isometry(),
        linear: twist.linear * per_second,
        angular: twist.angular * per_second,
    })
}
