//! From the wrench to the probe's twist: mass, damper, bounds.

use nalgebra::{Vector3, Vector6};
use probepath_frames::{Base, Pose, Probe, Wrench};
use probepath_robot::motion::timing::SpeedRamp;

use super::GuideError;

/// Part of the joints' limits that hand guiding uses; the loop's own limiter then never has to correct it.
pub(super) const SHARE: f64 = 0.95;
/// A redundant arm uses all of its freedom from this speed of the probe (m/s, rad/s) on.
const FREE_FROM: (f64, f64) = (0.01, 0.05);

/// How the arm gives way. Directions are the probe's x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GiveWay {
    /// Mass (kg) in each direction.
    pub mass_kg: [f64; 3],
    /// Damper (N s/m). Along z the skin answers too, with up to 3 N/mm, and a light damper would bounce on it.
    pub damping_n_s_m: [f64; 3],
    /// Moment of inertia (kg m^2) about each.
    pub inertia_kg_m2: [f64; 3],
    /// Damper (N m s/rad).
    pub damping_n_m_s: [f64; 3],
    /// Force that moves nothing (N): the sensor's noise and drift.
    pub dead_n: f64,
    /// Torque that moves nothing (N m).
    pub dead_n_m: f64,
    /// Largest speed (m/s) that is led; joints that lag one behind the other may add a third to it for a moment.
    pub speed_m_s: f64,
    /// Largest speed of turning (rad/s).
    pub turn_rad_s: f64,
    /// The smallest singular value of the probe's Jacobian that the arm is led to; from six times it on the joints slow
    /// down.
    pub least_singular: f64,
    /// How long nobody may hold the switch before it ends (s).
    pub wait_s: f64,
}

impl Default for GiveWay {
    fn default() -> Self {
        Self {
            mass_kg: [1.5, 1.5, 1.5],
            damping_n_s_m: [60.0, 60.0, 250.0],
            inertia_kg_m2: [0.03; 3],
            damping_n_m_s: [1.5; 3],
            dead_n: 0.3,
            dead_n_m: 0.03,
            speed_m_s: 0.085,
            turn_rad_s: 0.5,
            least_singular: 0.012,
            wait_s: 60.0,
        }
    }
}

impl GiveWay {
    pub(super) fn check(&self) -> Result<(), GuideError> {
        let lists = [
            ("mass_kg", self.mass_kg),
            ("damping_n_s_m", self.damping_n_s_m),
            ("inertia_kg_m2", self.inertia_kg_m2),
            ("damping_n_m_s", self.damping_n_m_s),
        ];
        let each = lists.iter().flat_map(|(name, list)| list.iter().map(move |value| (*name, *value)));
        let single = [
            ("dead_n", self.dead_n),
            ("dead_n_m", self.dead_n_m),
            ("speed_m_s", self.speed_m_s),
            ("turn_rad_s", self.turn_rad_s),
            ("least_singular", self.least_singular),
            ("wait_s", self.wait_s),
        ];
        match each.chain(single).find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            Some((name, value)) => Err(GuideError::Setting { name, value }),
            None => Ok(()),
        }
    }
}

/// The motion of the admittance's mass, in the probe's axes.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
    /// Its speeds, within bounds of acceleration and jerk: joints that reached their own bounds one by one would
    /// lead the probe astray.
    speeds: [SpeedRamp; 6],
    moving: [f64; 6],
    dt: f64,
}

/// Largest acceleration and jerk of the probe (m/s^2, m/s^3), and of its turning (rad/s^2, rad/s^3).
const LINEAR: (f64, f64) = (0.8, 8.0);
const ANGULAR: (f64, f64) = (2.0, 20.0);

impl Motion {
    pub(super) fn at_rest(dt: f64) -> Self {
        let (linear, angular) =
            (SpeedRamp::at_rest(LINEAR.0, LINEAR.1), SpeedRamp::at_rest(ANGULAR.0, ANGULAR.1));
        let speeds = [linear, linear, linear, angular, angular, angular];
        Self { linear: Vector3::zeros(), angular: Vector3::zeros(), speeds, moving: [0.0; 6], dt }
    }

    /// One tick of `mass * acceleration = force - damping * velocity`, solved for the tick's end, so that it is
    /// stable for any mass. A wrench that is not finite counts as none.
    pub(super) fn feel(&mut self, settings: &GiveWay, wrench: &Wrench<Probe>) {
        let dt = self.dt;
        let wrench = if wrench.is_finite() { *wrench } else { Wrench::zero() };
        let force = beyond(wrench.force, settings.dead_n);
        let torque = beyond(wrench.torque, settings.dead_n_m);
        let drive =
            |now: f64, push: f64, mass: f64, damping: f64| (mass * now + push * dt) / (mass + damping * dt);
        for i in 0..3 {
            let (m, d) = (settings.mass_kg[i], settings.damping_n_s_m[i]);
            self.linear[i] = drive(self.linear[i], force[i], m, d);
            let (m, d) = (settings.inertia_kg_m2[i], settings.damping_n_m_s[i]);
            self.angular[i] = drive(self.angular[i], torque[i], m, d);
        }
        self.linear = self.linear.cap_magnitude(settings.speed_m_s);
        self.angular = self.angular.cap_magnitude(settings.turn_rad_s);
        let wanted = self.linear.iter().chain(self.angular.iter());
        for ((moving, ramp), wanted) in self.moving.iter_mut().zip(&mut self.speeds).zip(wanted) {
            *moving = ramp.step(*wanted, dt);
        }
    }

    /// How the probe should move now: its twist in the base's axes (m/s, rad/s), and how much of its freedom a
    /// redundant arm may use meanwhile: none while the probe is to rest.
    pub(super) fn twist(
        &self,
        settings: &GiveWay,
        base_from_probe: &Pose<Base, Probe>,
    ) -> (Vector6<f64>, f64) {
        let moving = &self.moving;
        // Each direction keeps its bound by itself; together they keep it here.
        let linear = Vector3::new(moving[0], moving[1], moving[2]).cap_magnitude(settings.speed_m_s);
        let angular = Vector3::new(moving[3], moving[4], moving[5]).cap_magnitude(settings.turn_rad_s);
        let freedom = (linear.norm() / FREE_FROM.0).max(angular.norm() / FREE_FROM.1).min(1.0);
        let rotation = base_from_probe.isometry().rotation;
        let (linear, angular) = (rotation * linear, rotation * angular);
        (Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z), freedom)
    }
}

/// What is left of a vector outside a dead band.
fn beyond(vector: Vector3<f64>, dead: f64) -> Vector3<f64> {
    let length = vector.norm();
    if length <= dead { Vector3::zeros() } else { vector * (1.0 - dead / length) }
}
