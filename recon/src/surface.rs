//! The lumen's surface: the distance of the border from the centreline, smooth along the vessel and around it.
//!
//! Every contour point is taken to the section normal to the centreline that it lies in, so oblique images give
//! normal sections too ([P1] II.C.2).

use nalgebra::Vector3;
use probepath_frames::{Point, World};

use crate::centreline::{Centreline, CentrelinePoint};
use crate::spline::{Banded, Factor, Knots};
use crate::{Contour, ReconError};

/// Harmonics around.
const HARMONICS: usize = 5;
const AROUND: usize = 2 * HARMONICS + 1;
/// Distance of the knots along (m).
const KNOT_M: f64 = 2e-3;
/// How sharply radii bend along the vessel (1/m), and over which length (m).
const BEND: f64 = 80.0;
const BEND_M: f64 = 5e-3;
/// What a pose adds to a contour's uncertainty (m).
const POSE_SD_M: f64 = 0.1e-3;
/// Neighbouring images within the beam's thickness see the same speckle (m).
const SAME_SPECKLE_M: f64 = 2.5e-3;

/// The lumen's surface as a grid of points: `along` rows of `around` points each.
#[derive(Clone, Debug, PartialEq)]
pub struct LumenSurface {
    /// Rows along the vessel.
    pub along: usize,
    /// Points around it.
    pub around: usize,
    /// The points, row after row.
    pub points: Vec<Point<World>>,
    /// Where each row lies along the centreline (m).
    pub at_m: Vec<f64>,
    /// Where each row's centre is.
    pub centres: Vec<Point<World>>,
    /// Whether images show the lumen there; where not, the surface only bridges a gap.
    pub measured: Vec<bool>,
}

/// The distance of the border from the centreline, as a function of length and angle.
pub(crate) struct Tube {
    knots: Knots,
    coefficients: Vec<f64>,
    factor: Factor,
}

impl Tube {
    /// Fitted to the contours. `spacing` is the mean distance of the images (m).
    pub(crate) fn fit(line: &Centreline, contours: &[&Contour], spacing: f64) -> Result<Self, ReconError> {
        let no_fit = ReconError::NoFit { what: "lumen surface" };
        let knots = Knots::over(0.0, line.length_m(), KNOT_M);
        let samples: Vec<Vec<Sample>> =
            contours.iter().map(|contour| samples(line, contour, spacing)).collect();
        let mut weights: Vec<f64> = vec![1.0; contours.len()];
        let mut tube = Self::solve(&knots, &samples, &weights).ok_or(no_fit.clone())?;
        for _ in 0..4 {
            for (weight, contour) in weights.iter_mut().zip(&samples) {
                *weight = tube.trust(contour);
            }
            tube = Self::solve(&knots, &samples, &weights).ok_or(no_fit.clone())?;
        }
        Ok(tube)
    }

    /// How much a contour counts: less when its size is not its neighbours'.
    fn trust(&self, contour: &[Sample]) -> f64 {
        let n = contour.len().max(1) as f64;
        let off: f64 =
            contour.iter().map(|sample| sample.r - self.radius(sample.at, sample.angle)).sum::<f64>() / n;
        let limit = 2.0 * contour.first().map_or(1.0, |sample| sample.own_sd);
        (limit / off.abs().max(1e-9)).min(1.0)
    }

    fn solve(knots: &Knots, samples: &[Vec<Sample>], weights: &[f64]) -> Option<Self> {
        let size = knots.coefficients() * AROUND;
        let mut matrix = Banded::new(size, 4 * AROUND - 1);
        let mut right = vec![0.0; size];
        for (sample, trust) in samples.iter().zip(weights).flat_map(|(s, w)| s.iter().map(move |s| (s, w))) {
            let (first, along) = knots.basis(sample.at);
            let around = harmonics(sample.angle);
            let weight = trust / (sample.sd * sample.sd);
            let row: [f64; 4 * AROUND] = std::array::from_fn(|k| along[k / AROUND] * around[k % AROUND]);
            for (a, left) in row.iter().enumerate() {
                right[first * AROUND + a] += weight * left * sample.r;
                for (b, value) in row.iter().enumerate().take(a + 1) {
                    matrix.add(first * AROUND + a, first * AROUND + b, weight * left * value);
                }
            }
        }
        stiffen(&mut matrix, knots);
        let factor = matrix.factor()?;
        let coefficients = factor.solve(right);
        Some(Self { knots: *knots, coefficients, factor })
    }

    /// The harmonics of the section at a length (m).
    pub(crate) fn section(&self, at: f64) -> [f64; AROUND] {
        let (first, along) = self.knots.basis(at);
        std::array::from_fn(|k| (0..4).map(|i| along[i] * self.coefficients[(first + i) * AROUND + k]).sum())
    }

