//! What the controller makes of its force sensor: the payload's weight is taken off as it was told, not as it is.

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use probepath_frames::{Flange, Pose, Probe, Stamp, Wrench};
use probepath_robot::Joints;

use super::Kinematics;
use crate::arm::tool::GRAVITY_M_S2;
use crate::cell::{Nominal, Scene};

/// `zero_ftsensor` takes the mean of so many ticks.
const ZERO_OVER: usize = 50;

/// What the arm was told that it carries.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::controller) struct Payload {
    pub(in crate::controller) mass_kg: f64,
    /// On the flange (m).
    pub(in crate::controller) centre_m: Vector3<f64>,
}

impl Payload {
    /// Its weight on the flange, where `down` is gravity's direction in the flange's axes.
    fn weight(&self, down: &Vector3<f64>) -> Wrench<Flange> {
        let force = down * (self.mass_kg * GRAVITY_M_S2);
        Wrench::new(force, self.centre_m.cross(&force))
    }
}

/// The force sensor as the controller reads it.
#[derive(Clone, Debug)]
pub(in crate::controller) struct ForceReading {
    flange_from_probe: Pose<Flange, Probe>,
    /// Gravity's direction in Base.
    down: Vector3<f64>,
    since: Stamp,
    raw: Wrench<Flange>,
    recent: VecDeque<Wrench<Flange>>,
    zero: Wrench<Flange>,
    /// At the tool, in Base's axes.
    felt: Vector6<f64>,
    base_from_flange: UnitQuaternion<f64>,
    tcp: Vector3<f64>,
}

impl ForceReading {
    pub(super) fn new(nominal: &Nominal, since: Stamp) -> Self {
        let base_from_world = nominal.world_from_base.inverse();
        Self {
            flange_from_probe: nominal.flange_from_probe,
            down: base_from_world.isometry().rotation * Vector3::y(),
            since,
            raw: Wrench::zero(),
            recent: VecDeque::with_capacity(ZERO_OVER),
            zero: Wrench::zero(),
            felt: Vector6::zeros(),
            base_from_flange: UnitQuaternion::identity(),
            tcp: Vector3::zeros(),
        }
    }

    /// One tick: the sensor feels skin, hand and the tool's true weight.
    pub(super) fn measure(
        &mut self,
        scene: &mut Scene,
        arm: &Kinematics,
        joints: &Joints,
        payload: &Payload,
    ) {
        let elapsed = (scene.now() - self.since).seconds();
        let sensed = scene.sensed(elapsed) + scene.tool_weight();
        self.raw = self.flange_from_probe * sensed;
        self.base_from_flange = arm.flange(joints).rotation;
        self.tcp = arm.tcp.translation.vector;
        let left = self.raw - payload.weight(&(self.base_from_flange.inverse() * self.down));
        self.recent.truncate(ZERO_OVER - 1);
        self.recent.push_front(left);
        self.felt = self.at_tool(&(left - self.zero));
    }

    /// What was read before counts no more.
    pub(super) fn forget(&mut self) {
        self.recent.clear();
    }

    /// What it reads now is nothing from now on.
    pub(super) fn zero(&mut self) {
        let n = self.recent.len().max(1) as f64;
        let sum = self.recent.iter().fold(Wrench::zero(), |sum, w| sum + *w);
        self.zero = Wrench::new(sum.force / n, sum.torque / n);
    }

    /// Force and torque at the tool in Base's axes, the payload and the zero taken off: what the outside does to it.
    pub(in crate::controller) const fn felt(&self) -> Vector6<f64> {
        self.felt
    }

    /// `ft_raw_wrench`: as the sensor gives it, at the flange.
    pub(in crate::controller) fn raw(&self) -> [f64; 6] {
        let (f, t) = (self.raw.force, self.raw.torque);
        [f.x, f.y, f.z, t.x, t.y, t.z]
    }

    /// Gravity in the flange's axes (m/s²).
    pub(super) fn gravity(&self) -> Vector3<f64> {
        self.base_from_flange.inverse() * self.down * GRAVITY_M_S2
    }

    /// What truly pushes the arm away in freedrive: skin, hand, and the weight that the payload does not account for.
    pub(super) fn pushed(&self, scene: &Scene, payload: &Payload) -> Vector6<f64> {
        let truth = scene.last();
        let outside = truth.skin + truth.hand + scene.tool_weight();
        let down = self.base_from_flange.inverse() * self.down;
        self.at_tool(&(self.flange_from_probe * outside - payload.weight(&down)))
    }

    fn at_tool(&self, at_flange: &Wrench<Flange>) -> Vector6<f64> {
        let force = self.base_from_flange * at_flange.force;
        let torque = self.base_from_flange * (at_flange.torque - self.tcp.cross(&at_flange.force));
        Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
    }
}
