//! The centreline: a C2 curve through the centres of the contours.

use nalgebra::{Matrix3, Vector3};
use probepath_frames::{Direction, Point, World};

use crate::ReconError;
use crate::spline::{Banded, Knots};

/// Distance of the knots (m).
const KNOT_M: f64 = 3e-3;
/// Bends of arteries: their curvature (1/m), and the length over which it lasts (m).
const CURVATURE: f64 = 25.0;
const BEND_M: f64 = 0.015;
/// What a contour's centre is off by, neighbours together (m).
const CENTRE_SD_M: f64 = 0.25e-3;
/// Distance of the samples kept (m): a chord of a bend of 30 mm radius leaves it by 0.3 um.
const SAMPLE_M: f64 = 0.25e-3;
/// The least length that makes a vessel (m).
const LEAST_M: f64 = 3e-3;

/// A smooth curve along the vessel, from the first contour to the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Centreline {
    /// Its points, at most 0.25 mm apart, from the first image's side to the last's.
    pub points: Vec<CentrelinePoint>,
}

/// A point of the centreline, with the axes of the section normal to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentrelinePoint {
    /// Length along the curve from its beginning (m).
    pub at_m: f64,
    /// Where it is.
    pub point: Point<World>,
    /// Along the vessel.
    pub tangent: Direction<World>,
    /// Normal to it: angle zero round the vessel, the World's -y (anterior) carried along without twist.
    pub up: Direction<World>,
    /// `tangent x up`: a quarter turn round the vessel.
    pub side: Direction<World>,
}

impl Centreline {
    /// A smooth curve through `centres`, which may be in any order along the vessel and off by `outlier_m` here and
    /// there; it runs from the first centre's end to the last's.
    ///
    /// # Errors
    /// When the centres span too little.
    pub(crate) fn through(centres: &[Vector3<f64>]) -> Result<Self, ReconError> {
        let along = main_direction(centres);
        let places: Vec<f64> = centres.iter().map(|centre| along.dot(centre)).collect();
        let start = places.iter().copied().fold(f64::INFINITY, f64::min);
        let end = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if end.is_nan() || end - start < LEAST_M {
            let span_mm = if end > start { (end - start) * 1e3 } else { 0.0 };
            return Err(ReconError::NoLength { span_mm, needed_mm: LEAST_M * 1e3 });
        }
        let knots = Knots::over(start, end, KNOT_M);
        let coefficients =
            smooth(&knots, &places, centres).ok_or(ReconError::NoFit { what: "centreline" })?;
        let curve = |(first, weights): (usize, [f64; 4])| -> Vector3<f64> {
            weights.iter().zip(&coefficients[first..]).map(|(w, c)| c * *w).sum()
        };
        Self::sampled(start, end, |u| (curve(knots.basis(u)), curve(knots.slope(u))))
            .ok_or(ReconError::NoFit { what: "centreline" })
    }

