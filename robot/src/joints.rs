//! [`Joints`]: one number per joint, on the stack.

use std::fmt;
use std::ops::{Index, IndexMut};

use thiserror::Error;

/// The most joints a serial chain may have here: seven, and one to spare.
pub const MAX_JOINTS: usize = 8;

/// One number per joint of a serial chain, in the chain's order from base to tip: rad (revolute) or m (prismatic),
/// or a rate of these. `Copy`, with room for [`MAX_JOINTS`], so that a step touches no heap whatever the URDF says.
#[derive(Clone, Copy, PartialEq)]
pub struct Joints {
    values: [f64; MAX_JOINTS],
    len: usize,
}

/// A number of joints that does not fit.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{found} joints given, {expected}")]
pub struct WrongJoints {
    /// How many came.
    pub found: usize,
    /// What would have fitted, in words.
    pub expected: &'static str,
}

impl Joints {
    /// Zeros for `len` joints; a `len` above [`MAX_JOINTS`] is cut to it (a model never has more).
    pub const fn zeros(len: usize) -> Self {
        Self { values: [0.0; MAX_JOINTS], len: if len > MAX_JOINTS { MAX_JOINTS } else { len } }
    }

    /// The same number for every joint.
    pub fn splat(len: usize, value: f64) -> Self {
        let mut all = Self::zeros(len);
        all.as_mut_slice().fill(value);
        all
    }

    /// The numbers of a slice.
    ///
    /// # Errors
    /// When there are more than [`MAX_JOINTS`].
    pub fn from_slice(values: &[f64]) -> Result<Self, WrongJoints> {
        if values.len() > MAX_JOINTS {
            return Err(WrongJoints { found: values.len(), expected: "at most 8 fit" });
        }
        let mut all = Self::zeros(values.len());
        all.as_mut_slice().copy_from_slice(values);
        Ok(all)
    }

    /// How many joints.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no joint at all.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The numbers.
    pub fn as_slice(&self) -> &[f64] {
        &self.values[..self.len]
    }

    /// The numbers, to be changed.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.values[..self.len]
    }

    /// The numbers, in the chain's order.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        self.as_slice().iter().copied()
    }

    /// Each number through `f`.
    pub fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        for value in self.as_mut_slice() {
            *value = f(*value);
        }
        self
    }

    /// Each pair of numbers through `f`; the shorter length counts.
    pub fn zip(mut self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        self.len = self.len.min(other.len);
        for (value, theirs) in self.values[..self.len].iter_mut().zip(other.iter()) {
            *value = f(*value, theirs);
        }
        self
    }

    /// The largest absolute number, zero when there is none; NaN when any is NaN.
    pub fn largest(&self) -> f64 {
        self.iter()
            .fold(0.0, |most: f64, x| if x.is_nan() || most.is_nan() { f64::NAN } else { most.max(x.abs()) })
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.iter().all(f64::is_finite)
    }
}

impl Index<usize> for Joints {
    type Output = f64;
    fn index(&self, joint: usize) -> &f64 {
        &self.as_slice()[joint]
    }
}

impl IndexMut<usize> for Joints {
    fn index_mut(&mut self, joint: usize) -> &mut f64 {
        &mut self.as_mut_slice()[joint]
    }
}

impl fmt::Debug for Joints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}
