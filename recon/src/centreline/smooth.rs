//! A smooth curve through centres whose places along it are known.

use nalgebra::Vector3;

use crate::spline::{Banded, Knots};

/// Bends of arteries: their curvature (1/m), and the length over which it lasts (m).
const CURVATURE: f64 = 25.0;
const BEND_M: f64 = 0.015;
/// What a contour's centre is off by, neighbours together (m).
const CENTRE_SD_M: f64 = 0.25e-3;

/// Coefficients of the smooth curve: least squares that outliers do not pull (Huber), with a penalty on bends.
pub(super) fn smooth(knots: &Knots, places: &[f64], centres: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
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
