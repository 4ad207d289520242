//! The smoother: a discrete smoothing spline, solved exactly in one banded elimination.
//!
//! Source: Whittaker 1923; Eilers, *A perfect smoother*, Anal. Chem. 75 (2003), with third differences, so that a
//! parabola passes unchanged and a sine of wavelength `L` keeps `1 / (1 + (cutoff / L)^6)` of its height.

use nalgebra::SVector;

/// What each value is worth (0: unknown, to be filled in), and the value.
pub(super) type Weighted<const D: usize> = (f64, SVector<f64, D>);

/// The values `g` that minimise `sum w |y - g|^2 + lambda sum |third difference of g|^2`, where a sine of
/// `cutoff` samples to the wave keeps half its height. `None` when fewer than three values are known.
pub(super) fn smooth<const D: usize>(values: &[Weighted<D>], cutoff: f64) -> Option<Vec<SVector<f64, D>>> {
    if values.iter().filter(|(w, _)| *w > 0.0).count() < 3 || values.len() < 4 {
        return None;
    }
    let lambda = (2.0 * (std::f64::consts::PI / cutoff).sin()).powi(-6);
    let mut bands = penalty(values.len(), lambda);
    for (row, (w, _)) in bands.iter_mut().zip(values) {
        row[0] += w;
    }
    let mut solution = values.iter().map(|(w, y)| y * *w).collect::<Vec<_>>();
    solve(&mut bands, &mut solution);
    Some(solution)
}

/// `lambda D^T D` for third differences `D`, as diagonal and three superdiagonals of each row.
pub(super) fn penalty(n: usize, lambda: f64) -> Vec<[f64; 4]> {
    const DIFFERENCE: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
    let mut bands = vec![[0.0; 4]; n];
    for first in 0..n - 3 {
        for i in 0..4 {
            for j in i..4 {
                bands[first + i][j - i] += lambda * DIFFERENCE[i] * DIFFERENCE[j];
            }
        }
    }
    bands
}

/// Solves the symmetric positive definite banded system in place: `L D L^T` elimination.
pub(super) fn solve<const D: usize>(bands: &mut [[f64; 4]], right: &mut [SVector<f64, D>]) {
    let n = bands.len();
    for row in 0..n {
        let pivot = bands[row];
        let here = right[row];
        for below in 1..4.min(n - row) {
            let factor = pivot[below] / pivot[0];
            for k in below..4 {
                bands[row + below][k - below] -= factor * pivot[k];
            }
            right[row + below] -= here * factor;
        }
    }
    for row in (0..n).rev() {
        let mut sum = right[row];
        for ahead in 1..4.min(n - row) {
            sum -= right[row + ahead] * bands[row][ahead];
        }
        right[row] = sum / bands[row][0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, SVector};

    fn one(x: f64) -> SVector<f64, 1> {
        SVector::from([x])
    }

    #[test]
    fn it_is_the_dense_least_squares_solution() {
        let n = 40;
        let noisy: Vec<Weighted<1>> = (0..n)
            .map(|i| (if i % 7 == 3 { 0.0 } else { 1.0 }, one((i as f64 * 1.7).sin() + 0.1 * i as f64)))
            .collect();
        let found = smooth(&noisy, 12.0).unwrap();
        let lambda = (2.0 * (std::f64::consts::PI / 12.0).sin()).powi(-6);
        let d = DMatrix::from_fn(n - 3, n, |r, c| match c as i64 - r as i64 {
            0 => -1.0,
            1 => 3.0,
            2 => -3.0,
            3 => 1.0,
            _ => 0.0,
        });
        let w = DMatrix::from_diagonal(&DVector::from_iterator(n, noisy.iter().map(|v| v.0)));
        let y = DVector::from_iterator(n, noisy.iter().map(|v| v.1.x));
        let dense = (&w + d.transpose() * &d * lambda).lu().solve(&(&w * y)).unwrap();
        for i in 0..n {
            assert!((found[i].x - dense[i]).abs() < 1e-8, "{i}: {} {}", found[i].x, dense[i]);
        }
    }

    #[test]
    fn a_sine_at_the_cutoff_keeps_half_its_height_and_a_long_one_all() {
        let height = |wave: f64| {
            let values: Vec<Weighted<1>> =
                (0..4000).map(|i| (1.0, one((i as f64 / wave * std::f64::consts::TAU).sin()))).collect();
            let found = smooth(&values, 40.0).unwrap();
            found[1000..3000].iter().fold(0.0_f64, |most, g| most.max(g.x.abs()))
        };
        assert!((height(40.0) - 0.5).abs() < 0.01, "{}", height(40.0));
        assert!((height(160.0) - 1.0).abs() < 0.001, "{}", height(160.0));
        assert!(height(10.0) < 0.001, "{}", height(10.0));
    }
}
