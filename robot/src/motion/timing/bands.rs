//! A symmetric positive definite matrix with two diagonals beside the main one, solved by elimination.

/// The diagonal and the two above it, row by row.
#[derive(Clone, Debug, Default)]
pub(super) struct Bands {
    rows: Vec<[f64; 3]>,
}

impl Bands {
    pub(super) fn zeros(n: usize) -> Self {
        Self { rows: vec![[0.0; 3]; n] }
    }

    pub(super) fn clear(&mut self) {
        self.rows.fill([0.0; 3]);
    }

    /// Adds a symmetric block of three, whose first row is `at`.
    pub(super) fn add(&mut self, at: usize, block: &[[f64; 3]; 3]) {
        for (i, row) in self.rows[at..at + 3].iter_mut().enumerate() {
            for k in i..3 {
                row[k - i] += block[i][k];
            }
        }
    }

    /// The row becomes that of the identity: its unknown is the right side's.
    pub(super) fn fix(&mut self, at: usize, right: &mut [f64]) {
        for back in 1..=2.min(at) {
            self.rows[at - back][back] = 0.0;
        }
        self.rows[at] = [1.0, 0.0, 0.0];
        right[at] = 0.0;
    }

    /// Solves in place; false when a pivot is not above zero.
    pub(super) fn solve(&mut self, right: &mut [f64]) -> bool {
        let n = self.rows.len();
        for i in 0..n {
            let pivot = self.rows[i];
            if !(pivot[0] > 0.0 && pivot[0].is_finite()) {
                return false;
            }
            for below in 1..3.min(n - i) {
                let factor = pivot[below] / pivot[0];
                for (k, value) in pivot.iter().enumerate().skip(below) {
                    self.rows[i + below][k - below] -= factor * value;
                }
                right[i + below] -= factor * right[i];
            }
        }
        for i in (0..n).rev() {
            let ahead: f64 = (1..3.min(n - i)).map(|k| right[i + k] * self.rows[i][k]).sum();
            right[i] = (right[i] - ahead) / self.rows[i][0];
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn it_solves_what_the_dense_elimination_solves() {
        let (n, block) = (9, [[4.0, 1.0, -0.5], [1.0, 3.0, 0.7], [-0.5, 0.7, 5.0]]);
        let mut bands = Bands::zeros(n);
        let mut dense = DMatrix::<f64>::zeros(n, n);
        for at in 0..n - 2 {
            bands.add(at, &block);
            for (i, row) in block.iter().enumerate() {
                for (k, value) in row.iter().enumerate() {
                    dense[(at + i, at + k)] += value;
                }
            }
        }
        let right: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let wanted = dense.lu().solve(&DVector::from_vec(right.clone())).unwrap();
        let mut found = right;
        assert!(bands.solve(&mut found));
        assert!(found.iter().zip(wanted.iter()).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
