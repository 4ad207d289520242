//! Points and directions that carry the system they are written in.

use std::marker::PhantomData;

use nalgebra::Vector3;

use crate::{Frame, FrameError};

/// A place, written in `F` (m).
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn wrong(in_image: Point<Image>, in_probe: Point<Probe>) -> f64 {
///     in_image.distance(&in_probe)
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<F> {
    vector: Vector3<f64>,
    system: PhantomData<fn() -> F>,
}

impl<F: Frame> Point<F> {
    /// The point at `x`, `y`, `z` metres.
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self::from_vector(Vector3::new(x, y, z))
    }

    /// The point at the tip of a vector from the origin (m).
    pub const fn from_vector(vector: Vector3<f64>) -> Self {
        Self { vector, system: PhantomData }
    }

    /// The bare vector from the origin (m).
    pub const fn vector(&self) -> Vector3<f64> {
        self.vector
    }

    /// Distance to another point of the same system (m).
    pub fn distance(&self, other: &Self) -> f64 {
        (self.vector - other.vector).norm()
    }

    /// The point moved by `metres` along `direction`.
    pub fn moved(&self, direction: Direction<F>, metres: f64) -> Self {
        Self::from_vector(self.vector + direction.vector() * metres)
    }
}

/// A unit vector, written in `F`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction<F> {
    vector: Vector3<f64>,
    system: PhantomData<fn() -> F>,
}

impl<F: Frame> Direction<F> {
    /// The direction of a vector of any length.
    ///
    /// # Errors
    /// When the vector is zero, tiny or not finite, and so has no direction.
    pub fn of(vector: Vector3<f64>) -> Result<Self, FrameError> {
        let length = vector.norm();
        if !length.is_finite() || length < 1e-12 {
            return Err(FrameError::NoDirection { what: F::NAME.into(), length });
        }
        Ok(Self::assume(vector / length))
    }

    /// A vector that is known to have unit length, as a rotation's columns have.
    pub(crate) const fn assume(vector: Vector3<f64>) -> Self {
        Self { vector, system: PhantomData }
    }

    /// The x axis of `F`.
    pub const fn x() -> Self {
        Self::assume(Vector3::new(1.0, 0.0, 0.0))
    }

    /// The y axis of `F`.
    pub const fn y() -> Self {
        Self::assume(Vector3::new(0.0, 1.0, 0.0))
    }

    /// The z axis of `F`.
    pub const fn z() -> Self {
        Self::assume(Vector3::new(0.0, 0.0, 1.0))
    }

    /// The bare unit vector.
    pub const fn vector(&self) -> Vector3<f64> {
        self.vector
    }

    /// The angle to another direction of the same system (rad, 0 to pi).
    pub fn angle(&self, other: &Self) -> f64 {
        self.vector.cross(&other.vector).norm().atan2(self.vector.dot(&other.vector))
    }

    /// The opposite direction.
    pub fn reversed(&self) -> Self {
        Self::assume(-self.vector)
    }
}
