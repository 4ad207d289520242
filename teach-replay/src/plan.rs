//! [`Plan`]: the whole replay, tried out before anything moves.

mod approach;
mod refusal;

use probepath_frames::{Base, Point, Pose, Probe};
use probepath_robot::motion::follow::{Curve, PoseCurve};
use probepath_robot::motion::timing::{PathLimits, PathSpeed};
use probepath_robot::{ContactSettings, InverseOptions, Joints, Plane, Workspace};

use crate::probe_arm::along_z;
use crate::{Path, ProbeArm};
pub(crate) use approach::{Leg, legs};
pub use refusal::{Place, PlanError, Refusal};

/// Part of what the path leaves that the contact uses: the joints' slopes differ a little on the way down.
const FOR_CONTACT: f64 = 0.9;
/// Steps of a descent or a lift that is tried out (m).
const DESCENT_STEP: f64 = 0.002;

/// How a path is to be replayed, as far as planning has to know.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanSettings {
    /// Speed along the path.
    pub speed: PathSpeed,
    /// Height over the skin where the approach ends and the lift-off leads to (m, along the probe's axis).
    pub standoff: f64,
    /// How far the contact may move the probe off the path, either way (m).
    pub offset: f64,
    /// Height over the higher of start and standoff at which the arm travels (m).
    pub clearance: f64,
    /// Speed of the probe through the air (m/s).
    pub air_speed: f64,
    /// The smallest singular value of the Jacobian that is allowed.
    pub least_singular: f64,
    /// Distance that joints keep from their limits (rad, m).
    pub joint_margin: f64,
    /// Part of the joints' velocity, acceleration and jerk for the way along the path; the rest is for the contact.
    pub share: f64,
    /// Where the probe's origin may be.
    pub workspace: Workspace,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self {
            speed: PathSpeed::gentle(0.01),
            standoff: 0.04,
            offset: 0.015,
            clearance: 0.05,
            air_speed: 0.1,
            least_singular: 0.02,
            joint_margin: 0.02,
            share: 0.5,
            workspace: Workspace::new(),
        }
    }
}

/// What the plan found on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanReport {
    /// The smallest singular value, and where (m along the path).
    pub least_singular: (f64, f64),
    /// The least distance of any joint to its limits (rad, m), and where (m along the path).
    pub least_margin: (f64, f64),
    /// Where the path is slowest (m along the path), and how slow (m/s).
    pub slowest: (f64, f64),
    /// How long the approach takes, without pauses (s).
    pub approach_s: f64,
    /// How long the path takes, without pauses (s).
    pub path_s: f64,
}

/// A replay that was found possible: reachable, within limits, away from singularities, inside the workspace.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(crate) arm: ProbeArm,
    pub(crate) curve: PoseCurve,
    pub(crate) start: Joints,
    pub(crate) legs: Vec<Leg>,
    pub(crate) timing: PathLimits,
    /// The most that each joint moves for a metre along the probe's axis (rad/m, 1), anywhere on the path.
    axial: Joints,
    pub(crate) settings: PlanSettings,
    report: PlanReport,
}

impl Plan {
    /// Tries out the replay of `path` from the commanded joints `start`: the approach (up first, over, down to the
    /// standoff), the descent, every point of the path with the contact's offset either way, the lift-off, and the
    /// speed.
    ///
    /// # Errors
    /// With the place, in millimetres along the path, and the reason.
    pub fn new(
        path: &Path,
        arm: &ProbeArm,
        start: &Joints,
        settings: &PlanSettings,
    ) -> Result<Self, PlanError> {
        settings.check()?;
        arm.limits.check().map_err(|why| PlanError::new(Place::Start, Refusal::Limits(why)))?;
        let curve = path.curve();
        let goal = along_z(&curve.at(0.0).base_from_probe, -settings.standoff);
        let above = arm
            .model
            .inverse(&goal, &arm.flange_from_probe, start, &InverseOptions::default())
            .map_err(|why| PlanError::new(Place::Standoff, Refusal::Unreachable(why)))?;
        let legs = legs(arm, settings, start, &above)?;
        let mut tour = Tour { arm, settings, report: EMPTY, axial: Joints::zeros(start.len()) };
        let postures = tour.along(curve, path.spacing(), &above)?;
        let timing =
            PathLimits::new(path.spacing(), &postures, &arm.limits.scaled(settings.share), settings.speed)
                .map_err(|why| PlanError::new(Place::Start, Refusal::Timing(why)))?;
        let report = PlanReport {
            slowest: timing.slowest(),
            approach_s: legs.iter().map(Leg::duration_s).sum(),
            path_s: timing.duration_s(),
            ..tour.report
        };
        refuse_crawling(&report, settings)?;
        let axial = tour.axial;
        let (arm, settings) = (arm.clone(), settings.clone());
        Ok(Self { axial, arm, curve: curve.clone(), start: *start, legs, timing, settings, report })
    }

