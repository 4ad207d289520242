//! For one lag: the coefficients that explain the plane's position best, and what they leave.

use nalgebra::{DMatrix, DVector};

use super::motion::Motion;

/// One image: seconds after the reference stamp, the plane's position (px), its weight (1/px²).
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub time_s: f64,
    pub position: f64,
    pub weight: f64,
}

/// The plane's position regressed on the pose at t + lag.
pub(super) struct Regression {
    /// Indices of the rows that have a pose then.
    pub used: Vec<usize>,
    /// One row an image: the coordinates, and one.
    pub design: DMatrix<f64>,
    /// A coefficient a coordinate, and the constant.
    pub coefficients: DVector<f64>,
    /// What is left (px).
    pub residuals: DVector<f64>,
    /// Part of the weighted variance that is explained (R²).
    pub explained: f64,
    normal: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

/// `None` when fewer than `fewest` images have a pose, or nothing varies among them.
pub(super) fn regress(motion: &Motion, rows: &[Row], lag_s: f64, fewest: usize) -> Option<Regression> {
    let p = motion.dimension();
    let mut used = Vec::with_capacity(rows.len());
    let mut design = DMatrix::from_element(rows.len(), p + 1, 1.0);
    let mut point = vec![0.0; p];
    for (i, row) in rows.iter().enumerate() {
        if motion.at(row.time_s + lag_s, &mut point) {
            for (k, x) in point.iter().enumerate() {
                design[(used.len(), k)] = *x;
            }
            used.push(i);
        }
    }
    if used.len() < fewest.max(p + 3) {
        return None;
    }
    let design = design.resize_vertically(used.len(), 1.0);
    let weights = DVector::from_iterator(used.len(), used.iter().map(|i| rows[*i].weight));
    solve(rows, used, design, &weights)
}

fn solve(rows: &[Row], used: Vec<usize>, design: DMatrix<f64>, weights: &DVector<f64>) -> Option<Regression> {
    let y = DVector::from_iterator(used.len(), used.iter().map(|i| rows[*i].position));
    let mut weighted = design.clone();
    for (mut row, w) in weighted.row_iter_mut().zip(weights.iter()) {
        row *= *w;
    }
    let mut normal = weighted.tr_mul(&design);
    // Coordinates have unit size over all poses, so this only keeps apart what did not vary in these images.
    let ridge = 1e-9 * weights.sum();
    for k in 0..normal.nrows() {
        normal[(k, k)] += ridge;
    }
    let normal = normal.cholesky()?;
    let coefficients = normal.solve(&weighted.tr_mul(&y));
    let residuals = &y - &design * &coefficients;
    let mean = weights.dot(&y) / weights.sum();
    let total: f64 = y.iter().zip(weights.iter()).map(|(y, w)| w * (y - mean).powi(2)).sum();
    let left: f64 = residuals.iter().zip(weights.iter()).map(|(e, w)| w * e * e).sum();
    let explained = 1.0 - left / total;
    explained.is_finite().then_some(Regression { used, design, coefficients, residuals, explained, normal })
}

impl Regression {
    /// The same images with the least sum of absolute residuals instead of squares (iteratively reweighted): a tenth
    /// of the images may show another line.
    pub fn least_absolute(mut self, rows: &[Row]) -> Option<Self> {
        for _ in 0..8 {
            let floor = 0.1 * self.residuals.lp_norm(1) / self.used.len() as f64 + 1e-9;
            let weights = self.residuals.map(|e| 1.0 / e.abs().max(floor));
            self = solve(rows, self.used, self.design, &weights)?;
        }
        Some(self)
    }

    /// The upper quartile of the absolute residuals (px): what is left, whatever the worst quarter of the images shows.
    pub fn upper_quartile_px(&self) -> f64 {
        let mut sizes: Vec<f64> = self.residuals.iter().map(|e| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() * 3 / 4).copied().unwrap_or_default()
    }

    /// What of `signal` (one value a used image) no place and direction of the plane explains.
    pub fn beyond(&self, rows: &[Row], signal: &DVector<f64>) -> DVector<f64> {
        let weighted = DVector::from_iterator(
            self.used.len(),
            self.used.iter().zip(signal.iter()).map(|(i, v)| rows[*i].weight * v),
        );
        signal - &self.design * self.normal.solve(&self.design.tr_mul(&weighted))
    }

    /// Root mean square of the residuals (px), one degree of freedom taken off for every coefficient and the lag.
    pub fn rms_px(&self) -> f64 {
        let free = (self.used.len() as f64 - self.coefficients.len() as f64 - 1.0).max(1.0);
        (self.residuals.norm_squared() / free).sqrt()
    }

    /// Correlation of the position with what is explained of it.
    pub fn correlation(&self) -> f64 {
        self.explained.max(0.0).sqrt()
    }
}
