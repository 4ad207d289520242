//! How far each contour's size is to be believed.

use super::samples::Samples;
use super::tube::{BEND, BEND_M};
use crate::centreline::add;
use crate::spline::{Banded, Knots};

/// How often contours whose size is not their neighbours' lose weight.
const ROUNDS: usize = 6;

/// From a curve of the mean radii alone, which outliers do not pull (Huber).
pub(super) fn trust(knots: &Knots, contours: &[Samples]) -> Option<Vec<f64>> {
    let mut trust = vec![1.0; contours.len()];
    for _ in 0..ROUNDS {
        let radii = curve(knots, contours, &trust)?;
        for (trust, contour) in trust.iter_mut().zip(contours) {
            let (first, along) = knots.basis(contour.at);
            let expected: f64 = along.iter().zip(&radii[first..]).map(|(a, b)| a * b).sum();
            *trust = (2.0 * contour.own_sd / (contour.radius - expected).abs().max(1e-9)).min(1.0);
        }
    }
    Some(trust)
}

fn curve(knots: &Knots, contours: &[Samples], trust: &[f64]) -> Option<Vec<f64>> {
    let mut matrix = Banded::new(knots.coefficients(), 3);
    let mut right = vec![0.0; knots.coefficients()];
    for (contour, trust) in contours.iter().zip(trust) {
        let (first, along) = knots.basis(contour.at);
        let weight = trust * contour.points.iter().map(|point| point.weight).sum::<f64>();
        add(&mut matrix, first, &along, weight);
        let sums = right[first..].iter_mut().zip(&along);
        sums.for_each(|(sum, along)| *sum += weight * along * contour.radius);
    }
    for (at, weight) in knots.bend_integral() {
        let (first, bend) = knots.bend(at);
        add(&mut matrix, first, &bend, weight / (BEND * BEND * BEND_M));
    }
    (0..knots.coefficients()).for_each(|i| matrix.add(i, i, 1e4));
    Some(matrix.factor()?.solve(right))
}
