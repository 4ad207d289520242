//! Where the hand means to hold the probe: on the skin over the artery, square to both.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use probepath_frames::{Point, Pose, Probe, World};

use crate::skin::{Skin, Surface};
use crate::vessel::Vessel;

/// Distance of two neighbours (m).
const SPACING_M: f64 = 0.002;
/// A hand turns smoothly: directions are averaged over this many neighbours on either side.
const NEIGHBOURS: usize = 10;

/// Ideal probe poses along an artery, evenly spaced.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    poses: Vec<Pose<World, Probe>>,
}

impl Course {
    /// Over `vessel`, from its arc length `from_m` on for `length_m`.
    pub(crate) fn over(body: &dyn Surface, skin: &Skin, vessel: &Vessel, from_m: f64, length_m: f64) -> Self {
        let count = (length_m / SPACING_M).round().max(1.0) as usize + 1;
        let arc = |i: usize| from_m + SPACING_M * i as f64;
        let ups: Vec<_> = (0..count).map(|i| body.outward_over(vessel.centre(arc(i))).vector()).collect();
        let poses = (0..count)
            .map(|i| {
                let near = &ups[i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(count)];
                let up = near.iter().sum::<Vector3<f64>>().normalize();
                let origin = raise(body, skin, vessel.centre(arc(i)), up);
                square(origin, up, vessel.tangent(arc(i)).vector())
            })
            .collect();
        Self { poses }
    }

    /// Its length (m).
    pub(crate) fn length_m(&self) -> f64 {
        SPACING_M * (self.poses.len() - 1) as f64
    }

    /// The ideal probe `along_m` from the start; at an end beyond it.
    pub(crate) fn at(&self, along_m: f64) -> Pose<World, Probe> {
        let last = self.poses.len() - 1;
        let place = (along_m / SPACING_M).clamp(0.0, last as f64);
        let (i, fraction) = (place as usize, place.fract());
        self.poses[i].interpolate(&self.poses[(i + 1).min(last)], fraction)
    }
}

/// The bumpy skin's point from `inside` toward `up`.
fn raise(body: &dyn Surface, skin: &Skin, inside: Point<World>, up: Vector3<f64>) -> Point<World> {
    let mut at = inside.vector();
    for _ in 0..30 {
        let (distance, _) = skin.distance(body, Point::from_vector(at));
        at -= up * (0.8 * distance);
    }
    Point::from_vector(at)
}

/// A probe at `origin` that looks down along `-up`, its array across the vessel, its elevation along the blood.
fn square(origin: Point<World>, up: Vector3<f64>, blood: Vector3<f64>) -> Pose<World, Probe> {
    let z = -up;
    let x = blood.cross(&z).normalize();
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    let turn = UnitQuaternion::from_rotation_matrix(&rotation);
    // FRAMES: columns are Probe's axes written in World: x across, y = z × x along the blood, z into the tissue.
    Pose::assume(Isometry3::from_parts(origin.vector().into(), turn))
}
