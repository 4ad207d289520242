//! The path of least jerk inside a tube around what was taught: a sparse quadratic programme.
//!
//! With third differences `D` the programme is, coordinate by coordinate,
//!
//! ```text
//! minimise |D g|^2   subject to   |g - y| <= half width   wherever y was taught
//! ```
//!
//! solved by a primal-dual interior point, whose every step is one elimination with three diagonals beside the main
//! one. Crate `osqp` 0.6.3 would do it too, but its build wants CMake on every machine; this one is held against the
//! conditions that only the optimum fulfils.

use nalgebra::SVector;

use super::smooth::{Weighted, penalty, smooth, solve};

/// A half width per coordinate.
pub(super) type Widths<const D: usize> = SVector<f64, D>;

/// The duality gap, as part of what it was at the beginning, at which the optimum is near enough.
const GAP: f64 = 1e-9;
const MOST_STEPS: usize = 100;
/// How much of the last gap a step aims at; part of the way to the nearest bound that it takes.
const CENTRE: f64 = 0.1;
const CLOSE: f64 = 0.995;

/// The values of least jerk within `widths` of the known ones; steps never seen are free. `None` when fewer than
/// three values are known, or a programme did not come to its end.
pub(super) fn within<const D: usize>(
    values: &[Weighted<D>],
    widths: &Widths<D>,
    cutoff: f64,
) -> Option<Vec<SVector<f64, D>>> {
    // What is free begins where the smoother puts it.
    let mut found = smooth(values, cutoff)?;
    for axis in 0..D {
        let taught: Vec<Option<f64>> = values.iter().map(|(w, y)| (*w > 0.0).then(|| y[axis])).collect();
        let begin: Vec<f64> = found.iter().map(|g| g[axis]).collect();
        let inside = Programme::new(&taught, &begin, widths[axis]).solved()?;
        for (g, value) in found.iter_mut().zip(inside) {
            g[axis] = value;
        }
    }
    Some(found)
}

/// One coordinate, in half widths from what was taught.
struct Programme<'a> {
    taught: &'a [Option<f64>],
    width: f64,
    /// Where each value is measured from.
    from: Vec<f64>,
    x: Vec<f64>,
    /// Duals of the upper and the lower bound.
    duals: Vec<[f64; 2]>,
    jerk: Vec<[f64; 4]>,
}

impl<'a> Programme<'a> {
    fn new(taught: &'a [Option<f64>], begin: &[f64], width: f64) -> Self {
        let from: Vec<f64> = taught.iter().zip(begin).map(|(y, g)| y.unwrap_or(*g)).collect();
        let jerk = penalty(taught.len(), 1.0);
        let x = vec![0.0; taught.len()];
        let mut programme = Self { taught, width, from, x, duals: Vec::new(), jerk };
        let pull = programme.pull().iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        programme.duals = vec![[pull.max(1e-9); 2]; taught.len()];
        programme
    }

    /// The slope of the jerk's half square, in half widths.
    fn pull(&self) -> Vec<f64> {
        let g: Vec<f64> = self.x.iter().zip(&self.from).map(|(x, from)| x + from / self.width).collect();
        let third: Vec<f64> = g.windows(4).map(|w| w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).collect();
        let mut pull = vec![0.0; g.len()];
        for (i, third) in third.iter().enumerate() {
            for (k, weight) in [-1.0, 3.0, -3.0, 1.0].into_iter().enumerate() {
                pull[i + k] += weight * third;
            }
        }
        pull
    }

    fn gap(&self) -> f64 {
        let bounded = self.taught.iter().zip(self.x.iter().zip(&self.duals)).filter(|(y, _)| y.is_some());
        bounded.map(|(_, (x, [up, down]))| (1.0 - x) * up + (1.0 + x) * down).sum()
    }

    fn solved(mut self) -> Option<Vec<f64>> {
        let count = 2.0 * self.taught.iter().flatten().count() as f64;
        let begin = self.gap();
        for _ in 0..MOST_STEPS {
            let gap = self.gap();
            if gap <= GAP * begin {
                let found = self.x.iter().zip(&self.from).map(|(x, from)| from + x * self.width);
                return Some(found.collect()).filter(|f: &Vec<f64>| f.iter().all(|g| g.is_finite()));
            }
            self.step(CENTRE * gap / count);
        }
        None
    }

