//! Exact contours of bent vessels whose truth is known, for the tests here: what an image plane cuts out of a tube of
//! circular sections.

use nalgebra::{Unit, UnitQuaternion, Vector3};
use probepath_frames::Point;

use crate::phantom_images::Dice;
use crate::{Contour, ImageLumen};

/// Distance of the truth's samples (m).
const STEP_M: f64 = 0.05e-3;

/// A bent vessel. Lengths in m.
#[derive(Clone, Debug)]
pub struct BentVessel {
    /// Its length.
    pub length: f64,
    /// Radius where nothing is narrow.
    pub radius: f64,
    /// Place, length and area reduction (0 to 1) of each stenosis.
    pub stenoses: Vec<(f64, f64, f64)>,
    places: Vec<Vector3<f64>>,
    tangents: Vec<Vector3<f64>>,
}

/// How an image lies: where its middle is along the vessel, and its normal turned out of the vessel's direction.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Place along the vessel (m).
    pub at: f64,
    /// Tilt (rad).
    pub tilt: f64,
    /// Which way it is tilted (rad).
    pub way: f64,
    /// What the pose is off by (m).
    pub off: Vector3<f64>,
}

impl BentVessel {
    /// A vessel that turns by `turn` (rad) in all and winds a little besides.
    pub fn new(length: f64, radius: f64, turn: f64, dice: &mut Dice) -> Self {
        let (winding, pitch) = (0.15 * dice.uniform(), 0.15 * dice.uniform());
        let (one, other) = (6.3 * dice.uniform(), 6.3 * dice.uniform());
        let (wave, slow) = (0.05 + 0.05 * dice.uniform(), 0.06 + 0.06 * dice.uniform());
        let mut vessel =
            Self { length, radius, stenoses: Vec::new(), places: Vec::new(), tangents: Vec::new() };
        let mut place = Vector3::new(0.1 * dice.uniform(), 0.1 * dice.uniform(), 0.1 * dice.uniform());
        let tilted =
            UnitQuaternion::from_euler_angles(6.3 * dice.uniform(), dice.uniform(), 6.3 * dice.uniform());
        for i in 0..=(length / STEP_M).round() as usize {
            let s = i as f64 * STEP_M;
            let heading = turn * s / length + winding * (std::f64::consts::TAU * s / wave + one).sin();
            let lift = pitch * (std::f64::consts::TAU * s / slow + other).sin();
            let along = Vector3::new(heading.cos() * lift.cos(), heading.sin() * lift.cos(), lift.sin());
            let along = tilted * along;
            vessel.places.push(place);
            vessel.tangents.push(along);
            place += along * STEP_M;
        }
        vessel
    }

    /// A straight one, from a place in a direction.
    pub fn straight(length: f64, radius: f64, from: Vector3<f64>, way: Vector3<f64>) -> Self {
        let count = (length / STEP_M).round() as usize;
        let places = (0..=count).map(|i| from + way * (i as f64 * STEP_M)).collect();
        Self { length, radius, stenoses: Vec::new(), places, tangents: vec![way; count + 1] }
    }

    /// Where the axis is at a length.
    pub fn axis(&self, at: f64) -> Vector3<f64> {
        self.sample(at).0
    }

    fn sample(&self, at: f64) -> (Vector3<f64>, Vector3<f64>) {
        // Straight on beyond the ends.
        let i = (at / STEP_M).round().clamp(0.0, self.places.len() as f64 - 1.0) as usize;
        (self.places[i] + self.tangents[i] * (at - i as f64 * STEP_M), self.tangents[i])
    }

    /// True radius at a length.
    pub fn radius_at(&self, at: f64) -> f64 {
        let mut radius = self.radius;
        for &(middle, length, area) in &self.stenoses {
            if (at - middle).abs() <= length / 2.0 {
                let depth = self.radius * (1.0 - (1.0 - area).sqrt());
                radius -= depth * (1.0 + (std::f64::consts::TAU * (at - middle) / length).cos()) / 2.0;
            }
        }
        radius
    }

    /// Length and distance of a place, looked for near a length.
    pub fn seen_from(&self, place: &Vector3<f64>, near: f64) -> (f64, f64) {
        let mut at = near;
        for _ in 0..30 {
            let (axis, tangent) = self.sample(at);
            let step = (place - axis).dot(&tangent);
            at += 0.8 * step;
            if step.abs() < 1e-9 {
                break;
            }
        }
        (at, (place - self.sample(at).0).norm())
    }

    /// What a cut shows, in `points` points; `error` is added to each one's distance from the middle (m).
    pub fn contour(&self, cut: Cut, points: usize, mut error: impl FnMut(f64) -> f64) -> Contour {
        let (middle, tangent) = self.sample(cut.at);
        let any = if tangent.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let first = tangent.cross(&any).normalize();
        let axis = Unit::new_normalize(first * cut.way.cos() + tangent.cross(&first) * cut.way.sin());
        let turn = UnitQuaternion::from_axis_angle(&axis, cut.tilt);
        let (x, y) = (turn * first, turn * tangent.cross(&first));
        let places: Vec<(f64, f64)> = (0..points)
            .map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / points as f64;
                let r = self.border(&middle, &(x * angle.cos() + y * angle.sin()), cut.at) + error(angle);
                (r * angle.cos(), r * angle.sin())
            })
            .collect();
        let world = |(a, b): (f64, f64)| Point::from_vector(middle + x * a + y * b + cut.off);
        let (area, centre) = crate::lumen::area_and_centre(&places);
        Contour {
            pixels: places.clone(),
            centre_pixel: centre,
            world: places.iter().map(|&place| world(place)).collect(),
            centre: world(centre),
            area_mm2: area * 1e6,
            sd_mm: 0.03,
            points_sd_mm: vec![0.1; places.len()],
            common_sd_mm: 0.05,
            common_size_sd_mm: 0.05,
            vessel: 0,
            branches: false,
            wall_mm: 0.8,
            contrast_db: 20.0,
        }
    }

    /// How far the border is from a place inside in a direction.
    fn border(&self, from: &Vector3<f64>, way: &Vector3<f64>, near: f64) -> f64 {
        let (mut inside, mut outside) = (0.0, 12e-3);
        for _ in 0..32 {
            let middle = (inside + outside) / 2.0;
            let (at, distance) = self.seen_from(&(from + way * middle), near);
            if distance < self.radius_at(at) { inside = middle } else { outside = middle }
        }
        (inside + outside) / 2.0
    }
}

/// Contours as the images of a sweep, numbered in their order.
pub fn numbered(contours: impl IntoIterator<Item = Contour>) -> Vec<ImageLumen> {
    contours
        .into_iter()
        .zip(0..)
        .map(|(contour, number)| ImageLumen { number, lumen: Ok(contour), others: Vec::new() })
        .collect()
}

/// The numbers from 0 to `count` in an order of chance.
pub fn shuffled(count: usize, dice: &mut Dice) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, (dice.uniform() * (i + 1) as f64) as usize);
    }
    order
}
