//! [`Bins`]: what was recorded in contact, averaged over steps of progress.

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use probepath_frames::Pose;
use probepath_robot::motion::follow::CurveError;
use probepath_robot::motion::spline::Spline;

use super::PathPoint;
use super::clean::{Bridge, Cleaning, Contact, place};
use super::smooth::Weighted;
use crate::{PathError, Sample};

/// How far from the middle orientation one path may turn (rad), as for a curve.
const TURN_WITHIN: f64 = 2.4;

/// Means of origin and rotation vector over steps of progress; a step never seen weighs nothing.
pub(super) struct Bins {
    step: f64,
    middle: UnitQuaternion<f64>,
    pub(super) values: Vec<Weighted<6>>,
}

impl Bins {
    pub(super) fn of(contact: &Contact<'_>, step: f64) -> Result<Self, PathError> {
        let length = contact.used().fold(0.0_f64, |most, (_, s)| most.max(s));
        let count = (length / step).floor() as usize + 1;
        let middle = contact
            .kept
            .get(contact.kept.len() / 2)
            .map_or(UnitQuaternion::identity(), |i| contact.samples[*i].base_from_probe.isometry().rotation);
        let mut values = vec![(0.0_f64, SVector::zeros()); count];
        for (sample, s) in contact.used() {
            let bin = (s / step).round();
            let Some((weight, sum)) = (bin >= 0.0).then(|| values.get_mut(bin as usize)).flatten() else {
                continue;
            };
            *weight += 1.0;
            *sum += coordinates(&middle, sample, bin as usize)?;
        }
        for (weight, sum) in &mut values {
            *sum /= f64::max(*weight, 1.0);
            *weight = f64::min(*weight, 1.0);
        }
        Ok(Self { step, middle, values })
    }

    pub(super) fn too_short(&self, cleaning: &Cleaning) -> PathError {
        let length_mm = self.values.len().saturating_sub(1) as f64 * self.step * 1e3;
        PathError::TooShort { length_mm, least_mm: cleaning.least_length * 1e3 }
    }

    /// Runs of steps never seen, when none is too long.
    pub(super) fn bridges(&self, cleaning: &Cleaning) -> Result<Vec<Bridge>, PathError> {
        let mut found: Vec<Bridge> = Vec::new();
        let mut run = 0;
        for (i, (weight, _)) in self.values.iter().enumerate() {
            run = if *weight > 0.0 { 0 } else { run + 1 };
            let bridge = Bridge { at: (i + 1 - run) as f64 * self.step, length: run as f64 * self.step };
            match run {
                0 => {}
                1 => found.push(bridge),
                _ => found.iter_mut().last().into_iter().for_each(|last| *last = bridge),
            }
        }
        // A hand at 250 mm/s leaves single steps empty; that is no gap.
        found.retain(|bridge| bridge.length > 0.002);
        match found.iter().find(|bridge| bridge.length > cleaning.bridge) {
            Some(Bridge { at, length }) => {
                let most_mm = cleaning.bridge * 1e3;
                Err(PathError::LongGap { at_mm: at * 1e3, gap_mm: length * 1e3, most_mm })
            }
            None => Ok(found),
        }
    }

    /// How far smoothing moved every step across the path, and turned it.
    pub(super) fn moved(
        &self,
        curve: &Spline<6>,
        cleaning: &Cleaning,
    ) -> Result<Vec<Option<(f64, f64)>>, PathError> {
        let mut all = Vec::with_capacity(self.values.len());
        for (i, (weight, value)) in self.values.iter().enumerate() {
            let u = self.step * i as f64;
            let [smooth, way, ..] = curve.at(u);
            let off = value - smooth;
            let (shift, way) = (upper(&off), upper(&way).try_normalize(1e-12).unwrap_or_default());
            let across = (shift - way * shift.dot(&way)).norm();
            if *weight > 0.0 && across > cleaning.most_moved {
                let most_mm = cleaning.most_moved * 1e3;
                return Err(PathError::TooUnsteady { at_mm: u * 1e3, moved_mm: across * 1e3, most_mm });
            }
            all.push((*weight > 0.0).then(|| (across, lower(&off).norm())));
        }
        Ok(all)
    }

    /// The point at parameter `u` of the smoothed curve.
    pub(super) fn point(&self, curve: &Spline<6>, moved: &[Option<(f64, f64)>], u: f64) -> PathPoint {
        let [value, ..] = curve.at(u);
        let rotation = self.middle * UnitQuaternion::from_scaled_axis(lower(&value));
        // FRAMES: smoothed coordinates of poses of Probe in Base.
        let base_from_probe =
            Pose::assume(Isometry3::from_parts(Translation3::from(upper(&value)), rotation));
        PathPoint { base_from_probe, moved: moved.get((u / self.step).round() as usize).copied().flatten() }
    }
}

/// Origin and rotation vector against the middle orientation.
fn coordinates(
    middle: &UnitQuaternion<f64>,
    sample: &Sample,
    index: usize,
) -> Result<SVector<f64, 6>, PathError> {
    let turn = (middle.inverse() * sample.base_from_probe.isometry().rotation).scaled_axis();
    let (angle, origin) = (turn.norm(), place(sample));
    if angle > TURN_WITHIN {
        let (angle_deg, most_deg) = (angle.to_degrees(), TURN_WITHIN.to_degrees());
        return Err(CurveError::TurnsTooFar { index, angle_deg, most_deg }.into());
    }
    Ok(SVector::from([origin.x, origin.y, origin.z, turn.x, turn.y, turn.z]))
}

fn upper(v: &SVector<f64, 6>) -> Vector3<f64> {
    Vector3::new(v[0], v[1], v[2])
}

fn lower(v: &SVector<f64, 6>) -> Vector3<f64> {
    Vector3::new(v[3], v[4], v[5])
}