    /// Samples of a curve and its derivative.
    fn sampled(start: f64, end: f64, curve: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>)) -> Option<Self> {
        let count = ((end - start) / SAMPLE_M).ceil() as usize + 1;
        let mut points: Vec<CentrelinePoint> = Vec::with_capacity(count);
        for i in 0..count {
            let u = start + (end - start) * i as f64 / (count - 1) as f64;
            let (place, slope) = curve(u);
            let tangent = Direction::of(slope).ok()?;
            let (before, at_m) = match points.last() {
                Some(last) => (last.up.vector(), last.at_m + (place - last.point.vector()).norm()),
                None => (-Vector3::y(), 0.0),
            };
            let up = normal_part(before, tangent.vector())?;
            let side = Direction::of(tangent.vector().cross(&up.vector())).ok()?;
            points.push(CentrelinePoint { at_m, point: Point::from_vector(place), tangent, up, side });
        }
        Some(Self { points })
    }

    /// Its length (m).
    pub fn length_m(&self) -> f64 {
        self.points.last().map_or(0.0, |last| last.at_m)
    }

    /// The point at a length from the beginning; beyond an end, straight on.
    pub fn at(&self, at_m: f64) -> Option<CentrelinePoint> {
        let after =
            self.points.partition_point(|point| point.at_m < at_m).clamp(1, self.points.len().max(2) - 1);
        let (a, b) = (self.points.get(after - 1)?, self.points.get(after)?);
        let t = (at_m - a.at_m) / (b.at_m - a.at_m).max(1e-12);
        let place = a.point.vector() + (b.point.vector() - a.point.vector()) * t;
        let blend = t.clamp(0.0, 1.0);
        let tangent = Direction::of(a.tangent.vector().lerp(&b.tangent.vector(), blend)).ok()?;
        let up = normal_part(a.up.vector().lerp(&b.up.vector(), blend), tangent.vector())?;
        let side = Direction::of(tangent.vector().cross(&up.vector())).ok()?;
        Some(CentrelinePoint { at_m, point: Point::from_vector(place), tangent, up, side })
    }

    /// The point whose section normal to the curve a place lies in, looked for from `near_m` on.
    pub(crate) fn section_of(&self, place: &Vector3<f64>, near_m: f64) -> Option<CentrelinePoint> {
        let mut found = self.at(near_m)?;
        for _ in 0..20 {
            let along = (place - found.point.vector()).dot(&found.tangent.vector());
            if along.abs() < 1e-7 {
                break;
            }
            // Half steps past a bend's centre would swing; arteries bend more gently than their radius.
            found = self.at(found.at_m + along.clamp(-5e-3, 5e-3))?;
        }
        Some(found)
    }

    /// Where along the curve the sample nearest to a place lies (m).
    pub(crate) fn nearest_m(&self, place: &Vector3<f64>) -> Option<f64> {
        Some(self.nearest(place)?.at_m)
    }

    /// The nearest sample to a place.
    pub(crate) fn nearest(&self, place: &Vector3<f64>) -> Option<&CentrelinePoint> {
        let distance = |point: &CentrelinePoint| (point.point.vector() - place).norm_squared();
        self.points.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// The part of a vector normal to a tangent; any normal when there is none.
fn normal_part(vector: Vector3<f64>, tangent: Vector3<f64>) -> Option<Direction<World>> {
    let part = vector - tangent * tangent.dot(&vector);
    if part.norm() > 0.2 {
        return Direction::of(part).ok();
    }
    Direction::of(Vector3::x() - tangent * tangent.x).or_else(|_| Direction::of(Vector3::z())).ok()
}

/// The direction in which the centres extend most, from the first to the last.
fn main_direction(centres: &[Vector3<f64>]) -> Vector3<f64> {
    let mean = centres.iter().sum::<Vector3<f64>>() / centres.len().max(1) as f64;
    let scatter: Matrix3<f64> = centres.iter().map(|c| (c - mean) * (c - mean).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let along: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    // The order of the sweep says which end is the beginning: how place and number go together.
    let middle = (centres.len() as f64 - 1.0) / 2.0;
    let rising: f64 =
        centres.iter().enumerate().map(|(i, c)| (i as f64 - middle) * along.dot(&(c - mean))).sum();
    if rising < 0.0 { -along } else { along }
}

/// Coefficients of the smooth curve: least squares that outliers do not pull (Huber), with a penalty on bends.
fn smooth(knots: &Knots, places: &[f64], centres: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
    let mut weights = vec![1.0; centres.len()];
    let mut coefficients: Vec<Vector3<f64>> = Vec::new();
    for _ in 0..6 {
        let size = knots.coefficients();
        let mut matrix = Banded::new(size, 3);
        let mut right = vec![Vector3::zeros(); size];
        for ((place, centre), weight) in places.iter().zip(centres).zip(&weights) {
            let (first, basis) = knots.basis(*place);
            let weight = weight / (CENTRE_SD_M * CENTRE_SD_M);
            add(&mut matrix, first, &basis, weight);
            basis.iter().zip(&mut right[first..]).for_each(|(b, sum)| *sum += centre * (b * weight));
        }
        for (at, weight) in knots.bend_integral() {
            let (first, bend) = knots.bend(at);
            add(&mut matrix, first, &bend, weight / (CURVATURE * CURVATURE * BEND_M));
        }
        (0..size).for_each(|i| matrix.add(i, i, 1e-3));
        let factor = matrix.factor()?;
        let axis = |k: usize| factor.solve(right.iter().map(|v| v[k]).collect());
        let (x, y, z) = (axis(0), axis(1), axis(2));
        coefficients = (0..size).map(|i| Vector3::new(x[i], y[i], z[i])).collect();
        for ((place, centre), weight) in places.iter().zip(centres).zip(&mut weights) {
            let (first, basis) = knots.basis(*place);
            let fitted: Vector3<f64> = basis.iter().zip(&coefficients[first..]).map(|(b, c)| c * *b).sum();
            *weight = (2.0 * CENTRE_SD_M / (fitted - centre).norm().max(1e-9)).min(1.0);
        }
    }
    Some(coefficients)
}

/// Adds the outer product of a row of four.
pub(crate) fn add(matrix: &mut Banded, first: usize, row: &[f64; 4], weight: f64) {
    for (a, left) in row.iter().enumerate() {
        for (b, right) in row.iter().enumerate().take(a + 1) {
            matrix.add(first + a, first + b, weight * left * right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Dice;

    /// A helix of 40 mm radius that rises 100 mm in a quarter turn.
    fn helix(t: f64) -> Vector3<f64> {
        let angle = t * std::f64::consts::FRAC_PI_2;
        Vector3::new(0.04 * angle.cos(), 0.04 * angle.sin(), 0.1 * t)
    }

    #[test]
    fn a_curve_through_noisy_centres_is_near_the_true_one_and_as_long() {
        let mut dice = Dice(11);
        for case in 0..20 {
            let mut centres: Vec<Vector3<f64>> = (0..=200)
                .map(|i| {
                    let ((a, b), (c, _)) = (dice.normal_pair(), dice.normal_pair());
                    helix(f64::from(i) / 200.0) + Vector3::new(a, b, c) * 0.1e-3
                })
                .collect();
            centres[77] += Vector3::new(0.0, 0.02, 0.0);
            let line = Centreline::through(&centres).expect("long enough");
            let exact = (0.04_f64 * std::f64::consts::FRAC_PI_2).hypot(0.1);
            assert!((line.length_m() - exact).abs() < 0.5e-3, "{case}: {} {exact}", line.length_m());
            for i in 0..=100 {
                let true_place = helix(f64::from(i) / 100.0);
                let near = line.nearest(&true_place).expect("not empty");
                assert!((near.point.vector() - true_place).norm() < 0.25e-3, "{case} {i}");
            }
        }
    }

    #[test]
    fn a_place_is_in_the_section_normal_to_the_curve() {
        let centres: Vec<Vector3<f64>> = (0..=200).map(|i| helix(f64::from(i) / 200.0)).collect();
        let line = Centreline::through(&centres).expect("long enough");
        let middle = line.at(0.05).expect("inside");
        let place = middle.point.vector() + middle.up.vector() * 0.004 + middle.side.vector() * 0.003;
        let found = line.section_of(&place, 0.047).expect("found");
        assert!((found.at_m - 0.05).abs() < 2e-6, "{}", found.at_m);
        assert!(middle.up.vector().dot(&middle.tangent.vector()).abs() < 1e-12);
    }

    #[test]
    fn centres_in_one_place_have_no_line() {
        let same = vec![Vector3::new(1.0, 2.0, 3.0); 9];
        assert!(matches!(Centreline::through(&same), Err(ReconError::NoLength { .. })));
        assert!(Centreline::through(&[]).is_err());
    }
}
