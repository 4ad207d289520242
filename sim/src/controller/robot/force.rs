//! `force_mode` and freedrive: some of the tool's axes follow a force instead of the motion.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

use crate::arm::give_way::GiveWay;
use crate::controller::pose::rotated;

/// Viscosity of a compliant axis at a gain scaling of 1 (N s/m, N m s/rad). With the script's scaling of 0.5 it is
/// twice as much, which keeps skin of 0.3 to 3 N/mm steady behind the servo's lag. Our assumption: no source gives it.
const VISCOSITY: [f64; 2] = [100.0, 1.0];
/// How quickly a compliant axis takes its speed (s).
const QUICK_S: f64 = 0.02;

/// What the tool's axes give way to.
#[derive(Clone, Debug)]
pub(in crate::controller) enum Overlay {
    /// `force_mode`.
    Force(ForceMode),
    /// `teach_mode` and `freedrive_mode`.
    Freedrive(Freedrive),
}

/// `force_mode(frame, selection, wrench, type, limits)`. The frame is in Base.
#[derive(Clone, Debug)]
pub(in crate::controller) struct ForceMode {
    pub(in crate::controller) frame: Isometry3<f64>,
    pub(in crate::controller) selection: [bool; 6],
    pub(in crate::controller) wrench: Vector6<f64>,
    pub(in crate::controller) kind: i32,
    pub(in crate::controller) limits: Vector6<f64>,
    velocity: Vector6<f64>,
}

/// Freedrive, of which axes, in which orientation (Base).
#[derive(Clone, Debug)]
pub(in crate::controller) struct Freedrive {
    pub(in crate::controller) axes: UnitQuaternion<f64>,
    pub(in crate::controller) free: [bool; 6],
    pub(in crate::controller) way: GiveWay,
}

impl ForceMode {
    pub(in crate::controller) fn new(
        frame: Isometry3<f64>,
        selection: [bool; 6],
        wrench: Vector6<f64>,
        kind: i32,
        limits: Vector6<f64>,
    ) -> Self {
        Self { frame, selection, wrench, kind, limits, velocity: Vector6::zeros() }
    }

    /// The same frame and axes with new numbers; what moves goes on moving.
    pub(in crate::controller) fn renewed(self, before: Option<&Overlay>) -> Self {
        match before {
            Some(Overlay::Force(old)) => Self { velocity: old.velocity, ..self },
            _ => self,
        }
    }

    /// The task's axes in Base: as given; for type 1 with y toward the frame's origin from the tool, for type 3 with x
    /// along the tool's way.
    fn axes(&self, tool: &Vector3<f64>, velocity: &Vector3<f64>) -> UnitQuaternion<f64> {
        let given = self.frame.rotation;
        let z = given * Vector3::z();
        let flat = |v: Vector3<f64>| v - z * v.dot(&z);
        match self.kind {
            1 => {
                let toward = self.frame.translation.vector - tool;
                if toward.norm() < 1e-6 {
                    return given;
                }
                let y = toward.normalize();
                UnitQuaternion::rotation_between(&(given * Vector3::y()), &y)
                    .map_or(given, |turn| turn * given)
            }
            3 if flat(*velocity).norm() > 1e-4 => {
                let x = flat(*velocity).normalize();
                UnitQuaternion::rotation_between(&(given * Vector3::x()), &x)
                    .map_or(given, |turn| turn * given)
            }
            _ => given,
        }
    }

    /// The velocity that `nominal` becomes (Base's axes at the tool) while the outside pushes with `felt`.
    pub(super) fn step(
        &mut self,
        nominal: &Vector6<f64>,
        felt: &Vector6<f64>,
        tool: &Vector3<f64>,
        gain: f64,
        damping: f64,
        dt: f64,
    ) -> Vector6<f64> {
        let axes = self.axes(tool, &nominal.fixed_rows::<3>(0).into_owned());
        let mut speed = rotated(&axes.inverse(), nominal);
        let push = rotated(&axes.inverse(), felt);
        for axis in 0..6 {
            if !self.selection[axis] {
                self.velocity[axis] = 0.0;
                continue;
            }
            let viscosity = VISCOSITY[axis / 3] / gain * (1.0 + 10.0 * damping);
            let wished = (self.wrench[axis] + push[axis]) / viscosity;
            let next = self.velocity[axis] + (wished - self.velocity[axis]) * (dt / QUICK_S).min(1.0);
            let limit = self.limits[axis].abs();
            self.velocity[axis] = if next.is_finite() { next.clamp(-limit, limit) } else { 0.0 };
            speed[axis] = self.velocity[axis];
        }
        rotated(&axes, &speed)
    }
}

impl Freedrive {
    pub(super) fn step(&mut self, felt: &Vector6<f64>, dt: f64) -> Vector6<f64> {
        let (axes, free) = (self.axes, self.free);
        self.way.step(
            felt,
            |velocity| {
                let mut own = rotated(&axes.inverse(), &velocity);
                own.iter_mut().zip(free).filter(|(_, free)| !free).for_each(|(v, _)| *v = 0.0);
                rotated(&axes, &own)
            },
            dt,
        )
    }
}
