//! A cubic spline through uniformly spaced knots: twice continuously differentiable, its third derivative bounded
//! and constant between knots, so that what follows it has a jerk limit.

use nalgebra::SVector;

/// A C2 curve in `D` dimensions through knots at `0, step, 2 step, ...`.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline<const D: usize> {
    step: f64,
    knots: Vec<SVector<f64, D>>,
    /// Second derivative at each knot.
    bends: Vec<SVector<f64, D>>,
}

/// Value and first three derivatives.
pub type Jet<const D: usize> = [SVector<f64, D>; 4];

impl<const D: usize> Spline<D> {
    /// The spline through `knots`, whose second derivative is constant over the first and the last piece
    /// (parabolic ends). `None` when there are fewer than four knots, or `step` or a knot is not finite or `step`
    /// not above zero.
    pub fn through(step: f64, knots: Vec<SVector<f64, D>>) -> Option<Self> {
        let fine = step.is_finite() && step > 0.0 && knots.iter().all(|k| k.iter().all(|x| x.is_finite()));
        if !fine || knots.len() < 4 {
            return None;
        }
        let bends = bends(step, &knots);
        Some(Self { step, knots, bends })
    }

    /// The parameter of the last knot.
    pub fn end(&self) -> f64 {
        self.step * (self.knots.len() - 1) as f64
    }

    /// The distance between knots.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// The knots.
    pub fn knots(&self) -> &[SVector<f64, D>] {
        &self.knots
    }

    /// Value and derivatives at `u`; a `u` outside the spline is taken to its nearest end.
    pub fn at(&self, u: f64) -> Jet<D> {
        let u = u.clamp(0.0, self.end());
        let piece = ((u / self.step) as usize).min(self.knots.len() - 2);
        self.on(piece, u - self.step * piece as f64)
    }

    /// Value and derivatives in one piece, `right` of its beginning: at a knot the third derivative jumps, and a
    /// piece has its own.
    pub(crate) fn on(&self, piece: usize, right: f64) -> Jet<D> {
        let h = self.step;
        let left = h - right;
        let (k0, k1) = (&self.knots[piece], &self.knots[piece + 1]);
        let (m0, m1) = (&self.bends[piece], &self.bends[piece + 1]);
        let value = m0 * (left.powi(3) / (6.0 * h))
            + m1 * (right.powi(3) / (6.0 * h))
            + (k0 / h - m0 * (h / 6.0)) * left
            + (k1 / h - m1 * (h / 6.0)) * right;
        let first = (k1 - k0) / h - m0 * (left * left / (2.0 * h) - h / 6.0)
            + m1 * (right * right / (2.0 * h) - h / 6.0);
        [value, first, (m0 * left + m1 * right) / h, (m1 - m0) / h]
    }
}

/// Second derivatives at the knots: the tridiagonal system `m[i-1] + 4 m[i] + m[i+1] = 6 (k[i-1] - 2 k[i] + k[i+1]) / h^2`
/// with `m[0] = m[1]` and `m[n-1] = m[n-2]`, by elimination (always diagonally dominant).
fn bends<const D: usize>(h: f64, knots: &[SVector<f64, D>]) -> Vec<SVector<f64, D>> {
    let inner = knots.len() - 2;
    let mut right: Vec<SVector<f64, D>> =
        knots.windows(3).map(|k| (k[0] - k[1] * 2.0 + k[2]) * (6.0 / (h * h))).collect();
    let diagonal = |i: usize| if i == 0 || i == inner - 1 { 5.0 } else { 4.0 };
    let mut pivots = vec![diagonal(0); inner];
    for i in 1..inner {
        let factor = 1.0 / pivots[i - 1];
        pivots[i] = diagonal(i) - factor;
        let before = right[i - 1];
        right[i] -= before * factor;
    }
    let mut bends = vec![SVector::zeros(); knots.len()];
    for i in (0..inner).rev() {
        let after = if i + 1 == inner { SVector::zeros() } else { bends[i + 2] };
        bends[i + 1] = (right[i] - after) / pivots[i];
    }
    bends[0] = bends[1];
    bends[inner + 1] = bends[inner];
    bends
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};
    use proptest::prelude::*;

    fn parabola(u: f64) -> Vector2<f64> {
        Vector2::new(1.0 + 2.0 * u - 3.0 * u * u, -u)
    }

    #[test]
    fn a_parabola_is_reproduced_to_rounding() {
        let spline = Spline::through(0.1, (0..20).map(|i| parabola(0.1 * f64::from(i))).collect()).unwrap();
        for i in 0..190 {
            let u = 0.01 * f64::from(i);
            let [value, first, second, third] = spline.at(u);
            assert!((value - parabola(u)).norm() < 1e-12);
            assert!((first - Vector2::new(2.0 - 6.0 * u, -1.0)).norm() < 1e-11);
            assert!((second - Vector2::new(-6.0, 0.0)).norm() < 1e-9);
            assert!(third.norm() < 1e-7);
        }
    }

    #[test]
    fn too_few_knots_or_one_that_is_not_finite_is_no_spline() {
        assert!(Spline::through(0.1, vec![Vector2::zeros(); 3]).is_none());
        assert!(Spline::through(0.0, vec![Vector2::zeros(); 5]).is_none());
        let mut knots = vec![Vector2::zeros(); 5];
        knots[2].y = f64::NAN;
        assert!(Spline::through(0.1, knots).is_none());
    }

    fn knots() -> impl Strategy<Value = Vec<Vector3<f64>>> {
        prop::collection::vec(prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from), 4..40)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 1000, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn it_passes_through_its_knots_and_is_twice_differentiable_there(knots in knots()) {
            let spline = Spline::through(1.0, knots.clone()).unwrap();
            for (i, knot) in knots.iter().enumerate() {
                let u = i as f64;
                prop_assert!((spline.at(u)[0] - knot).norm() < 1e-12);
                if i > 0 && i + 1 < knots.len() {
                    let (before, after) = (spline.at(u - 1e-9), spline.at(u + 1e-9));
                    prop_assert!((before[1] - after[1]).norm() < 1e-6);
                    prop_assert!((before[2] - after[2]).norm() < 1e-6);
                }
            }
        }

        #[test]
        fn its_derivatives_agree_with_finite_differences(knots in knots(), place in 0.0..1.0f64) {
            let spline = Spline::through(1.0, knots).unwrap();
            // Inside one piece, where the third derivative exists.
            let u = (place * (spline.end() - 1.0)).floor() + 0.2 + 0.6 * place.fract();
            let h = 1e-4;
            let (before, here, after) = (spline.at(u - h), spline.at(u), spline.at(u + h));
            for order in 0..3 {
                let difference = (after[order] - before[order]) / (2.0 * h);
                prop_assert!((difference - here[order + 1]).norm() < 1e-6, "order {order}");
            }
        }
    }
}
