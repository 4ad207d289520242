//! What the beam's thickness takes in. Across the plane the beam is 3 to 4 mm thick ([P1] II.B): where the vessel
//! narrows or runs obliquely, the picture is the mean of neighbouring sections, and its wall is smeared inward. How
//! the sections differ is read from the neighbouring images.

use nalgebra::{Matrix3, Vector3};
use probepath_frames::Point;
use probepath_us_capture::PlacedBScan;
use rayon::prelude::*;

use super::NoLumen;
use super::fit::{Border, Plane};
use super::region::{RAYS, angle};
use crate::PointSpread;
use crate::settings::FWHM;

/// Standard deviation of the weights of the neighbours (m), and how far they reach.
const NEAR_M: f64 = 1.8e-3;
const REACH_M: f64 = 4.5e-3;
/// Planes, and how far apart they are in standard deviations.
const PLANES: i32 = 4;
const STEP: f64 = 0.6;
/// Images that are looked at on either side: an arm that stands still makes very many of one place.
const MOST_NEAR: usize = 200;

/// Where a border lies: the centre in the World, and the radius of the circle of its mean square (m).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section {
    pub(crate) centre: Vector3<f64>,
    pub(crate) radius: f64,
}

impl Section {
    pub(crate) fn of(image: &PlacedBScan, border: &Border) -> Self {
        let (_, (x, y)) = super::area_and_centre(&border.contour());
        let square = (0..RAYS).map(|ray| border.radius(angle(ray)).powi(2)).sum::<f64>() / RAYS as f64;
        let centre = image.world_from_image * Point::new(x, y, 0.0);
        Self { centre: centre.vector(), radius: square.sqrt() }
    }
}

/// The planes of every image's beam, as the images that are `asked` say together how the vessel runs.
pub(crate) fn planes(
    images: &[PlacedBScan],
    borders: &[Result<Border, NoLumen>],
    spread: &PointSpread,
    asked: impl Fn(usize) -> bool,
) -> Vec<Vec<Plane>> {
    let section = |(image, border): (&PlacedBScan, &Result<Border, NoLumen>)| {
        border.as_ref().ok().map(|border| Section::of(image, border))
    };
    let own: Vec<Option<Section>> = images.par_iter().zip(borders).map(section).collect();
    let told = own.iter().enumerate().map(|(index, section)| section.filter(|_| asked(index)));
    let told: Vec<Option<Section>> = told.collect();
    let each = images.par_iter().zip(&own).enumerate();
    each.map(|(index, (image, own))| of_index(index, image, own.as_ref(), &told, spread)).collect()
}

fn of_index(
    index: usize,
    image: &PlacedBScan,
    own: Option<&Section>,
    sections: &[Option<Section>],
    spread: &PointSpread,
) -> Vec<Plane> {
    let Some(own) = own else { return Plane::ITSELF.to_vec() };
    // A sweep goes on: beyond the first section that is far away, none is near.
    let image_from_world = image.world_from_image.inverse();
    let near = |section: &&Section| {
        let offset = (image_from_world * Point::from_vector(section.centre)).vector();
        offset.z.abs() < 1.5 * REACH_M
    };
    let (before, after) = sections.split_at(index);
    let before = before.iter().rev().flatten().take(MOST_NEAR).take_while(near);
    let after = after.iter().flatten().take(MOST_NEAR).take_while(near);
    of_image(image, own, before.chain(after), spread)
}

/// The planes of the beam of an image whose own section is known, or at least expected.
pub(crate) fn of_image<'a>(
    image: &PlacedBScan,
    own: &Section,
    others: impl Iterator<Item = &'a Section>,
    spread: &PointSpread,
) -> Vec<Plane> {
    let image_from_world = image.world_from_image.inverse();
    let here = (image_from_world * Point::from_vector(own.centre)).vector();
    let near = others.filter_map(|other| {
        let offset = (image_from_world * Point::from_vector(other.centre)).vector() - here;
        let close = offset.z.abs() < REACH_M && offset.norm() < 2.0 * REACH_M;
        close.then(|| (offset.z, Vector3::new(offset.x, offset.y, other.radius)))
    });
    let Some([slope, curve]) = local_quadratic(near) else { return Plane::ITSELF.to_vec() };
    let depth = image.bscan.setting.window_top_m + here.y;
    // Amplitudes add up across the beam, so its squared profile weighs the power.
    let sigma = spread.elevational_m(depth) / FWHM / 2_f64.sqrt();
    let weigh = |k: i32| (-0.5 * (STEP * f64::from(k)).powi(2)).exp();
    let sum: f64 = (-PLANES..=PLANES).map(weigh).sum();
    (-PLANES..=PLANES)
        .map(|k| {
            let off = STEP * f64::from(k) * sigma;
            let change = slope * off + curve * (off * off / 2.0);
            let wider = change.z.max(-0.8 * own.radius);
            Plane { weight: weigh(k) / sum, shift: (change.x, change.y), wider }
        })
        .collect()
}

/// First and second derivative at zero of what is `(place, value)`, by weighted least squares; nothing when the
/// places are too few or too close to say. From one side only, the slope: a bend would be guessed.
fn local_quadratic(values: impl Iterator<Item = (f64, Vector3<f64>)>) -> Option<[Vector3<f64>; 2]> {
    let mut matrix = Matrix3::zeros();
    let mut right = Matrix3::zeros();
    let (mut below, mut above, mut count) = (0.0_f64, 0.0_f64, 0);
    for (z, value) in values {
        let weight = (-0.5 * (z / NEAR_M).powi(2)).exp();
        let row = Vector3::new(1.0, z / NEAR_M, (z / NEAR_M).powi(2) / 2.0);
        matrix += row * row.transpose() * weight;
        right += row * value.transpose() * weight;
        (below, above, count) = (below.min(z), above.max(z), count + 1);
    }
    if count < 4 || above - below < NEAR_M {
        return None;
    }
    let both_sides = below < -0.5 * NEAR_M && above > 0.5 * NEAR_M;
    // A little stiffness, so that two clusters of images do not make a bend.
    matrix[(2, 2)] += matrix[(0, 0)] * if both_sides { 0.05 } else { 100.0 };
    let solved = matrix.cholesky()?.solve(&right);
    Some([solved.row(1).transpose() / NEAR_M, solved.row(2).transpose() / (NEAR_M * NEAR_M)])
}
