//! Contour points as the tube sees them: length along the centreline, direction around it, distance from it.

use nalgebra::Vector3;

use crate::Contour;
use crate::centreline::Centreline;

use super::AROUND;

/// What a pose adds to a contour's uncertainty (m).
const POSE_SD_M: f64 = 0.1e-3;
/// Images within half of this on either side see the same speckle (m): the beam's thickness.
const SAME_SPECKLE_M: f64 = 2.5e-3;

/// The points of one contour.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// Where the contour lies along the centreline: the mean of its points (m).
    pub at: f64,
    /// Mean distance of its points from the centreline (m).
    pub radius: f64,
    /// Standard deviation of its size (m).
    pub own_sd: f64,
    /// Its points.
    pub points: Vec<Sample>,
}

/// A contour's point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Length along the centreline (m).
    pub at: f64,
    /// Cosine and sine of the angle round it, from the section's `up` to its `side`.
    pub turn: (f64, f64),
    /// Distance from it (m).
    pub r: f64,
    /// What it counts: one over its variance, such that all points of all images together count as much as is known
    /// (1/m2).
    pub weight: f64,
}

/// The contours as seen from the centreline, in the order of their places along it.
pub(crate) fn samples(line: &Centreline, contours: &[&Contour]) -> Vec<Samples> {
    let mut all: Vec<Samples> = contours.iter().filter_map(|contour| of(line, contour)).collect();
    all.sort_by(|a, b| a.at.total_cmp(&b.at));
    let places: Vec<f64> = all.iter().map(|samples| samples.at).collect();
    for samples in &mut all {
        let (from, to) = (samples.at - SAME_SPECKLE_M / 2.0, samples.at + SAME_SPECKLE_M / 2.0);
        let near = places.partition_point(|&at| at <= to) - places.partition_point(|&at| at < from);
        samples.points.iter_mut().for_each(|point| point.weight /= near.max(1) as f64);
    }
    all
}

/// One contour's points, each counting as if no other image had seen the same speckle.
fn of(line: &Centreline, contour: &Contour) -> Option<Samples> {
    let own_sd = (contour.sd_mm * 1e-3).hypot(POSE_SD_M);
    let count = contour.world.len();
    // A contour has eleven free numbers, however many points draw it.
    let weight = AROUND as f64 / (count as f64 * own_sd * own_sd);
    let mut near = line.nearest_m(&contour.centre.vector())?;
    let mut points = Vec::with_capacity(count);
    for place in &contour.world {
        let place: Vector3<f64> = place.vector();
        let section = line.section_of(&place, near)?;
        near = section.at_m;
        let off = place - section.point.vector();
        let (x, y) = (off.dot(&section.up.vector()), off.dot(&section.side.vector()));
        let r = x.hypot(y);
        let turn = if r > 0.0 { (x / r, y / r) } else { (1.0, 0.0) };
        points.push(Sample { at: section.at_m, turn, r, weight });
    }
    let mean = |value: fn(&Sample) -> f64| points.iter().map(value).sum::<f64>() / count as f64;
    Some(Samples { at: mean(|p| p.at), radius: mean(|p| p.r), own_sd, points })
        .filter(|samples| samples.at.is_finite() && samples.radius.is_finite())
}
