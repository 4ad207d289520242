//! Contour points as the tube sees them: length along the centreline, direction around it, distance from it.

use probepath_frames::{Point, World};

use super::AROUND;
use crate::Contour;
use crate::centreline::Centreline;

/// What a pose adds to a contour's uncertainty (m): the repeatability of an arm of the UR e-series. It moves a contour's
/// place and hardly its size.
const POSE_SD_M: f64 = 0.03e-3;
/// Images within half of this on either side see the same speckle (m): the beam's thickness.
const SAME_SPECKLE_M: f64 = 2.5e-3;
/// Points of a contour that a first, coarse look needs.
const COARSE: usize = 24;

/// The points of one contour.
#[derive(Clone, Debug)]
pub(crate) struct Samples {
    /// Where the contour lies along the centreline: the mean of its points (m).
    pub at: f64,
    /// Means over its points: distance from the centreline, and place across the vessel along `up` and `side` (m).
    pub means: [f64; 3],
    /// Standard deviation of its size (m).
    pub own_sd: f64,
    /// What speckle has of the variance of its points; the rest is the pose's, which leaves the size alone.
    pub speckle_part: f64,
    /// Standard deviation of what it shares with all others (m).
    pub common_sd: f64,
    /// Its place among the contours, in the order of their images.
    pub turn: usize,
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
    sampled(line, contours, |_| 1)
}

/// The same from fewer points of each contour, for a first look.
pub(crate) fn coarse_samples(line: &Centreline, contours: &[&Contour]) -> Vec<Samples> {
    sampled(line, contours, |points| (points / COARSE).max(1))
}

fn sampled(line: &Centreline, contours: &[&Contour], step: impl Fn(usize) -> usize) -> Vec<Samples> {
    let each = contours.iter().enumerate();
    let mut all: Vec<Samples> =
        each.filter_map(|(turn, contour)| of(line, contour, turn, step(contour.world.len()))).collect();
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
fn of(line: &Centreline, contour: &Contour, turn: usize, step: usize) -> Option<Samples> {
    let own_sd = (contour.sd_mm * 1e-3).hypot(POSE_SD_M);
    let mut near = line.nearest_m(&contour.centre.vector())?;
    let mut points = Vec::with_capacity(contour.world.len() / step + 1);
    let mut sums = [0.0; 5];
    for (k, place) in contour.world.iter().enumerate().step_by(step) {
        let sd = sd(contour, k);
        let (sample, across) = sample(line, place, near, sd)?;
        near = sample.at;
        let speckle_part = (1.0 - (POSE_SD_M / sd).powi(2)).max(0.0);
        let values = [sample.r, across.0, across.1, sample.at, speckle_part];
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        points.push(sample);
    }
    let count = points.len() as f64;
    // A contour has eleven free numbers, however many points draw it.
    points.iter_mut().for_each(|point| point.weight *= (AROUND as f64 / count).min(1.0));
    let [r, up, side, at, speckle_part] = sums.map(|sum| sum / count);
    let common_sd = contour.common_sd_mm * 1e-3;
    Some(Samples { at, means: [r, up, side], own_sd, speckle_part, common_sd, turn, points })
        .filter(|samples| samples.at.is_finite() && r.is_finite() && own_sd.is_finite())
}

/// Standard deviation of a contour's point, the pose's in it (m).
fn sd(contour: &Contour, k: usize) -> f64 {
    (contour.points_sd_mm.get(k).copied().unwrap_or(contour.sd_mm) * 1e-3).hypot(POSE_SD_M)
}

/// A point, and its place across the vessel.
fn sample(line: &Centreline, place: &Point<World>, near: f64, sd: f64) -> Option<(Sample, (f64, f64))> {
    let (at, up, side) = line.across(&place.vector(), near)?;
    let r = (up * up + side * side).sqrt();
    let turn = if r > 0.0 { (up / r, side / r) } else { (1.0, 0.0) };
    Some((Sample { at, turn, r, weight: 1.0 / (sd * sd) }, (up, side)))
}
