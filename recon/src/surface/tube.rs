//! The tube: the border's distance from the centreline as a function of length and angle.

use nalgebra::{SMatrix, SVector};
use probepath_frames::{Point, World};

use super::bends::Bends;
use super::equations;
use super::samples::Samples;
use super::trust;
use crate::ReconError;
use crate::centreline::CentrelinePoint;
use crate::spline::{Banded, Factor, InBand, Knots};

/// Harmonics around.
pub(crate) const HARMONICS: usize = 5;
/// Numbers of a section: the mean radius, then cosine and sine of each harmonic (m).
pub(crate) const AROUND: usize = 2 * HARMONICS + 1;
/// Distance of the farthest unknowns that meet in one point.
pub(crate) const SPAN: usize = 4 * AROUND - 1;
/// No lumen is drawn narrower (m).
const LEAST_RADIUS_M: f64 = 0.05e-3;

/// The distance of the border from the centreline, as a function of length and angle.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    knots: Knots,
    coefficients: Vec<f64>,
}

/// Covariance of a section's harmonics (m2).
pub(crate) type SectionCovariance = SMatrix<f64, AROUND, AROUND>;

/// A shape that knows how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tube {
    shape: Shape,
    covariance: InBand,
    /// What speckle has of it.
    speckle_part: f64,
    common_sd_m: f64,
}

impl Shape {
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

    /// Distance from the centreline at a length, in the direction of a cosine and sine (m).
    pub(crate) fn radius(&self, at: f64, turn: (f64, f64)) -> f64 {
        Way::of(turn).radius(&self.section(at))
    }

    /// Area of the section at a length (m2): the integral of half the distance's square.
    pub(crate) fn area(&self, at: f64) -> f64 {
        let section = self.section(at);
        let squares: f64 = section.iter().map(|value| value * value).sum();
        std::f64::consts::PI * (section[0] * section[0] + squares) / 2.0
    }

    /// The centre of gravity of the section at a length, along its `up` and `side` (m).
    pub(crate) fn centre_of_gravity(&self, at: f64, round: &[Way]) -> (f64, f64) {
        let section = self.section(at);
        let (mut area, mut up, mut side) = (0.0, 0.0, 0.0);
        for way in round {
            let (r, (cos, sin)) = (way.radius(&section), way.turn);
            area += r * r / 2.0;
            up += r * r * r * cos / 3.0;
            side += r * r * r * sin / 3.0;
        }
        if area > 0.0 { (up / area, side / area) } else { (0.0, 0.0) }
    }
}

/// A direction round the vessel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// Cosine and sine.
    pub turn: (f64, f64),
    harmonics: [f64; AROUND],
}

impl Way {
    /// From its cosine and sine.
    pub(crate) fn of(turn: (f64, f64)) -> Self {
        Self { turn, harmonics: harmonics_of(turn) }
    }

    /// The distance of a section's border (m).
    fn radius(&self, section: &[f64; AROUND]) -> f64 {
        let sum: f64 = section.iter().zip(&self.harmonics).map(|(a, b)| a * b).sum();
        sum.max(LEAST_RADIUS_M)
    }
}

/// So many directions round the vessel, evenly.
pub(crate) fn round(count: usize) -> Vec<Way> {
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / count as f64;
    (0..count).map(|k| Way::of((angle(k).cos(), angle(k).sin()))).collect()
}

impl Tube {
    /// Fitted to contours that are sorted by their places.
    pub(crate) fn fit(contours: &[Samples]) -> Result<Self, ReconError> {
        let (shape, factor) = solve(contours).ok_or(NO_FIT)?;
        let mean =
            |of: fn(&Samples) -> f64| contours.iter().map(of).sum::<f64>() / contours.len().max(1) as f64;
        let (common_sd_m, speckle_part) = (mean(|c| c.common_sd), mean(|c| c.speckle_part));
        Ok(Self { shape, covariance: factor.inverse_in_band(), speckle_part, common_sd_m })
    }

    /// The same without the covariance.
    pub(crate) fn shape_of(contours: &[Samples]) -> Result<Shape, ReconError> {
        Ok(solve(contours).ok_or(NO_FIT)?.0)
    }

    /// Its shape.
    pub(crate) const fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The harmonics of the section at a length (m): mean radius, then cosine and sine of once round, twice, ...
    pub(crate) fn section(&self, at: f64) -> [f64; AROUND] {
        self.shape.section(at)
    }

    /// Covariance of these harmonics (m2): what speckle and single poses leave open, nothing that all images share.
    pub(crate) fn covariance(&self, at: f64) -> SectionCovariance {
        let (first, along) = self.shape.knots.basis(at);
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

    /// Area of the section at a length and its standard deviation (m2): what speckle leaves open. A pose moves a contour's
    /// place and not its size.
    pub(crate) fn area(&self, at: f64) -> (f64, f64) {
        let mut slope = SVector::from(self.section(at)) * std::f64::consts::PI;
        slope[0] *= 2.0;
        let variance = self.speckle_part * slope.dot(&(self.covariance(at) * slope));
        (self.shape.area(at), variance.max(0.0).sqrt())
    }

    /// The points of the surface round a point of the centreline.
    pub(crate) fn ring(&self, centre: &CentrelinePoint, round: &[Way]) -> Vec<Point<World>> {
        let section = self.section(centre.at_m);
        let (middle, up, side) = (centre.point.vector(), centre.up.vector(), centre.side.vector());
        let point = |way: &Way| {
            let r = way.radius(&section);
            Point::from_vector(middle + up * (r * way.turn.0) + side * (r * way.turn.1))
        };
        round.iter().map(point).collect()
    }

    /// Standard deviation of the distance in a direction, from the section's covariance and what all images share (m).
    pub(crate) fn sd(&self, covariance: &SectionCovariance, way: &Way) -> f64 {
        let round = SVector::from(way.harmonics);
        round.dot(&(covariance * round)).max(0.0).sqrt().hypot(self.common_sd_m)
    }
}

const NO_FIT: ReconError = ReconError::NoFit { what: "lumen surface" };

fn solve(contours: &[Samples]) -> Option<(Shape, Factor)> {
    let places = contours.iter().flat_map(|contour| &contour.points).map(|point| point.at);
    let (start, end) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
    if end.is_nan() || end <= start {
        return None;
    }
    let mut bends = Bends::usual(start, end);
    let trust = trust::of(&mut bends, contours)?;
    let knots = bends.knots_for_all(start, end);
    let (mut matrix, right) = equations::normal(&knots, contours, &trust);
    stiffen(&mut matrix, &knots, &bends);
    let factor = matrix.factor()?;
    let coefficients = factor.solve(right);
    Some((Shape { knots, coefficients }, factor))
}

/// One, then cosine and sine of once, twice, ... an angle, from its cosine and sine.
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
fn stiffen(matrix: &mut Banded, knots: &Knots, bends: &Bends) {
    for (at, weight) in knots.bend_integral() {
        let (first, bend) = knots.bend(at);
        for harmonic in 0..AROUND {
            let stiffer = [1.0, 4.0, 4.0, 16.0, 16.0, 16.0][harmonic.div_ceil(2)];
            let weight = weight * stiffer * bends.weight(at);
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
