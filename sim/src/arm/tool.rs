//! What the arm carries: the probe and its holder, which weigh something.

use nalgebra::Vector3;
use probepath_frames::{Flange, Point, Pose, Probe, World, Wrench};
use serde::{Deserialize, Serialize};

/// Standard gravity (m/s²).
pub(crate) const GRAVITY_M_S2: f64 = 9.806_65;

/// The probe with its holder, as it truly is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ToolConfig {
    /// Its mass (kg).
    pub mass_kg: f64,
    /// Where its centre of gravity is on the flange: x, y, z (mm).
    pub centre_of_gravity_mm: [f64; 3],
}

impl Default for ToolConfig {
    /// Our assumption: a linear probe of 0.25 kg in an aluminium holder of 0.6 kg.
    fn default() -> Self {
        Self { mass_kg: 0.85, centre_of_gravity_mm: [6.0, 0.0, 70.0] }
    }
}

impl ToolConfig {
    /// The centre of gravity in `Flange`.
    pub(crate) fn centre(&self) -> Point<Flange> {
        Point::from_vector(Vector3::from(self.centre_of_gravity_mm) * 1e-3)
    }

    /// Its weight on the probe at `world_from_probe`. World's y points down.
    pub(crate) fn weight(
        &self,
        world_from_probe: &Pose<World, Probe>,
        flange_from_probe: &Pose<Flange, Probe>,
    ) -> Wrench<Probe> {
        let down = world_from_probe.isometry().rotation.inverse() * Vector3::y();
        let at = (flange_from_probe.inverse() * self.centre()).vector();
        let force = down * (self.mass_kg * GRAVITY_M_S2);
        Wrench::new(force, at.cross(&force))
    }
}
