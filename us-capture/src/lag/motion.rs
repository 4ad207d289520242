//! The probe's motion as a few numbers that change with time.

use nalgebra::{DMatrix, Vector6};
use probepath_frames::{Probe, Stamp, Track, World};

/// A turn by one radian counts as this far (m): a plane is about so far from a probe's marker.
const LEVER_M: f64 = 0.1;
/// Directions in which the probe moves less than this (m), or than this part of the main one, are noise.
const SMALLEST_M: f64 = 2e-5;
const SMALLEST_PART: f64 = 3e-3;

/// Coordinates of the probe along the directions in which it moved, each of unit size, at the poses' stamps.
pub(super) struct Motion {
    /// Seconds after the reference stamp.
    times: Vec<f64>,
    /// One row a pose.
    coordinates: DMatrix<f64>,
    widest_gap_s: f64,
    /// Median time between poses (s).
    pub interval_s: f64,
    /// Root mean square size of the motion (m).
    pub size_m: f64,
}

impl Motion {
    /// The poses of a track with stamps between `from` and `until` seconds after `zero`, at most `most` coordinates;
    /// `None` for fewer than five poses.
    pub fn of(
        track: &Track<World, Probe>,
        zero: Stamp,
        (from, until): (f64, f64),
        most: usize,
    ) -> Option<Self> {
        let of_time = |s: &&(Stamp, _)| (from..=until).contains(&(s.0 - zero).seconds());
        let samples: Vec<_> = track.samples().iter().filter(of_time).collect();
        let middle = samples.get(samples.len() / 2).filter(|_| samples.len() >= 5)?;
        let times: Vec<f64> = samples.iter().map(|(stamp, _)| (*stamp - zero).seconds()).collect();
        let raw: Vec<Vector6<f64>> = samples
            .iter()
            .map(|(_, pose)| {
                let moved = pose.isometry().translation.vector - middle.1.isometry().translation.vector;
                let turn = middle.1.isometry().rotation.inverse() * pose.isometry().rotation;
                let turn = turn.scaled_axis() * LEVER_M;
                Vector6::new(moved.x, moved.y, moved.z, turn.x, turn.y, turn.z)
            })
            .collect();
        let (coordinates, size_m) = principal(&raw, most);
        let mut gaps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        gaps.sort_by(f64::total_cmp);
        let interval_s = gaps.get(gaps.len() / 2).copied()?;
        Some(Self { times, coordinates, widest_gap_s: track.widest_gap().seconds(), interval_s, size_m })
    }

    /// How many coordinates there are.
    pub fn dimension(&self) -> usize {
        self.coordinates.ncols()
    }

    /// The coordinates `at` seconds, put into `into`; false outside the poses and in a gap of them.
    pub fn at(&self, at: f64, into: &mut [f64]) -> bool {
        let after = self.times.partition_point(|t| *t < at);
        let Some(t1) = self.times.get(after) else { return false };
        let before = if *t1 <= at { after } else { after.wrapping_sub(1) };
        let Some(t0) = self.times.get(before) else { return false };
        let gap = t1 - t0;
        if gap > self.widest_gap_s {
            return false;
        }
        let fraction = if gap > 0.0 { (at - t0) / gap } else { 0.0 };
        for (k, x) in into.iter_mut().enumerate() {
            let (a, b) = (self.coordinates[(before, k)], self.coordinates[(after, k)]);
            *x = a + (b - a) * fraction;
        }
        true
    }

    /// Variance of the noise in a linear function of the coordinates: every pose against the cubic through its four
    /// neighbours, which any smooth motion follows.
    pub fn noise_variance(&self, coefficients: &[f64]) -> f64 {
        let value = |i: usize| -> f64 {
            coefficients.iter().enumerate().map(|(k, c)| c * self.coordinates[(i, k)]).sum()
        };
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 2..self.times.len().saturating_sub(2) {
            let neighbours = [i - 2, i - 1, i + 1, i + 2];
            if self.times[i + 2] - self.times[i - 2] > 8.0 * self.interval_s {
                continue;
            }
            let weights = neighbours.map(|j| self.lagrange(j, neighbours, self.times[i]));
            let predicted: f64 = neighbours.iter().zip(weights).map(|(j, w)| w * value(*j)).sum();
            let spread = 1.0 + weights.iter().map(|w| w * w).sum::<f64>();
            sum += (value(i) - predicted).powi(2) / spread;
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { 0.0 }
    }

    fn lagrange(&self, j: usize, nodes: [usize; 4], at: f64) -> f64 {
        let others = nodes.iter().filter(|k| **k != j);
        others.map(|k| (at - self.times[*k]) / (self.times[j] - self.times[*k])).product()
    }
}

/// Coordinates along the principal directions, of unit size, and the size of the main one (m).
fn principal(raw: &[Vector6<f64>], most: usize) -> (DMatrix<f64>, f64) {
    let n = raw.len() as f64;
    let mean = raw.iter().sum::<Vector6<f64>>() / n;
    let covariance =
        raw.iter().map(|x| (x - mean) * (x - mean).transpose()).sum::<nalgebra::Matrix6<f64>>() / n;
    let eigen = covariance.symmetric_eigen();
    let mut order: Vec<usize> = (0..6).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let size = |k: usize| eigen.eigenvalues[k].max(0.0).sqrt();
    let largest = order.first().map_or(0.0, |k| size(*k));
    order.retain(|k| size(*k) > SMALLEST_M.max(SMALLEST_PART * largest));
    order.truncate(most.max(1));
    let coordinate =
        |row: usize, k: usize| (raw[row] - mean).dot(&eigen.eigenvectors.column(order[k])) / size(order[k]);
    (DMatrix::from_fn(raw.len(), order.len(), coordinate), largest)
}
