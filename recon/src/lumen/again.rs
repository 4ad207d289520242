//! A second look at images that were refused: the lumens that were accepted on either side say where to look.
//!
//! The first time through, the trail is laid by fronts whose wall nobody has looked at yet; in a tight stenosis it may
//! go astray into the speckle, and at the beginning of a sweep nothing is known. Here only lumens that show their wall
//! lead on, forward and backward along the sweep.

use nalgebra::Vector3;
use probepath_frames::Point;
use probepath_us_capture::PlacedBScan;

use super::fit::Border;
use super::region::{RAYS, Region, angle};
use super::shadow::Shadows;
use super::{Look, NoLumen, astray, track};
use crate::settings::FWHM;

/// Lumens farther apart than this say little about what lies between (m).
pub(super) const BETWEEN_M: f64 = 16e-3;
/// A lumen whose centre lies farther than this from where it was expected is another one (m).
pub(super) const ASIDE_M: f64 = 2.5e-3;
/// A lumen that was carried on may contradict another one, which then leaves its place to what is carried on: so often.
const ROUNDS: usize = 4;
/// A disc this near to one that brought nothing brings nothing (m).
const SAME_M: f64 = 0.3e-3;
/// A border whose centre is off its region's by this part of its radius is fitted once more.
const OFF_CENTRE: f64 = 0.3;

/// Where a lumen is expected in an image: x, y, radius (m).
type Disc = Vector3<f64>;

/// What each image gave so far.
pub(super) type Borders = [Result<Border, NoLumen>];

/// Looks again at images that were refused, where others have the lumen. What is found there has to show its wall as
/// any other.
pub(super) fn second_look(
    images: &[PlacedBScan],
    look: &Look<'_>,
    regions: &mut [Result<Region, NoLumen>],
    borders: &mut Borders,
) {
    for ((image, border), region) in images.iter().zip(borders.iter_mut()).zip(regions.iter_mut()) {
        let (Ok(fitted), Ok(grown)) = (border.as_ref(), region.as_ref()) else { continue };
        if let Err(why) = look.accepted(image, fitted, grown) {
            *border = Err(why);
        } else if let Some((disc, fitted)) = centred(image, look, grown, fitted) {
            (*region, *border) = (Ok(disc), Ok(fitted));
        }
    }
    astray::refuse(images, borders);
    let mut tried = vec![None; images.len()];
    for _ in 0..ROUNDS {
        fill_between(images, look, regions, borders);
        carry_on(0..images.len(), images, look, regions, borders, &mut tried);
        carry_on((0..images.len()).rev(), images, look, regions, borders, &mut tried);
        if !astray::refuse(images, borders) {
            break;
        }
    }
}

/// Whether another look may bring something.
fn open(region: &Result<Region, NoLumen>, border: &Result<Border, NoLumen>) -> bool {
    border.is_err() && !matches!(region, Err(NoLumen::Dark { .. }))
}

/// Tries what the accepted lumens on both sides let expect.
fn fill_between(
    images: &[PlacedBScan],
    look: &Look<'_>,
    regions: &mut [Result<Region, NoLumen>],
    borders: &mut Borders,
) {
    let expected = between(images, borders, look);
    for (((image, border), region), disc) in images.iter().zip(borders).zip(regions).zip(expected) {
        let Some(disc) = disc.filter(|_| open(region, border)) else { continue };
        if let Some(fitted) = look.walled(image, &disc) {
            (*border, *region) = (Ok(fitted), Ok(disc));
        }
    }
}

/// Goes through the images in an order and carries the lumen on from accepted ones to refused ones.
fn carry_on(
    order: impl Iterator<Item = usize>,
    images: &[PlacedBScan],
    look: &Look<'_>,
    regions: &mut [Result<Region, NoLumen>],
    borders: &mut Borders,
    tried: &mut [Option<Disc>],
) {
    let (mut trail, mut radius) = (Vec::new(), 0.0);
    for index in order {
        let (image, region, border) = (&images[index], &mut regions[index], &mut borders[index]);
        if open(region, border)
            && let Some((x, y)) = track::predicted(image, &trail)
        {
            let disc = Vector3::new(x, y, radius);
            let anew = tried[index].is_none_or(|before| (before - disc).norm() > SAME_M);
            tried[index] = Some(disc);
            if let Some((grown, fitted)) = anew.then(|| carried(image, look, &trail, disc)).flatten() {
                (*region, *border) = (Ok(grown), Ok(fitted));
            }
        }
        if let Ok(border) = border {
            let (centre, own) = seen(image, border);
            radius = own;
            trail.push(centre);
        }
    }
}

