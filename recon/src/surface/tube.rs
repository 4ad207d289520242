//! The tube: the border's distance from the centreline as a function of length and angle.

use nalgebra::SMatrix;
use probepath_frames::{Point, World};

use super::equations;
use super::samples::Samples;
use super::sizes;
use crate::ReconError;
use crate::centreline::CentrelinePoint;
use crate::spline::{Banded, InBand, Knots};

/// Harmonics around.
pub(crate) const HARMONICS: usize = 5;
/// Numbers of a section: the mean radius, then cosine and sine of each harmonic (m).
pub(crate) const AROUND: usize = 2 * HARMONICS + 1;
/// Distance of the farthest unknowns that meet in one point.
pub(crate) const SPAN: usize = 4 * AROUND - 1;
/// Distance of the knots along (m).
const KNOT_M: f64 = 2e-3;
/// How sharply radii bend along the vessel (1/m), and over which length (m).
pub(super) const BEND: f64 = 80.0;
pub(super) const BEND_M: f64 = 5e-3;
/// No lumen is drawn narrower (m).
const LEAST_RADIUS_M: f64 = 0.05e-3;

/// The distance of the border from the centreline, as a function of length and angle.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tube {
    knots: Knots,
    coefficients: Vec<f64>,
    covariance: InBand,
}

impl Tube {
    /// Fitted to contours that are sorted by their places.
    pub(crate) fn fit(contours: &[Samples]) -> Result<Self, ReconError> {
        let no_fit = || ReconError::NoFit { what: "lumen surface" };
        let places = || contours.iter().flat_map(|contour| &contour.points).map(|point| point.at);
        let (start, end) =
            places().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
        if end.is_nan() || end <= start {
            return Err(no_fit());
        }
        let knots = Knots::over(start, end, KNOT_M);
        let trust = sizes::trust(&knots, contours).ok_or_else(no_fit)?;
        Self::solve(&knots, contours, &trust).ok_or_else(no_fit)
    }

    fn solve(knots: &Knots, contours: &[Samples], trust: &[f64]) -> Option<Self> {
        let (mut matrix, right) = equations::normal(knots, contours, trust);
        stiffen(&mut matrix, knots);
        let factor = matrix.factor()?;
        let covariance = factor.inverse_in_band();
        Some(Self { knots: *knots, coefficients: factor.solve(right), covariance })
    }

    /// The harmonics of the section at a length (m): mean radius, then cosine and sine of once round, twice, ...
    pub(crate) fn section(&self, at: f64) -> [f64; AROUND] {
        let (first, along) = self.knots.basis(at);
        let four = self.coefficients[first * AROUND..].chunks_exact(AROUND);
        let mut section = [0.0; AROUND];
        for (weight, row) in along.iter().zip(four) {
            section.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
        }
        section
    }

    /// Covariance of these harmonics (m2): what speckle and single poses leave open, nothing that all images share.
    pub(crate) fn covariance(&self, at: f64) -> SMatrix<f64, AROUND, AROUND> {
        let (first, along) = self.knots.basis(at);
        let mut sum = SMatrix::zeros();
        for (a, left) in along.iter().enumerate() {
            for (b, right) in along.iter().enumerate() {
                let (row, column, weight) = ((first + a) * AROUND, (first + b) * AROUND, left * right);
                for i in 0..AROUND {
                    let part = self.covariance.part(row + i, column, AROUND);
                    part.iter().enumerate().for_each(|(j, value)| sum[(i, j)] += weight * value);
                }
            }
        }
        sum
    }

    /// Standard deviation of the mean radius at a length (m).
    pub(crate) fn radius_sd(&self, at: f64) -> f64 {
        self.covariance(at)[(0, 0)].max(0.0).sqrt()
    }

    /// Distance from the centreline at a length and an angle (m).
    pub(crate) fn radius(&self, at: f64, angle: f64) -> f64 {
        self.section(at).iter().zip(harmonics(angle)).map(|(a, b)| a * b).sum()
    }

    /// The points of the surface round a point of the centreline, at angles given by sine and cosine.
    pub(crate) fn ring(&self, centre: &CentrelinePoint, angles: &[(f64, f64)]) -> Vec<Point<World>> {
        let section = self.section(centre.at_m);
        let point = |&(sin, cos): &(f64, f64)| {
            let r: f64 = section.iter().zip(harmonics_of((cos, sin))).map(|(a, b)| a * b).sum();
            let r = r.max(LEAST_RADIUS_M);
            centre.point.moved(centre.up, r * cos).moved(centre.side, r * sin)
        };
        angles.iter().map(point).collect()
    }
}

/// One, then cosine and sine of once, twice, ... an angle.
pub(crate) fn harmonics(angle: f64) -> [f64; AROUND] {
    harmonics_of((angle.cos(), angle.sin()))
}

/// The same from the angle's cosine and sine.
pub(crate) fn harmonics_of((cos, sin): (f64, f64)) -> [f64; AROUND] {
    let mut all = [1.0; AROUND];
    let mut turn = (1.0, 0.0);
    for pair in all[1..].chunks_exact_mut(2) {
        turn = (turn.0 * cos - turn.1 * sin, turn.0 * sin + turn.1 * cos);
        (pair[0], pair[1]) = turn;
    }
    all
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
