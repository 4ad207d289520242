//! The minimum of the residual over the lag, by Gauss and Newton.

use nalgebra::DVector;

use super::motion::Motion;
use super::regress::{Regression, Row, regress};

/// One more step changes less than this (s).
const CONVERGED_S: f64 = 1e-7;

/// The best lag, with what is needed to say how good it is.
pub(super) struct Fine {
    pub lag_s: f64,
    pub regression: Regression,
    /// Speed of the plane in the image as the poses have it (px/s), one a used image.
    pub speed: DVector<f64>,
    /// What of it no other place or direction of the plane explains (px/s).
    pub beyond: DVector<f64>,
}

/// `None` when it does not converge near the start.
///
/// The derivative is a difference over one interval of the poses to either side. Over a shorter one its noise would be
/// correlated with the residual's, which pulls the lag toward the middle between two poses.
pub(super) fn refine(motion: &Motion, rows: &[Row], start_s: f64, fewest: usize) -> Option<Fine> {
    let mut lag_s = start_s;
    for _ in 0..50 {
        let fine = at(motion, rows, lag_s, fewest)?;
        let (up, down) = weighted(rows, &fine);
        let step = up / down;
        if !step.is_finite() || (lag_s - start_s).abs() > 0.1 {
            return None;
        }
        if step.abs() < CONVERGED_S {
            return Some(fine);
        }
        lag_s += step.clamp(-0.02, 0.02);
    }
    None
}

fn at(motion: &Motion, rows: &[Row], lag_s: f64, fewest: usize) -> Option<Fine> {
    let regression = regress(motion, rows, lag_s, fewest)?;
    let p = motion.dimension();
    let (mut before, mut after) = (vec![0.0; p], vec![0.0; p]);
    let step = motion.interval_s;
    let speed = regression.used.iter().map(|i| {
        let time = rows[*i].time_s + lag_s;
        if !(motion.at(time - step, &mut before) && motion.at(time + step, &mut after)) {
            return 0.0;
        }
        let moved =
            before.iter().zip(&after).zip(regression.coefficients.iter()).map(|((b, a), c)| (a - b) * c);
        moved.sum::<f64>() / (2.0 * step)
    });
    let speed = DVector::from_iterator(regression.used.len(), speed);
    let beyond = regression.beyond(rows, &speed);
    Some(Fine { lag_s, regression, speed, beyond })
}

/// Sums over the images of weight times speed times residual, and of weight times speed squared.
pub(super) fn weighted(rows: &[Row], fine: &Fine) -> (f64, f64) {
    let images = fine.regression.used.iter().zip(fine.beyond.iter()).zip(fine.regression.residuals.iter());
    images.fold((0.0, 0.0), |(up, down), ((i, v), e)| {
        let w = rows[*i].weight;
        (up + w * v * e, down + w * v * v)
    })
}