/// The lumen where the trail leads: as a front finds it, or else as a disc of the size it had. Where the trail ended long
/// before, it is looked for anew.
fn carried(
    image: &PlacedBScan,
    look: &Look<'_>,
    trail: &[Vector3<f64>],
    disc: Disc,
) -> Option<(Region, Border)> {
    let (place, radius) = ((disc.x, disc.y), disc.z);
    if track::far_from_trail(image, trail, place) {
        let region = track::region(image, look.table, look.settings, trail, None).ok()?;
        return walled(image, look, region);
    }
    let grown = track::grown(image, look.table, look.settings, place).ok();
    let disc = self::disc(image, look, place, radius);
    grown.into_iter().chain([disc]).find_map(|region| {
        let (region, border) = walled(image, look, region)?;
        let (_, centre) = super::area_and_centre(&border.contour());
        let aside = (centre.0 - place.0).hypot(centre.1 - place.1);
        (aside < ASIDE_M).then_some((region, border))
    })
}

/// The wall round a region.
fn walled(image: &PlacedBScan, look: &Look<'_>, region: Region) -> Option<(Region, Border)> {
    let border = look.walled(image, &region)?;
    Some(centred(image, look, &region, &border).unwrap_or((region, border)))
}

/// Harmonics are about the region's centre: where that is not the lumen's, the wall is fitted once more, about the
/// lumen's.
fn centred(
    image: &PlacedBScan,
    look: &Look<'_>,
    region: &Region,
    border: &Border,
) -> Option<(Region, Border)> {
    let (area, (x, y)) = super::area_and_centre(&border.contour());
    let radius = (area / std::f64::consts::PI).sqrt();
    if (x - region.centre.0).hypot(y - region.centre.1) < OFF_CENTRE * radius {
        return None;
    }
    let disc = disc(image, look, (x, y), radius);
    let border = look.walled(image, &disc)?;
    Some((disc, border))
}

/// Centre in the World and radius (m) of a border.
pub(super) fn seen(image: &PlacedBScan, border: &Border) -> (Vector3<f64>, f64) {
    let (area, (x, y)) = super::area_and_centre(&border.contour());
    let centre = image.world_from_image * Point::new(x, y, 0.0);
    (centre.vector(), (area / std::f64::consts::PI).sqrt())
}

/// For every image, the lumen that the accepted ones on both sides let expect there; nothing where one side has none
/// near enough.
fn between(
    images: &[PlacedBScan],
    borders: &[Result<Border, NoLumen>],
    look: &Look<'_>,
) -> Vec<Option<Region>> {
    let seen: Vec<Option<(Vector3<f64>, f64)>> =
        images.iter().zip(borders).map(|(image, border)| Some(seen(image, border.as_ref().ok()?))).collect();
    let expected = |(index, image): (usize, &PlacedBScan)| {
        let (before, after) = seen.split_at(index);
        let (a, ra) = (*before.iter().rev().flatten().next()?, *after.iter().skip(1).flatten().next()?);
        expected(image, look, a, ra)
    };
    images.iter().enumerate().map(expected).collect()
}

/// The disc that lies in the image's plane between two lumens (centre and radius).
fn expected(
    image: &PlacedBScan,
    look: &Look<'_>,
    before: (Vector3<f64>, f64),
    after: (Vector3<f64>, f64),
) -> Option<Region> {
    let image_from_world = image.world_from_image.inverse();
    let local = |place: Vector3<f64>| (image_from_world * Point::from_vector(place)).vector();
    let (a, b) = (local(before.0), local(after.0));
    let t = -a.z / (b.z - a.z);
    if !(0.0..=1.0).contains(&t) || (b - a).norm() > BETWEEN_M {
        return None;
    }
    let (centre, radius) = (a.lerp(&b, t), before.1 + (after.1 - before.1) * t);
    Some(disc(image, look, (centre.x, centre.y), radius))
}

/// A disc as a front would have filled it.
fn disc(image: &PlacedBScan, look: &Look<'_>, centre: (f64, f64), radius: f64) -> Region {
    let (setting, spread) = (&image.bscan.setting, &look.settings.point_spread);
    let depth = setting.window_top_m + centre.1;
    let lateral = spread.lateral_m(depth, setting);
    let sigma = (lateral / FWHM, spread.axial_fwhm_m / FWHM);
    // As far inside as a front would have stopped.
    let inside = |ray| {
        let (sin, cos) = angle(ray).sin_cos();
        (radius - 1.75 * (sigma.0 * cos).hypot(sigma.1 * sin)).max(0.1e-3)
    };
    let shadows = Shadows::below(&image.bscan, look.table, centre.1, lateral);
    Region { centre, radii: (0..RAYS).map(inside).collect(), excess: 1.0, shadows }
}
