//! [`Jacobian`]: how the tool moves when the joints do, and how close that is to being lost.

use nalgebra::{SMatrix, SVector, Vector3};

use crate::{Joints, MAX_JOINTS};

/// Six numbers: linear (m/s) then angular (rad/s), or their differences over one step.
pub type Vector6 = SVector<f64, 6>;

/// The geometric Jacobian, 6 x n on the stack: column j is the linear velocity of the tool's origin, then the angular
/// velocity of the tool, both in `Base`'s axes, when joint j moves with 1 rad/s (1 m/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian {
    pub(super) matrix: SMatrix<f64, 6, MAX_JOINTS>,
    pub(super) len: usize,
}

impl Jacobian {
    /// How many joints (columns).
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no joint.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Column `joint`: linear then angular; zeros beyond the last joint.
    pub fn column(&self, joint: usize) -> Vector6 {
        if joint < self.len { self.matrix.column(joint).into_owned() } else { Vector6::zeros() }
    }

    /// The 6 x n matrix; columns beyond [`Self::len`] are zero.
    pub const fn matrix(&self) -> &SMatrix<f64, 6, MAX_JOINTS> {
        &self.matrix
    }

    /// The tool's velocity (linear of its origin, then angular, in `Base`'s axes) at these joint velocities.
    pub fn velocity(&self, joints: &Joints) -> Vector6 {
        joints
            .iter()
            .take(self.len)
            .zip(self.matrix.column_iter())
            .fold(Vector6::zeros(), |sum, (v, c)| sum + c * v)
    }

    /// The joint torques (N m; N for a prismatic joint) that hold a force (N) and a torque (N m) which act on the tool
    /// at its origin, both in `Base`'s axes: the transposed Jacobian.
    pub fn torques(&self, force: &Vector3<f64>, torque: &Vector3<f64>) -> Joints {
        let mut all = Joints::zeros(self.len);
        for (tau, column) in all.as_mut_slice().iter_mut().zip(self.matrix.column_iter()) {
            *tau = column.fixed_rows::<3>(0).dot(force) + column.fixed_rows::<3>(3).dot(torque);
        }
        all
    }

    /// Yoshikawa's manipulability, the product of the singular values: `sqrt(det(J Jᵀ))` for six joints or more,
    /// `sqrt(det(Jᵀ J))` for fewer. Metres and radians are mixed as they come.
    pub fn manipulability(&self) -> f64 {
        self.singular_values().iter().take(self.rank_at_most()).product()
    }

    /// The smallest singular value: how much tool velocity the worst direction gets from unit joint velocity. Zero at
    /// a singularity, so it is the distance to one. NaN when the Jacobian is not finite.
    pub fn smallest_singular_value(&self) -> f64 {
        match self.rank_at_most() {
            0 => 0.0,
            rank => self.singular_values()[rank - 1],
        }
    }

    fn rank_at_most(&self) -> usize {
        self.len.min(6)
    }

    /// Singular values, the largest first; those that the missing columns add are zero and last.
    fn singular_values(&self) -> Vector6 {
        if self.matrix.iter().any(|x| !x.is_finite()) {
            return Vector6::repeat(f64::NAN);
        }
        let mut values = match self.matrix.try_svd_unordered(false, false, f64::EPSILON, 10_000) {
            Some(svd) => svd.singular_values,
            None => return Vector6::repeat(f64::NAN),
        };
        values.as_mut_slice().sort_unstable_by(|a, b| b.total_cmp(a));
        values
    }
}

/// Yoshikawa's manipulability of a Jacobian: [`Jacobian::manipulability`].
pub fn manipulability(jacobian: &Jacobian) -> f64 {
    jacobian.manipulability()
}

#[cfg(test)]
mod tests;
