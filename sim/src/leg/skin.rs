//! The skin: ellipses across, smooth along.

use nalgebra::Vector3;
use probepath_frames::{Direction, Point, World};

use super::{Chance, Side};
use crate::spline::Profile;

/// z of the lowest cross-section given, and the distance between two (m).
const LOWEST_Z_M: f64 = -0.54;
const SECTION_SPACING_M: f64 = 0.09;

/// Half width, half height and the axis' distance from the midline (m), from the calf up to the belly.
const SECTIONS: [[f64; 3]; 8] = [
    [0.055, 0.056, 0.098],
    [0.058, 0.060, 0.100],
    [0.065, 0.066, 0.104],
    [0.074, 0.074, 0.108],
    [0.083, 0.081, 0.109],
    [0.091, 0.086, 0.105],
    [0.097, 0.089, 0.100],
    [0.100, 0.090, 0.098],
];

/// How far the nearest point's search may be off (m).
const NEAREST_WITHIN_M: f64 = 1e-9;

/// Elliptical sections with axes along x and y, resting on the table's top at y = 0.
#[derive(Clone, Debug)]
pub(super) struct Skin {
    sign: f64,
    sections: Profile,
}

/// One section: half axes, middle, and how they change with z.
struct Section {
    half: [f64; 2],
    middle: [f64; 2],
    half_slope: [f64; 2],
    middle_slope: [f64; 2],
}

impl Skin {
    pub(super) fn new(side: Side, chance: &mut Chance) -> Self {
        let girth = 1.0 + chance.within(0.04);
        let sections = SECTIONS.map(|[width, height, aside]| {
            let swell = girth * (1.0 + chance.within(0.008));
            Vector3::new(width * swell, height * swell, aside + chance.within(0.002))
        });
        Self { sign: side.sign(), sections: Profile::new(LOWEST_Z_M, SECTION_SPACING_M, &sections) }
    }

    fn section(&self, z: f64) -> Section {
        let (value, slope) = self.sections.at(z);
        Section {
            half: [value.x, value.y],
            // It lies on the table: the middle is as high as the section's half height.
            middle: [self.sign * value.z, -value.y],
            half_slope: [slope.x, slope.y],
            middle_slope: [self.sign * slope.z, -slope.y],
        }
    }

    /// How far outside, as a fraction of the section (zero on the skin), and its gradient in the World.
    fn level(&self, p: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let section = self.section(p.z);
        let mut gradient = Vector3::zeros();
        let mut along = 0.0;
        let mut scaled = [0.0; 2];
        for i in 0..2 {
            scaled[i] = (p[i] - section.middle[i]) / section.half[i];
        }
        let radius = scaled[0].hypot(scaled[1]).max(1e-9);
        for i in 0..2 {
            gradient[i] = scaled[i] / (radius * section.half[i]);
            along -= gradient[i] * (section.middle_slope[i] + scaled[i] * section.half_slope[i]);
        }
        gradient.z = along;
        (radius - 1.0, gradient)
    }

    pub(super) fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        let p = point.vector();
        let mut foot = self.drop_to_skin(p);
        // The foot slides along the skin until the way to `p` is along the normal; each round shrinks the miss by
        // about distance times curvature.
        for _ in 0..60 {
            let normal = self.level(&foot).1.normalize();
            let off = p - foot;
            let aside = off - normal * off.dot(&normal);
            if aside.norm() < NEAREST_WITHIN_M {
                break;
            }
            // Inside a convex section the nearest point runs ahead of the slide: half a step keeps it from
            // overshooting, however deep.
            foot = self.drop_to_skin(foot + aside * 0.7);
        }
        let normal = self.level(&foot).1.normalize();
        ((p - foot).dot(&normal), direction(normal))
    }

    /// Onto the skin, along the gradient.
    fn drop_to_skin(&self, mut p: Vector3<f64>) -> Vector3<f64> {
        for _ in 0..12 {
            let (level, gradient) = self.level(&p);
            let step = gradient * (level / gradient.norm_squared());
            p -= step;
            if step.norm() < 1e-12 {
                break;
            }
        }
        p
    }

    pub(super) fn at(&self, z: f64, medial_rad: f64) -> (Point<World>, Direction<World>) {
        let section = self.section(z);
        let (sin, cos) = medial_rad.sin_cos();
        let ray = [-self.sign * sin, -cos];
        let reach = 1.0 / (ray[0] / section.half[0]).hypot(ray[1] / section.half[1]);
        let p = Vector3::new(section.middle[0] + ray[0] * reach, section.middle[1] + ray[1] * reach, z);
        (Point::from_vector(p), direction(self.level(&p).1))
    }
}

/// A gradient of the level is never zero: it grows outward everywhere but on the leg's very axis.
fn direction(gradient: Vector3<f64>) -> Direction<World> {
    Direction::of(gradient).unwrap_or(Direction::y().reversed())
}
