//! Twists and wrenches: how a body moves, and what pushes it.

use std::marker::PhantomData;

use nalgebra::Vector3;

use crate::Frame;

/// A body's velocity, written in `F`'s axes at `F`'s origin.
///
/// ```
/// # use probepath_frames::*;
/// fn seen(base_from_probe: Pose<Base, Probe>, in_probe: Twist<Probe>) -> Twist<Base> {
///     base_from_probe * in_probe
/// }
/// ```
///
/// One that is written elsewhere does not fit:
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn seen(base_from_probe: Pose<Base, Probe>, in_flange: Twist<Flange>) -> Twist<Base> {
///     base_from_probe * in_flange
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist<F> {
    /// Velocity of the body's point that is at `F`'s origin (m/s).
    pub linear: Vector3<f64>,
    /// Angular velocity (rad/s).
    pub angular: Vector3<f64>,
    system: PhantomData<fn() -> F>,
}

/// What the outside does to the body, written in `F`'s axes about `F`'s origin. Skin that presses on the probe is a
/// negative force along the probe's z.
///
/// ```
/// # use probepath_frames::*;
/// fn felt(base_from_probe: Pose<Base, Probe>, in_probe: Wrench<Probe>) -> Wrench<Base> {
///     base_from_probe * (in_probe + in_probe)
/// }
/// ```
///
/// One that is written elsewhere neither fits nor adds, and a wrench is no twist:
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn felt(base_from_probe: Pose<Base, Probe>, in_flange: Wrench<Flange>) -> Wrench<Base> {
///     base_from_probe * in_flange
/// }
/// ```
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn both(in_probe: Wrench<Probe>, in_flange: Wrench<Flange>) -> Wrench<Probe> {
///     in_probe + in_flange
/// }
/// ```
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn mixed(base_from_probe: Pose<Base, Probe>, in_probe: Wrench<Probe>) -> Twist<Base> {
///     base_from_probe * in_probe
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<F> {
    /// Force (N).
    pub force: Vector3<f64>,
    /// Torque about `F`'s origin (N m).
    pub torque: Vector3<f64>,
    system: PhantomData<fn() -> F>,
}

impl<F: Frame> Twist<F> {
    /// The motion with the given linear (m/s) and angular (rad/s) velocities.
    pub const fn new(linear: Vector3<f64>, angular: Vector3<f64>) -> Self {
        Self { linear, angular, system: PhantomData }
    }

    /// Rest.
    pub fn zero() -> Self {
        Self::new(Vector3::zeros(), Vector3::zeros())
    }
}

impl<F: Frame> Wrench<F> {
    /// The given force (N) and torque (N m).
    pub const fn new(force: Vector3<f64>, torque: Vector3<f64>) -> Self {
        Self { force, torque, system: PhantomData }
    }

    /// Nothing pushes.
    pub fn zero() -> Self {
        Self::new(Vector3::zeros(), Vector3::zeros())
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.force.iter().chain(self.torque.iter()).all(|x| x.is_finite())
    }
}

impl<F: Frame> std::ops::Add for Wrench<F> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::new(self.force + other.force, self.torque + other.torque)
    }
}

impl<F: Frame> std::ops::Sub for Wrench<F> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::new(self.force - other.force, self.torque - other.torque)
    }
}
