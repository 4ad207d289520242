//! The seed, from image to image: where the vessel seen so far runs through the next plane.

use nalgebra::Vector3;
use probepath_frames::Point;
use probepath_us_capture::PlacedBScan;

use super::region::{Region, grow};
use super::shadow::Shadows;
use super::{NoLumen, seed};
use crate::LumenSettings;
use crate::patch::{Patch, PowerOfGrey};

/// Half the window the front may fill, over the largest radius.
const WINDOW: f64 = 1.4;
/// The cells that a front runs through (m).
const CELL_M: f64 = 0.2e-3;
/// The direction of the vessel is taken over this length (m).
const MEMORY_M: f64 = 6e-3;
/// A vessel not seen for longer than this is looked for anew (m).
const LOST_M: f64 = 6e-3;
/// A picture whose brighter half is darker than this shows no tissue (dB).
const DARK_DB: f64 = -45.0;

/// The region of every image, in order.
pub(crate) fn follow(
    images: &[PlacedBScan],
    table: &PowerOfGrey,
    settings: &LumenSettings,
) -> Vec<Result<Region, NoLumen>> {
    let mut trail: Vec<Vector3<f64>> = Vec::new();
    let mut regions = Vec::with_capacity(images.len());
    for (index, image) in images.iter().enumerate() {
        let given = settings.seed.filter(|_| index == 0).map(|seed| seed.place(image));
        let region = region(image, table, settings, &trail, given);
        if let Ok(region) = &region {
            let centre = image.world_from_image * Point::new(region.centre.0, region.centre.1, 0.0);
            trail.push(centre.vector());
        }
        regions.push(region);
    }
    regions
}

/// The region of an image, where the trail leads or a seed is given.
pub(crate) fn region(
    image: &PlacedBScan,
    table: &PowerOfGrey,
    settings: &LumenSettings,
    trail: &[Vector3<f64>],
    given: Option<(f64, f64)>,
) -> Result<Region, NoLumen> {
    let mean_db = brighter_half_db(image, table);
    if mean_db < DARK_DB {
        return Err(NoLumen::Dark { mean_db });
    }
    if let Some(place) = given {
        return grown(image, table, settings, place);
    }
    let look = |near: Option<((f64, f64), f64)>| {
        let allowed = |at: (f64, f64)| {
            near.is_none_or(|(place, reach)| (at.0 - place.0).hypot(at.1 - place.1) <= reach)
        };
        let within = near.map_or(seed::everywhere(&image.bscan), |((x, y), reach)| {
            [(x - reach, y - reach), (x + reach, y + reach)]
        });
        seed::find(&image.bscan, table, settings, within, allowed)
    };
    let Some(place) = predicted(image, trail) else {
        return grown(image, table, settings, look(None)?);
    };
    let lost = far_from_trail(image, trail, place);
    let first = if lost { Err(NoLumen::Unsettled) } else { grown(image, table, settings, place) };
    let farthest = if lost { 8e-3 } else { 3e-3 };
    first.or_else(|why| {
        // Not where it was expected: the roundest dark thing near there.
        let near = look(Some((place, farthest))).map_err(|nothing| if lost { nothing } else { why });
        // What was followed last may have been nothing at all: a vessel long lost may be anywhere.
        let found = if lost { near.or_else(|_| look(None)) } else { near }?;
        grown(image, table, settings, found)
    })
}

/// The region round a seed.
pub(crate) fn grown(
    image: &PlacedBScan,
    table: &PowerOfGrey,
    settings: &LumenSettings,
    place: (f64, f64),
) -> Result<Region, NoLumen> {
    let half = WINDOW * settings.radius_range_m.1;
    let outside = NoLumen::OutsidePicture { x_mm: place.0 * 1e3, y_mm: place.1 * 1e3 };
    let patch = Patch::around(&image.bscan, table, place, (half, half), (CELL_M, CELL_M)).ok_or(outside)?;
    let spread = &settings.point_spread;
    let lateral = spread.lateral_m(image.bscan.setting.window_top_m + place.1, &image.bscan.setting);
    let shadows = Shadows::below(&image.bscan, table, place.1, lateral);
    let region = grow(patch, shadows, place, (lateral, spread.axial_fwhm_m))?;
    let by = (region.centre.0 - place.0).hypot(region.centre.1 - place.1);
    if by > 0.6 * settings.radius_range_m.1 { Err(NoLumen::Jump { by_mm: by * 1e3 }) } else { Ok(region) }
}

/// Mean power of the brighter half of the picture (dB), from one pixel in 49.
fn brighter_half_db(image: &PlacedBScan, table: &PowerOfGrey) -> f64 {
    let bscan = &image.bscan;
    let mut counts = [0_u32; 256];
    let rows = bscan.pixels().chunks_exact(bscan.width()).step_by(7);
    rows.flat_map(|row| row.iter().step_by(7)).for_each(|&grey| counts[usize::from(grey)] += 1);
    let half = counts.iter().sum::<u32>().div_ceil(2);
    let (mut left, mut power) = (half, 0.0);
    for (grey, count) in (0..=u8::MAX).zip(counts).rev() {
        let taken = count.min(left);
        power += f64::from(taken) * table.of(grey);
        left -= taken;
    }
    10.0 * (power / f64::from(half.max(1))).max(1e-9).log10()
}

/// Where the vessel runs through the image's plane (m, in the image).
pub(crate) fn predicted(image: &PlacedBScan, trail: &[Vector3<f64>]) -> Option<(f64, f64)> {
    let last = trail.last()?;
    let image_from_world = image.world_from_image.inverse();
    let here = (image_from_world * Point::from_vector(*last)).vector();
    let before = trail.iter().rev().find(|place| (*place - last).norm() > MEMORY_M);
    let along = before.map(|before| image_from_world.isometry().rotation * (last - before).normalize());
    match along {
        // A vessel nearly in the plane says little about where it goes through.
        Some(along) if along.z.abs() > 0.4 => {
            let steps = (-here.z / along.z).clamp(-LOST_M, LOST_M);
            // Arteries and sweeps are within some 25 degrees of each other; more is a trail that went astray.
            let aside = |by: f64| (by * steps).clamp(-0.5 * steps.abs(), 0.5 * steps.abs());
            Some((here.x + aside(along.x), here.y + aside(along.y)))
        }
        _ => Some((here.x, here.y)),
    }
}

/// Whether the last place with a lumen is too far from the plane to say where it is.
pub(crate) fn far_from_trail(image: &PlacedBScan, trail: &[Vector3<f64>], (x, y): (f64, f64)) -> bool {
    let here = image.world_from_image * Point::new(x, y, 0.0);
    trail.last().is_some_and(|last| (here.vector() - last).norm() > LOST_M)
}
