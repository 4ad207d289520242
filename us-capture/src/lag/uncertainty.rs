//! How sure a lag is when its residuals hang together in time.

use super::motion::Motion;
use super::refine::{Fine, weighted};
use super::regress::Row;

/// The standard error, and how much of the plane's speed is no noise.
pub(super) struct Uncertainty {
    pub standard_error_s: f64,
    pub told_apart: f64,
}

/// Heteroscedasticity and autocorrelation consistent (Newey, West 1987) on the lag's influence values, prewhitened by
/// a first order autoregression (Andrews, Monahan 1992).
///
/// Noise in the poses makes the speed look larger than it is, so the error is larger than the residuals say by the
/// part of the speed that is no noise (the reliability ratio of regressions with errors in their variables).
/// `None` when no motion is left to tell a lag by.
pub(super) fn standard_error(motion: &Motion, rows: &[Row], fine: &Fine) -> Option<Uncertainty> {
    let (_, power) = weighted(rows, fine);
    let n = fine.regression.used.len() as f64;
    let weights: f64 = fine.regression.used.iter().map(|i| rows[*i].weight).sum();
    let mean_power = power / weights;
    if !(mean_power.is_finite() && mean_power > 0.0) {
        return None;
    }
    let coefficients = fine.regression.coefficients.rows(0, motion.dimension());
    let noise = motion.noise_variance(coefficients.as_slice());
    // Interpolation halves to keeps a pose's noise, two thirds on the average, at both ends of the difference.
    let noise_power = noise * (4.0 / 3.0) / (2.0 * motion.interval_s).powi(2);
    let told_apart = 1.0 - noise_power / mean_power;
    let images = fine.regression.used.iter().zip(fine.beyond.iter()).zip(fine.regression.residuals.iter());
    let scores: Vec<f64> = images.map(|((i, v), e)| rows[*i].weight * v * e).collect();
    let free = n - fine.regression.coefficients.len() as f64 - 1.0;
    // Residuals are smaller than errors by their leverage; twice for its part in their products (HC3, on the average).
    let variance = n * long_run_variance(&scores) * (n / free.max(1.0)).powi(2) / power.powi(2);
    let standard_error_s = variance.max(0.0).sqrt() / told_apart.clamp(0.05, 1.0);
    Some(Uncertainty { standard_error_s, told_apart })
}

/// The variance of a sum of these values is their number times this.
pub(super) fn long_run_variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let product = |series: &[f64], k: usize| -> f64 {
        series.iter().zip(series.iter().skip(k)).map(|(a, b)| a * b).sum::<f64>() / n
    };
    let rho = product(values, 1) / product(values, 0);
    // The estimate is low by (1 + 3 rho) / n (Kendall 1954). Alternating residuals are not allowed to promise more than
    // independent ones.
    let rho = (rho + (1.0 + 3.0 * rho) / n).clamp(0.0, 0.97);
    let white: Vec<f64> = values.windows(2).map(|w| w[1] - rho * w[0]).collect();
    let reach = (4.0 * (n / 100.0).powf(2.0 / 9.0)).floor() as usize;
    let variance = product(&white, 0);
    let taper = |k: usize| 1.0 - k as f64 / (reach as f64 + 1.0);
    let sum = variance + (1..=reach).map(|k| 2.0 * taper(k) * product(&white, k)).sum::<f64>();
    sum.max(variance / 2.0) / (1.0 - rho).powi(2)
}

/// How much the stamps wander (s): the slope of the squared residuals over the squared speed.
pub(super) fn jitter_s(fine: &Fine) -> f64 {
    let squares: Vec<(f64, f64)> =
        fine.speed.iter().zip(fine.regression.residuals.iter()).map(|(v, e)| (v * v, e * e)).collect();
    let n = squares.len() as f64;
    let mean = squares.iter().fold((0.0, 0.0), |m, s| (m.0 + s.0 / n, m.1 + s.1 / n));
    let (up, down) = squares.iter().fold((0.0, 0.0), |(up, down), (v, e)| {
        (up + (v - mean.0) * (e - mean.1), down + (v - mean.0).powi(2))
    });
    if down > 0.0 { (up / down).max(0.0).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standard normal numbers, the same every day.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    #[test]
    fn the_long_run_variance_is_that_of_sums_of_the_series() {
        for rho in [0.0, 0.3, 0.6, 0.8] {
            let truth = 1.0 / (1.0_f64 - rho).powi(2);
            let estimates: Vec<f64> = (0..400)
                .map(|seed| {
                    let (mut next, mut last) = (noise(seed), 0.0);
                    let series: Vec<f64> = (0..250)
                        .map(|_| {
                            last = rho * last + next();
                            last
                        })
                        .collect();
                    long_run_variance(&series)
                })
                .collect();
            let mean = estimates.iter().sum::<f64>() / 400.0;
            assert!((mean / truth - 1.0).abs() < 0.2, "rho {rho}: {mean} for {truth}");
        }
    }
}
