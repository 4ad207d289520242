//! [`Weakest`]: the smallest singular value of the Jacobian, followed from tick to tick, and where it grows.

use nalgebra::{Cholesky, SMatrix};

use crate::model::{Jacobian, Vector6};
use crate::{Joints, MAX_JOINTS};

/// Iterations from scratch, and each tick: the value changes little in one, and each iteration squares what is left of
/// the others' parts.
const FIRST: usize = 30;
/// Change of a joint (rad, m) for the gradient.
const APART: f64 = 1e-6;
/// Far below the square of a useful singular value, so that a singular matrix can be inverted.
const DAMPING: f64 = 1e-12;

/// The direction that the tool can move in least, and how much.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weakest {
    direction: Vector6,
    value: f64,
    /// How much it fell in the last tick.
    fell: f64,
}

impl Weakest {
    pub(super) fn of(jacobian: &Jacobian) -> Self {
        let mut weakest =
            Self { direction: Vector6::from([0.7, 0.3, -0.5, 0.4, -0.6, 0.5]), value: 0.0, fell: 0.0 };
        for _ in 0..FIRST {
            weakest.follow(jacobian);
        }
        weakest.fell = 0.0;
        weakest
    }

    /// One step of inverse iteration on `J Jᵀ`, and Rayleigh's quotient.
    pub(super) fn follow(&mut self, jacobian: &Jacobian) {
        let j = jacobian.matrix();
        let square = j * j.transpose() + SMatrix::<f64, 6, 6>::identity() * DAMPING;
        let Some(factor) = Cholesky::new(square) else { return };
        let next = factor.solve(&self.direction);
        let length = next.norm();
        if length.is_finite() && length > 0.0 {
            self.direction = next / length;
            let value = (j.transpose() * self.direction).norm();
            (self.fell, self.value) = (self.value - value, value);
        }
    }

    /// The smallest singular value.
    pub(super) const fn value(&self) -> f64 {
        self.value
    }

    /// How much it fell in the last tick; below zero where it grew.
    pub(super) const fn fell(&self) -> f64 {
        self.fell
    }

    /// How it grows with each joint: `uᵀ (∂J/∂q) v` with the singular vectors held, by differences.
    pub(super) fn gradient(
        &self,
        here: &Joints,
        jacobian: &Jacobian,
        at: impl Fn(&Joints) -> Jacobian,
    ) -> Joints {
        let turned = jacobian.matrix().transpose() * self.direction;
        let other = turned / turned.norm().max(f64::MIN_POSITIVE);
        let of = |j: &SMatrix<f64, 6, MAX_JOINTS>| self.direction.dot(&(j * other));
        let base = of(jacobian.matrix());
        let mut gradient = Joints::zeros(here.len());
        for joint in 0..here.len() {
            let mut there = *here;
            there[joint] += APART;
            gradient[joint] = (of(at(&there).matrix()) - base) / APART;
        }
        gradient
    }
}
