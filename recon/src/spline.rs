//! Uniform cubic B-splines (C2), and the banded equations of their smooth fits.

/// A row of equal knot intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Knots {
    start: f64,
    step: f64,
    intervals: usize,
}

impl Knots {
    /// Intervals of about `step` from `start` to `end`.
    pub(crate) fn over(start: f64, end: f64, step: f64) -> Self {
        let intervals = ((end - start) / step).ceil().clamp(1.0, 1e5) as usize;
        Self { start, step: ((end - start) / intervals as f64).max(1e-12), intervals }
    }

    /// How many coefficients a spline has.
    pub(crate) const fn coefficients(&self) -> usize {
        self.intervals + 3
    }

    /// The first of the four coefficients that matter at `at`, and what each is multiplied by. Beyond the ends the
    /// last polynomial goes on.
    pub(crate) fn basis(&self, at: f64) -> (usize, [f64; 4]) {
        let (first, t) = self.interval(at);
        let u = 1.0 - t;
        let middle = |a: f64, b: f64| (3.0 * a * a * b + 3.0 * a + 1.0) / 6.0;
        (first, [u * u * u / 6.0, middle(u, t), middle(t, u), t * t * t / 6.0])
    }

    /// The same for the first derivative.
    pub(crate) fn slope(&self, at: f64) -> (usize, [f64; 4]) {
        let (first, t) = self.interval(at);
        let u = 1.0 - t;
        let values = [-u * u / 2.0, (3.0 * t - 4.0) * t / 2.0, (4.0 - 3.0 * u) * u / 2.0, t * t / 2.0];
        (first, values.map(|value| value / self.step))
    }

    /// The same for the second derivative.
    pub(crate) fn bend(&self, at: f64) -> (usize, [f64; 4]) {
        let (first, t) = self.interval(at);
        let values = [1.0 - t, 3.0 * t - 2.0, 1.0 - 3.0 * t, t];
        (first, values.map(|value| value / (self.step * self.step)))
    }

    /// How long an interval is.
    pub(crate) const fn step_m(&self) -> f64 {
        self.step
    }

    /// How many intervals there are.
    pub(crate) const fn intervals(&self) -> usize {
        self.intervals
    }

    /// The interval of a place, and how far along it the place lies (0 to 1; beyond the ends, less or more).
    pub(crate) fn interval(&self, at: f64) -> (usize, f64) {
        let x = (at - self.start) / self.step;
        let first = x.floor().clamp(0.0, self.intervals as f64 - 1.0);
        (first as usize, x - first)
    }

    /// Places and weights with which the square of the second derivative is integrated exactly (Simpson on the
    /// pieces, where it is a parabola).
    pub(crate) fn bend_integral(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let (start, step) = (self.start, self.step);
        (0..self.intervals).flat_map(move |i| {
            let left = start + i as f64 * step;
            // A hair inside the interval, so that rounding does not pick the next one.
            [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)]
                .map(|(t, w)| (left + step * (1e-9 + t * (1.0 - 2e-9)), w * step / 6.0))
        })
    }
}

/// A symmetric matrix with a band, and its right-hand sides.
#[derive(Clone, Debug)]
pub(crate) struct Banded {
    size: usize,
    band: usize,
    /// Row i holds (i, i - band) to (i, i).
    rows: Vec<f64>,
}

impl Banded {
    /// Zeros; `band` is the largest distance of a column from the diagonal.
    pub(crate) fn new(size: usize, band: usize) -> Self {
        Self { size, band, rows: vec![0.0; size * (band + 1)] }
    }

    /// Adds to the element (i, j), and so to (j, i).
    pub(crate) fn add(&mut self, i: usize, j: usize, value: f64) {
        let (i, j) = (i.max(j), i.min(j));
        if let Some(element) = self.rows.get_mut(i * (self.band + 1) + self.band + j - i)
            && i - j <= self.band
        {
            *element += value;
        }
    }