    fn step(&mut self, mu: f64) {
        let mut bands = self.jerk.clone();
        let mut right: Vec<SVector<f64, 1>> = self.pull().iter().map(|p| SVector::from([-p])).collect();
        for (i, bounded) in self.taught.iter().enumerate() {
            // What is free leans on its neighbours alone; a trace of weight keeps the elimination sound.
            bands[i][0] += 1e-12;
            if bounded.is_some() {
                let (up, down) = (1.0 - self.x[i], 1.0 + self.x[i]);
                bands[i][0] += self.duals[i][0] / up + self.duals[i][1] / down;
                right[i][0] += mu / down - mu / up;
            }
        }
        solve(&mut bands, &mut right);
        let (mut far, mut far_dual) = (1.0_f64, 1.0_f64);
        let mut changes = Vec::with_capacity(right.len());
        for (i, by) in right.iter().enumerate() {
            let (up, down, by) = (1.0 - self.x[i], 1.0 + self.x[i], by[0]);
            let [upper, lower] = self.duals[i];
            let change = [mu / up - upper + upper / up * by, mu / down - lower - lower / down * by];
            if self.taught[i].is_some() {
                far = nearer(nearer(far, up, -by), down, by);
                far_dual = nearer(nearer(far_dual, upper, change[0]), lower, change[1]);
            }
            changes.push(change);
        }
        for (i, by) in right.iter().enumerate() {
            self.x[i] += far * by[0];
            if self.taught[i].is_some() {
                for (dual, change) in self.duals[i].iter_mut().zip(changes[i]) {
                    *dual += far_dual * change;
                }
            }
        }
    }
}

/// The part of a step that keeps `value` above zero.
fn nearer(far: f64, value: f64, by: f64) -> f64 {
    if by < 0.0 { far.min(-CLOSE * value / by) } else { far }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taught(i: usize) -> f64 {
        let s = i as f64 * 0.0005;
        // A leg, and a tremor of 0.4 mm over 9 mm.
        0.01 * (s * 20.0).sin() + 0.0004 * (s * 700.0).sin() + 0.0001 * ((i * 7919) % 101) as f64 / 101.0
    }

    fn jerk(g: &[f64]) -> f64 {
        g.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2)).sum()
    }

    fn values(gap: bool) -> Vec<Weighted<1>> {
        let known = |i: usize| !(gap && (200..240).contains(&i));
        (0..600).map(|i| (f64::from(u8::from(known(i))), SVector::from([taught(i)]))).collect()
    }

    #[test]
    fn what_it_finds_is_in_the_tube_and_no_step_inside_it_has_less_jerk() {
        for (width, gap) in [(0.001, false), (0.0003, false), (0.001, true), (0.0001, true)] {
            let values = values(gap);
            let found = within(&values, &SVector::from([width]), 40.0).unwrap();
            let g: Vec<f64> = found.iter().map(|v| v[0]).collect();
            // The optimum's own conditions: where a value is free of its bounds the slope is zero, at the upper bound
            // it pulls up, at the lower down.
            let largest = 8.0 * jerk(&g).sqrt();
            let mut slope = vec![0.0; g.len()];
            for (i, w) in g.windows(4).enumerate() {
                let third = w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0];
                for (k, weight) in [-1.0, 3.0, -3.0, 1.0].into_iter().enumerate() {
                    slope[i + k] += weight * third;
                }
            }
            for (i, (weight, y)) in values.iter().enumerate() {
                let off = (g[i] - y[0]) / width;
                assert!(*weight == 0.0 || off.abs() <= 1.0, "{i}: {off}");
                let small = 1e-3 * largest;
                let bound = *weight > 0.0;
                let right = (bound && off > 0.999 && slope[i] < small)
                    || (bound && off < -0.999 && slope[i] > -small)
                    || slope[i].abs() < small;
                assert!(right, "{width} {i}: off {off}, slope {} of {largest}", slope[i]);
            }
            assert!(jerk(&g) < 0.5 * jerk(&values.iter().map(|v| v.1[0]).collect::<Vec<_>>()));
        }
    }

    #[test]
    fn a_wider_tube_has_less_jerk_and_a_parabola_none() {
        let of = |width: f64| {
            let found = within(&values(false), &SVector::from([width]), 40.0).unwrap();
            jerk(&found.iter().map(|v| v[0]).collect::<Vec<_>>())
        };
        assert!(of(0.001) < of(0.0005) && of(0.0005) < of(0.0001));
        let parabola: Vec<Weighted<1>> =
            (0..100).map(|i| (1.0, SVector::from([1e-6 * f64::from(i * i)]))).collect();
        let found = within(&parabola, &SVector::from([0.001]), 40.0).unwrap();
        assert!(jerk(&found.iter().map(|v| v[0]).collect::<Vec<_>>()) < 1e-18);
    }

    #[test]
    fn two_known_values_make_no_path() {
        let few: Vec<Weighted<1>> = (0..10).map(|i| (f64::from(u8::from(i < 2)), SVector::zeros())).collect();
        assert!(within(&few, &SVector::from([0.001]), 12.0).is_none());
    }
}
