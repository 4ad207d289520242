//! The way through the air: up first, over, down to the standoff.

use nalgebra::Vector3;
use probepath_frames::{Base, Pose, Probe};
use probepath_robot::motion::timing::{PathClock, PathLimits, PathSpeed};
use probepath_robot::{InverseOptions, Joints, PointToPoint};

use super::{Place, PlanError, PlanSettings, Refusal};
use crate::ProbeArm;

/// Part of the joints' limits that a leg is planned with: its time is slowed down and stretched for a pause, which
/// needs some of them too.
const SHARE: f64 = 0.4;
/// How fast the pace of a leg changes (1/s, 1/s^2).
const PACE_CHANGE: f64 = 1.5;
const PACE_JERK: f64 = 6.0;
/// Time between two looks at where a leg leads (s).
const LOOK_S: f64 = 0.02;
/// A start this near to the standoff (rad, m) needs no way through the air; further away it would be a jump.
const THERE: f64 = 1e-9;

/// One part of the approach: a motion in joint space, and the clock of its time, which a pause stops.
#[derive(Clone, Debug)]
pub(crate) struct Leg {
    motion: PointToPoint,
    clock: PathClock,
    pace: f64,
}

impl Leg {
    pub(crate) fn new(
        arm: &ProbeArm,
        from: &Joints,
        to: &Joints,
        settings: &PlanSettings,
        place: Place,
    ) -> Result<Self, PlanError> {
        let refuse = |refusal| PlanError::new(place, refusal);
        let motion = PointToPoint::plan(from, to, &arm.limits.scaled(SHARE), arm.period)
            .map_err(|why| refuse(Refusal::NoMove(why)))?;
        let fastest = look(arm, &motion, settings, place)?;
        let pace = (settings.air_speed / fastest).min(1.0);
        let speed = PathSpeed { speed: pace, acceleration: PACE_CHANGE, jerk: PACE_JERK };
        // Longer than the motion, which comes to rest by itself: the clock must not slow down for its own end.
        let limits = PathLimits::uniform(motion.duration_s() + 2.0, speed)
            .map_err(|why| refuse(Refusal::Timing(why)))?;
        Ok(Self { motion, clock: PathClock::new(limits), pace })
    }

    /// How long it takes (s), ramps left out.
    pub(crate) fn duration_s(&self) -> f64 {
        self.motion.duration_s() / self.pace
    }

    /// The next joints, at this share of the leg's pace (0 to rest); none when the leg is done.
    pub(crate) fn step(&mut self, share: f64, dt: f64) -> Option<Joints> {
        if self.clock.at() >= self.motion.duration_s() {
            return None;
        }
        let time = self.clock.step(self.pace * share.clamp(0.0, 1.0), dt);
        Some(self.motion.at(time))
    }
}

/// The fastest that the probe goes (m/s), when it stays inside the workspace.
fn look(
    arm: &ProbeArm,
    motion: &PointToPoint,
    settings: &PlanSettings,
    place: Place,
) -> Result<f64, PlanError> {
    let looks = (motion.duration_s() / LOOK_S).ceil() as usize;
    let (mut before, mut fastest) = (None, 1e-6_f64);
    for i in 0..=looks {
        let here = arm.probe(&motion.at(i as f64 * LOOK_S)).origin();
        if let Some((plane, beyond)) = settings.workspace.crossed(&here, &before.unwrap_or(here)) {
            return Err(PlanError::new(place, Refusal::Workspace { plane, beyond_mm: beyond * 1e3 }));
        }
        fastest = before.map_or(fastest, |before| fastest.max(here.distance(&before) / LOOK_S));
        before = Some(here);
    }
    Ok(fastest)
}

/// The legs from `start` to `above`; none when it is there already.
pub(crate) fn legs(
    arm: &ProbeArm,
    settings: &PlanSettings,
    start: &Joints,
    above: &Joints,
) -> Result<Vec<Leg>, PlanError> {
    if start.zip(above, |a, b| a - b).largest() < THERE {
        return Ok(Vec::new());
    }
    let (from, to) = (arm.probe(start), arm.probe(above));
    let height = from.origin().vector().z.max(to.origin().vector().z) + settings.clearance;
    let raised = find(arm, &at_height(&from, height), start, 1)?;
    let over = find(arm, &at_height(&to, height), above, 2)?;
    let stops = [*start, raised, over, *above];
    let mut legs = Vec::with_capacity(3);
    for (i, pair) in stops.windows(2).enumerate() {
        legs.push(Leg::new(arm, &pair[0], &pair[1], settings, Place::Approach { leg: i + 1 })?);
    }
    Ok(legs)
}

fn find(arm: &ProbeArm, pose: &Pose<Base, Probe>, near: &Joints, leg: usize) -> Result<Joints, PlanError> {
    arm.model
        .inverse(pose, &arm.flange_from_probe, near, &InverseOptions::default())
        .map_err(|why| PlanError::new(Place::Approach { leg }, Refusal::Unreachable(why)))
}

fn at_height(pose: &Pose<Base, Probe>, height: f64) -> Pose<Base, Probe> {
    let mut isometry = *pose.isometry();
    let place: &mut Vector3<f64> = &mut isometry.translation.vector;
    place.z = height;
    // FRAMES: the same probe in Base, at another height over it.
    Pose::assume(isometry)
}