    /// The largest difference of two elements in the same place.
    #[cfg(test)]
    pub(crate) fn largest_difference(&self, other: &Self) -> f64 {
        self.rows.iter().zip(&other.rows).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// The Cholesky factor, when the matrix is positive definite.
    pub(crate) fn factor(mut self) -> Option<Factor> {
        let width = self.band + 1;
        for i in 0..self.size {
            let (before, row) = self.rows.split_at_mut(i * width);
            let low = i.saturating_sub(self.band);
            for j in low..=i {
                let from = low.max(j.saturating_sub(self.band));
                let (a, b) = (self.band + from - i, self.band + from - j);
                let length = j - from;
                let other = if j < i { &before[j * width..] } else { &*row };
                let left = row[a + length] - dot(&row[a..a + length], &other[b..b + length]);
                row[a + length] = if j < i {
                    left / other[self.band]
                } else if left > 0.0 && left.is_finite() {
                    left.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(Factor(self))
    }
}

/// The sum of products, in four sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (fours, rest) = (a.chunks_exact(4), a.chunks_exact(4).remainder());
    let mut sums = [0.0; 4];
    for (x, y) in fours.zip(b.chunks_exact(4)) {
        (0..4).for_each(|k| sums[k] += x[k] * y[k]);
    }
    let beyond = a.len() - rest.len();
    let tail: f64 = rest.iter().zip(&b[beyond..]).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

/// A lower triangle whose product with its transpose is the matrix.
pub(crate) struct Factor(Banded);

impl Factor {
    /// Solves for one right-hand side.
    pub(crate) fn solve(&self, mut right: Vec<f64>) -> Vec<f64> {
        let Banded { size, band, rows } = &self.0;
        let row = |i: usize| &rows[i * (band + 1)..(i + 1) * (band + 1)];
        for i in 0..*size {
            let low = i.saturating_sub(*band);
            let known = dot(&row(i)[band + low - i..*band], &right[low..i]);
            right[i] = (right[i] - known) / row(i)[*band];
        }
        for i in (0..*size).rev() {
            let low = i.saturating_sub(*band);
            right[i] /= row(i)[*band];
            let value = right[i];
            let above = row(i)[band + low - i..*band].iter().zip(&mut right[low..i]);
            above.for_each(|(element, sum)| *sum -= element * value);
        }
        right
    }

    /// The elements of the matrix's inverse that lie within the band (Takahashi, Fagan and Chen 1973): from the last
    /// row up, `Z_ij = (d_ij / L_ii - sum_k L_ki Z_kj) / L_ii`, `k` from `i + 1` to `i + band`.
    pub(crate) fn inverse_in_band(&self) -> InBand {
        let Banded { size, band, rows } = &self.0;
        let mut inverse = InBand { band: *band, rows: vec![0.0; size * (2 * band + 1)] };
        let mut column = vec![0.0; *band];
        for i in (0..*size).rev() {
            let diagonal = rows[i * (band + 1) + band];
            let last = (i + band).min(size - 1);
            for k in i + 1..=last {
                column[k - i - 1] = rows[k * (band + 1) + band + i - k] / diagonal;
            }
            for j in (i..=last).rev() {
                let own = if i == j { 1.0 / (diagonal * diagonal) } else { 0.0 };
                let from = inverse.place(j, i + 1);
                let known = &inverse.rows[from..from + last - i];
                let value = own - dot(&column[..last - i], known);
                let (one, other) = (inverse.place(i, j), inverse.place(j, i));
                inverse.rows[one] = value;
                inverse.rows[other] = value;
            }
        }
        inverse
    }
}

/// The part of a symmetric matrix within a band.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InBand {
    band: usize,
    /// Row i holds (i, i - band) to (i, i + band).
    rows: Vec<f64>,
}

impl InBand {
    const fn place(&self, i: usize, j: usize) -> usize {
        i * (2 * self.band + 1) + self.band + j - i
    }

    /// The element (i, j), which must lie within the band.
    #[cfg(test)]
    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        self.rows[self.place(i, j)]
    }

    /// The elements (i, from) to (i, from + count), which must lie within the band.
    pub(crate) fn part(&self, i: usize, from: usize, count: usize) -> &[f64] {
        let start = self.place(i, from);
        &self.rows[start..start + count]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    #[test]
    fn a_spline_gives_back_a_cubic_and_its_derivatives() {
        let knots = Knots::over(-1.0, 2.0, 0.5);
        // Coefficients of x^3: the product of the three knots round each (blossom).
        let knot = |i: usize| -1.0 + 0.5 * (i as f64 - 1.0);
        let coefficient: Vec<f64> =
            (0..knots.coefficients()).map(|i| (knot(i) - 0.5) * knot(i) * (knot(i) + 0.5)).collect();
        let sum =
            |(first, w): (usize, [f64; 4])| -> f64 { (0..4).map(|k| w[k] * coefficient[first + k]).sum() };
        for k in 0..=60 {
            let x = -1.0 + 0.05 * f64::from(k);
            assert!((sum(knots.basis(x)) - x * x * x).abs() < 1e-12, "{x}");
            assert!((sum(knots.slope(x)) - 3.0 * x * x).abs() < 1e-11, "{x}");
            assert!((sum(knots.bend(x)) - 6.0 * x).abs() < 1e-10, "{x}");
        }
        let integral: f64 = knots.bend_integral().map(|(x, w)| w * sum(knots.bend(x)).powi(2)).sum();
        assert!((integral - 12.0 * (8.0 + 1.0)).abs() < 1e-6, "{integral}");
    }

    #[test]
    fn a_banded_solution_is_the_dense_one() {
        let mut dice = crate::phantom_images::Dice(3);
        for size in [1, 2, 5, 30] {
            let band = 4.min(size - 1);
            let mut banded = Banded::new(size, band);
            let mut dense = DMatrix::<f64>::zeros(size, size);
            for i in 0..size {
                for j in i.saturating_sub(band)..=i {
                    let value = if i == j { 10.0 } else { dice.uniform() - 0.5 };
                    banded.add(j, i, value);
                    dense[(i, j)] = value;
                    dense[(j, i)] = value;
                }
            }
            let right: Vec<f64> = (0..size).map(|_| dice.uniform()).collect();
            let ours = banded.factor().expect("positive definite");
            let theirs = dense.cholesky().expect("positive definite");
            let apart =
                DVector::from_vec(ours.solve(right.clone())) - theirs.solve(&DVector::from_vec(right));
            assert!(apart.amax() < 1e-13);
            let (inverse, exact) = (ours.inverse_in_band(), theirs.inverse());
            for i in 0..size {
                for j in i.saturating_sub(band)..size.min(i + band + 1) {
                    assert!((inverse.get(i, j) - exact[(i, j)]).abs() < 1e-14, "{size}: {i}, {j}");
                }
            }
        }
    }
}
