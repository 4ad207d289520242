//! How well calibrations repeat: C_rms.

use probepath_frames::{Frame, Point};

/// How far the points of one target scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeatability {
    /// `sqrt( (1/MN) sum (dx² + dy²) )` about each target's mean location (m).
    pub rms_m: f64,
    /// The mean distance (m).
    pub mean_m: f64,
    /// Standard deviation of the distances (m).
    pub sd_m: f64,
    /// Points.
    pub count: usize,
}

/// The paper's calibration precision, of `targets` of which each was reconstructed several times.
///
/// `C_rms = sqrt( (1/MN) sum (dx² + dy²) )` about the mean location of each target. The paper's eq. (5) as printed
/// cannot be the number in its Table I (FIELD.md, section 2); this is the true root mean square, with the plain mean
/// distance beside it. In a plane (points whose third coordinate is the same) these are the paper's dx and dy; points
/// in space have all three differences counted. Targets with fewer than two points say nothing and are left out;
/// `None` when none is left.
pub fn c_rms<F: Frame>(targets: &[Vec<Point<F>>]) -> Option<Repeatability> {
    let mut distances = Vec::new();
    for points in targets.iter().filter(|points| points.len() > 1) {
        let sum = points.iter().fold(nalgebra::Vector3::zeros(), |sum, point| sum + point.vector());
        let mean = Point::<F>::from_vector(sum / points.len() as f64);
        distances.extend(points.iter().map(|point| point.distance(&mean)));
    }
    let count = distances.len() as f64;
    if distances.is_empty() {
        return None;
    }
    let mean_m = distances.iter().sum::<f64>() / count;
    let square = distances.iter().map(|d| d * d).sum::<f64>() / count;
    let sd_m = (square - mean_m * mean_m).max(0.0).sqrt();
    Some(Repeatability { rms_m: square.sqrt(), mean_m, sd_m, count: distances.len() })
}