    /// The contact's law, no faster than the joints can follow with what the path leaves them.
    pub(crate) fn slowed(&self, law: ContactSettings) -> ContactSettings {
        let limits = self.arm.limits.scaled((1.0 - self.settings.share) * FOR_CONTACT);
        let most = |limit: &Joints| {
            let each = limit.zip(&self.axial, |limit, slope| limit / slope.max(1e-9));
            each.iter().fold(f64::INFINITY, f64::min)
        };
        ContactSettings {
            speed_m_s: law.speed_m_s.min(most(&limits.velocity)),
            acceleration_m_s2: law.acceleration_m_s2.min(most(&limits.acceleration)),
            jerk_m_s3: law.jerk_m_s3.min(most(&limits.jerk)),
            ..law
        }
    }

    /// What was found on the way.
    pub const fn report(&self) -> &PlanReport {
        &self.report
    }

    /// The smooth path that will be followed.
    pub const fn curve(&self) -> &PoseCurve {
        &self.curve
    }

    /// The arm it was planned for.
    pub const fn arm(&self) -> &ProbeArm {
        &self.arm
    }

    /// The commanded joints that it starts from.
    pub const fn start(&self) -> &Joints {
        &self.start
    }

    /// How it was planned.
    pub const fn settings(&self) -> &PlanSettings {
        &self.settings
    }
}

impl PlanSettings {
    fn check(&self) -> Result<(), PlanError> {
        let numbers = [
            ("standoff", self.standoff, 0.1),
            ("offset", self.offset, 0.1),
            ("clearance", self.clearance, 0.5),
            ("air_speed", self.air_speed, 0.25),
            ("least_singular", self.least_singular, 1.0),
            ("share", self.share, 0.9),
        ];
        let bad = numbers.into_iter().find(|(_, value, most)| !(*value > 0.0 && value <= most));
        match bad {
            Some((name, value, most)) => {
                Err(PlanError::new(Place::Start, Refusal::Setting { name, value, most }))
            }
            None if self.joint_margin >= 0.0 => Ok(()),
            None => {
                let refusal = Refusal::Setting { name: "joint_margin", value: self.joint_margin, most: 1.0 };
                Err(PlanError::new(Place::Start, refusal))
            }
        }
    }
}

const EMPTY: PlanReport = PlanReport {
    least_singular: (f64::INFINITY, 0.0),
    least_margin: (f64::INFINITY, 0.0),
    slowest: (0.0, 0.0),
    approach_s: 0.0,
    path_s: 0.0,
};

/// A bend that would bring the probe to a crawl is no scan.
fn refuse_crawling(report: &PlanReport, settings: &PlanSettings) -> Result<(), PlanError> {
    let (at, speed) = report.slowest;
    if speed < 0.1 * settings.speed.speed {
        let refusal = Refusal::Crawl { speed_mm_s: speed * 1e3, wanted_mm_s: settings.speed.speed * 1e3 };
        return Err(PlanError::new(Place::path(at, 0.0), refusal));
    }
    Ok(())
}

/// The first plane of the workspace that a point lies beyond, and by how much (m).
pub(crate) fn outside(workspace: &Workspace, point: &Point<Base>) -> Option<(usize, f64)> {
    let beyond = |plane: &Plane| (plane.through.vector() - point.vector()).dot(&plane.inward.vector());
    workspace.planes().iter().map(beyond).enumerate().find(|(_, beyond)| *beyond > 0.0)
}

/// The first joint that is nearer than `least` to a limit, by name, and how near (rad, m).
pub(crate) fn too_near_to_a_limit(arm: &ProbeArm, joints: &Joints, least: f64) -> Option<(String, f64)> {
    let left = |i: usize| (joints[i] - arm.limits.lower[i]).min(arm.limits.upper[i] - joints[i]);
    let joint = (0..joints.len()).find(|i| left(*i) < least)?;
    Some((arm.model.joint_names().get(joint).cloned().unwrap_or_default(), left(joint)))
}

