//! The normal equations of the tube: B-splines along, harmonics around.
//!
//! Within one interval of knots the four B-splines are cubics of the place `t` in it, and a product of two harmonics
//! is a sum of harmonics up to twice as high. So all that the points of an interval say is in the sums of
//! `weight t^p C_q`, `p` to 6 and `q` to ten harmonics: 147 sums a point instead of 990 products, and the matrix is put
//! together once an interval.

use super::samples::{Sample, Samples};
use super::tube::{AROUND, HARMONICS, SPAN, harmonics_of};
use crate::spline::{Banded, Knots};

/// Powers of `t` in a product of two cubics, and in one.
const POWERS: usize = 7;
const CUBIC: usize = 4;
/// Harmonics in a product: cosines 0 to 10, then sines 1 to 10.
const PRODUCTS: usize = 4 * HARMONICS + 1;

/// Coefficients of `t^p` in the four B-splines of an interval.
const SPLINES: [[f64; CUBIC]; 4] =
    [[1.0, -3.0, 3.0, -1.0], [4.0, 0.0, -6.0, 3.0], [1.0, 3.0, 3.0, -3.0], [0.0, 0.0, 0.0, 1.0]];
/// They are all divided by this.
const SIXTH: f64 = 1.0 / 6.0;

/// What the points of one interval say.
#[derive(Clone)]
struct Moments {
    left: [[f64; PRODUCTS]; POWERS],
    right: [[f64; AROUND]; CUBIC],
}

impl Moments {
    const NONE: Self = Self { left: [[0.0; PRODUCTS]; POWERS], right: [[0.0; AROUND]; CUBIC] };

    fn add(&mut self, sample: &Sample, t: f64, trust: f64) {
        let round: [f64; PRODUCTS] = products(sample.turn);
        let own = harmonics_of(sample.turn);
        let mut weight = trust * sample.weight;
        for (power, sums) in self.left.iter_mut().enumerate() {
            sums.iter_mut().zip(&round).for_each(|(sum, value)| *sum += weight * value);
            if let Some(sums) = self.right.get_mut(power) {
                let weight = weight * sample.r;
                sums.iter_mut().zip(&own).for_each(|(sum, value)| *sum += weight * value);
            }
            weight *= t;
        }
    }

    /// The sums with the product of two B-splines in place of the powers.
    fn of_pair(&self, a: usize, b: usize) -> [f64; PRODUCTS] {
        let mut sums = [0.0; PRODUCTS];
        for (p, left) in SPLINES[a].iter().enumerate() {
            for (q, right) in SPLINES[b].iter().enumerate() {
                let factor = left * right * SIXTH * SIXTH;
                sums.iter_mut().zip(&self.left[p + q]).for_each(|(sum, value)| *sum += factor * value);
            }
        }
        sums
    }

    fn of_one(&self, a: usize) -> [f64; AROUND] {
        std::array::from_fn(|k| (0..CUBIC).map(|p| SPLINES[a][p] * SIXTH * self.right[p][k]).sum())
    }
}

/// Left and right side for all contours, each trusted as `trust` says.
pub(super) fn normal(knots: &Knots, contours: &[Samples], trust: &[f64]) -> (Banded, Vec<f64>) {
    let mut moments = vec![Moments::NONE; knots.intervals()];
    for (sample, trust) in contours.iter().zip(trust).flat_map(|(c, t)| c.points.iter().map(move |s| (s, *t)))
    {
        let (interval, t) = knots.interval(sample.at);
        moments[interval].add(sample, t, trust);
    }
    let size = knots.coefficients() * AROUND;
    let (mut matrix, mut right) = (Banded::new(size, SPAN), vec![0.0; size]);
    for (interval, moments) in moments.iter().enumerate() {
        for a in 0..4 {
            let row = (interval + a) * AROUND;
            right[row..row + AROUND].iter_mut().zip(moments.of_one(a)).for_each(|(sum, value)| *sum += value);
            (0..=a).for_each(|b| block(&mut matrix, row, (interval + b) * AROUND, &moments.of_pair(a, b)));
        }
    }
    (matrix, right)
}

/// Adds the sums of products of two harmonics.
fn block(matrix: &mut Banded, row: usize, column: usize, sums: &[f64; PRODUCTS]) {
    for i in 0..AROUND {
        let until = if row == column { i + 1 } else { AROUND };
        (0..until).for_each(|j| matrix.add(row + i, column + j, product(i, j, sums)));
    }
}

/// The sum of the product of the harmonics `i` and `j`, from the sums of single ones.
fn product(i: usize, j: usize, sums: &[f64; PRODUCTS]) -> f64 {
    let cosine = |n: usize| sums[n];
    let sine = |n: usize| if n == 0 { 0.0 } else { sums[2 * HARMONICS + n] };
    let (m, n) = (i.div_ceil(2), j.div_ceil(2));
    let apart = m.abs_diff(n);
    // Even numbers beyond zero are sines.
    match (i > 0 && i.is_multiple_of(2), j > 0 && j.is_multiple_of(2)) {
        (false, false) => 0.5 * (cosine(apart) + cosine(m + n)),
        (true, true) => 0.5 * (cosine(apart) - cosine(m + n)),
        (true, false) => 0.5 * (sine(m + n) + if m > n { sine(apart) } else { -sine(apart) }),
        (false, true) => 0.5 * (sine(m + n) + if n > m { sine(apart) } else { -sine(apart) }),
    }
}

/// Cosines 0 to 10 and sines 1 to 10 of an angle.
fn products((cos, sin): (f64, f64)) -> [f64; PRODUCTS] {
    let mut all = [0.0; PRODUCTS];
    let mut turn = (1.0, 0.0);
    all[0] = 1.0;
    for n in 1..=2 * HARMONICS {
        turn = (turn.0 * cos - turn.1 * sin, turn.0 * sin + turn.1 * cos);
        (all[n], all[2 * HARMONICS + n]) = turn;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Dice;

    #[test]
    fn the_equations_are_those_of_every_point_by_itself() {
        let mut dice = Dice(5);
        let knots = Knots::over(0.0, 9.0, 2.0);
        let mut sample = || {
            let angle = dice.uniform() * 7.0;
            let (at, r, weight) = (dice.uniform() * 11.0 - 1.0, dice.uniform(), dice.uniform());
            Sample { at, turn: (angle.cos(), angle.sin()), r, weight }
        };
        let contour = Samples {
            at: 0.0,
            means: [1.0, 0.0, 0.0],
            own_sd: 1.0,
            speckle_part: 1.0,
            common_sd: 0.0,
            turn: 0,
            points: (0..400).map(|_| sample()).collect(),
        };
        let (ours, right) = normal(&knots, std::slice::from_ref(&contour), &[0.7]);
        let size = knots.coefficients() * AROUND;
        let (mut plain, mut plain_right) = (Banded::new(size, SPAN), vec![0.0; size]);
        for point in &contour.points {
            let (first, along) = knots.basis(point.at);
            let round = harmonics_of(point.turn);
            let row: Vec<f64> = (0..4 * AROUND).map(|k| along[k / AROUND] * round[k % AROUND]).collect();
            for a in 0..row.len() {
                plain_right[first * AROUND + a] += 0.7 * point.weight * row[a] * point.r;
                (0..=a).for_each(|b| {
                    plain.add(first * AROUND + a, first * AROUND + b, 0.7 * point.weight * row[a] * row[b]);
                });
            }
        }
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart(&right, &plain_right) < 1e-12);
        assert!(ours.largest_difference(&plain) < 1e-12);
    }
}