    /// Distance from the centreline at a length and an angle (m).
    pub(crate) fn radius(&self, at: f64, angle: f64) -> f64 {
        self.section(at).iter().zip(harmonics(angle)).map(|(a, b)| a * b).sum()
    }

    /// Standard deviation of the mean radius at a length (m).
    pub(crate) fn radius_sd(&self, at: f64) -> f64 {
        let (first, along) = self.knots.basis(at);
        let mut right = vec![0.0; self.coefficients.len()];
        (0..4).for_each(|i| right[(first + i) * AROUND] = along[i]);
        let solved = self.factor.solve(right);
        (0..4).map(|i| along[i] * solved[(first + i) * AROUND]).sum::<f64>().max(0.0).sqrt()
    }

    /// The point of the surface at an angle round a point of the centreline.
    pub(crate) fn point(&self, centre: &CentrelinePoint, angle: f64) -> Point<World> {
        let r = self.radius(centre.at_m, angle).max(0.05e-3);
        centre.point.moved(centre.up, r * angle.cos()).moved(centre.side, r * angle.sin())
    }
}

/// A contour's point, as length, angle and distance from the centreline.
struct Sample {
    at: f64,
    angle: f64,
    r: f64,
    /// Standard deviation that, over all points of all images, says how much is known (m).
    sd: f64,
    /// Standard deviation of this contour's size (m).
    own_sd: f64,
}

fn samples(line: &Centreline, contour: &Contour, spacing: f64) -> Vec<Sample> {
    let near = line.nearest(&contour.centre.vector()).map_or(0.0, |point| point.at_m);
    let own = (contour.sd_mm * 1e-3).hypot(POSE_SD_M);
    // A contour has eleven free numbers, however many points draw it; and neighbours share speckle.
    let shared = (SAME_SPECKLE_M / spacing.max(1e-5)).max(1.0);
    let sd = own * (contour.world.len() as f64 / AROUND as f64 * shared).sqrt();
    let sample = |place: &Point<World>| {
        let place: Vector3<f64> = place.vector();
        let section = line.section_of(&place, near)?;
        let off = place - section.point.vector();
        let (x, y) = (off.dot(&section.up.vector()), off.dot(&section.side.vector()));
        Some(Sample { at: section.at_m, angle: y.atan2(x), r: x.hypot(y), sd, own_sd: own })
    };
    contour.world.iter().filter_map(sample).collect()
}

fn harmonics(angle: f64) -> [f64; AROUND] {
    std::array::from_fn(|k| match k {
        0 => 1.0,
        k if k % 2 == 1 => (k.div_ceil(2) as f64 * angle).cos(),
        k => ((k / 2) as f64 * angle).sin(),
    })
}

/// Adds the penalty on bends along the vessel: the shape around changes more slowly than the size.
fn stiffen(matrix: &mut Banded, knots: &Knots) {
    for (at, weight) in knots.bend_integral() {
        let (first, bend) = knots.bend(at);
        for harmonic in 0..AROUND {
            let sd = BEND / [1.0, 2.0, 2.0, 4.0, 4.0, 4.0][harmonic.div_ceil(2)];
            let weight = weight / (sd * sd * BEND_M);
            for (a, left) in bend.iter().enumerate() {
                for (b, right) in bend.iter().enumerate().take(a + 1) {
                    let (i, j) = ((first + a) * AROUND + harmonic, (first + b) * AROUND + harmonic);
                    matrix.add(i, j, weight * left * right);
                }
            }
        }
    }
    // Keeps harmonics that no image speaks of at zero: 10 mm, which is to say hardly at all.
    (0..knots.coefficients() * AROUND).for_each(|i| matrix.add(i, i, 1e4));
}

/// The surface's grid.
pub(crate) fn grid(
    line: &Centreline,
    tube: &Tube,
    (along, around): (usize, usize),
    measured: impl Fn(f64) -> bool,
) -> LumenSurface {
    let places = (0..along).map(|row| line.length_m() * row as f64 / (along - 1).max(1) as f64);
    let centres: Vec<CentrelinePoint> = places.filter_map(|at| line.at(at)).collect();
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / around as f64;
    let points =
        centres.iter().flat_map(|centre| (0..around).map(|k| tube.point(centre, angle(k)))).collect();
    LumenSurface {
        along: centres.len(),
        around,
        points,
        at_m: centres.iter().map(|centre| centre.at_m).collect(),
        centres: centres.iter().map(|centre| centre.point).collect(),
        measured: centres.iter().map(|centre| measured(centre.at_m)).collect(),
    }
}