/// The way along the path, posture after posture.
struct Tour<'a> {
    arm: &'a ProbeArm,
    settings: &'a PlanSettings,
    report: PlanReport,
    axial: Joints,
}

impl Tour<'_> {
    /// Down from the standoff, along the path with the offset either way, and up again; the postures on the path.
    fn along(&mut self, curve: &PoseCurve, spacing: f64, above: &Joints) -> Result<Vec<Joints>, PlanError> {
        let mut near = self.plunge(curve, 0.0, above)?;
        let count = (curve.length() / spacing).round() as usize + 1;
        let mut postures = Vec::with_capacity(count);
        for i in 0..count {
            let s = i as f64 * spacing;
            near = self.posture(curve, s, 0.0, &near)?;
            postures.push(near);
            let deep = self.posture(curve, s, self.settings.offset, &near)?;
            let high = self.posture(curve, s, -self.settings.offset, &near)?;
            for end in [deep, high] {
                let slope = end.zip(&near, |a, b| ((a - b) / self.settings.offset).abs());
                self.axial = self.axial.zip(&slope, f64::max);
            }
        }
        self.lift(curve, curve.length(), &near)?;
        Ok(postures)
    }

    fn plunge(&mut self, curve: &PoseCurve, s: f64, above: &Joints) -> Result<Joints, PlanError> {
        let steps = (self.settings.standoff / DESCENT_STEP).ceil() as usize;
        (0..=steps).try_fold(*above, |near, i| {
            let up = self.settings.standoff * (1.0 - i as f64 / steps as f64);
            self.posture(curve, s, -up, &near)
        })
    }

    fn lift(&mut self, curve: &PoseCurve, s: f64, on: &Joints) -> Result<Joints, PlanError> {
        let steps = (self.settings.standoff / DESCENT_STEP).ceil() as usize;
        (0..=steps).try_fold(*on, |near, i| {
            self.posture(curve, s, -self.settings.standoff * i as f64 / steps as f64, &near)
        })
    }

    /// The posture at `s`, `offset` further along the probe's axis, checked.
    fn posture(
        &mut self,
        curve: &PoseCurve,
        s: f64,
        offset: f64,
        near: &Joints,
    ) -> Result<Joints, PlanError> {
        let place = Place::path(s, offset);
        let pose = along_z(&curve.at(s).base_from_probe, offset);
        let Some(joints) = self.arm.joints(&pose, near) else {
            return Err(PlanError::new(place, self.why_not(&pose, near)));
        };
        if let Some((plane, beyond)) = outside(&self.settings.workspace, &pose.origin()) {
            return Err(PlanError::new(place, Refusal::Workspace { plane, beyond_mm: beyond * 1e3 }));
        }
        self.margin(place, s, &joints)?;
        let singular = self.arm.distance_to_singularity(&joints);
        if singular < self.report.least_singular.0 {
            self.report.least_singular = (singular, s);
        }
        if singular >= self.settings.least_singular {
            return Ok(joints);
        }
        let least = self.settings.least_singular;
        Err(PlanError::new(place, Refusal::Singular { found: singular, least }))
    }

    fn margin(&mut self, place: Place, s: f64, joints: &Joints) -> Result<(), PlanError> {
        let limits = &self.arm.limits;
        for joint in 0..joints.len() {
            let left = (joints[joint] - limits.lower[joint]).min(limits.upper[joint] - joints[joint]);
            if left < self.report.least_margin.0 {
                self.report.least_margin = (left, s);
            }
        }
        let least = self.settings.joint_margin;
        let found = too_near_to_a_limit(self.arm, joints, least);
        found.map_or(Ok(()), |(joint, left)| {
            Err(PlanError::new(place, Refusal::JointLimit { joint, left, least }))
        })
    }

    /// Tracking failed: is there any posture at all?
    fn why_not(&self, pose: &Pose<Base, Probe>, near: &Joints) -> Refusal {
        match self.arm.model.inverse(pose, &self.arm.flange_from_probe, near, &InverseOptions::default()) {
            Err(why) => Refusal::Unreachable(why),
            Ok(other) => Refusal::OtherPosture { away: near.zip(&other, |a, b| a - b).largest() },
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
