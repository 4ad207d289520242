//! The lumen in each B-scan of a sweep: the seed goes from image to image, the wall is fitted in each.

mod again;
mod astray;
mod beam;
mod branches;
mod contour;
mod finder;
mod fit;
mod refusal;
mod region;
mod seed;
mod shadow;
mod track;
mod wall;

use std::collections::BTreeSet;

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_us_capture::PlacedBScan;
use rayon::prelude::*;

pub use contour::Contour;
pub(crate) use contour::area_and_centre;
pub use finder::{LumenFinder, Tracker};
pub use refusal::NoLumen;

use crate::patch::PowerOfGrey;
use crate::settings::FWHM;
use crate::{LumenSettings, SeedPoint};
use contour::Uncertainty;
use fit::{Border, FitInput, Plane, Start};
use region::{RAYS, Region, angle};
use wall::{WallPrior, Walls};

/// What one image gave.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageLumen {
    /// The B-scan's number.
    pub number: u64,
    /// The border of the lumen, or why there is none.
    pub lumen: Result<Contour, NoLumen>,
    /// Further arterial lumens in the same image, such as the deep branch, by rising number of their vessel.
    pub others: Vec<Contour>,
}

/// The lumen of every image, in their order. The images are a sweep: each shows the vessel near where the one
/// before has it. At a branch, the lumen that goes on straightest is followed.
///
/// The settings and images are taken as they are: [`reconstruct_lumen`](crate::reconstruct_lumen) checks them.
pub fn segment(images: &[PlacedBScan], settings: &LumenSettings) -> Vec<ImageLumen> {
    let table = PowerOfGrey::new(settings.dynamic_range_db);
    let wall = WallPrior::unknown(settings.wall_thickness_m);
    let look = Look { table: &table, settings, wall, last: false };
    let mut regions = track::follow(images, &table, settings);
    let mut borders = first_borders(images, &regions, &look);
    again::second_look(images, &look, &mut regions, &mut borders);
    let telling = telling(images, &borders);
    fit_again((images, &regions), &mut borders, &look, |_| true, |index| telling.contains(&index));
    let wall = wall_of(images, &borders, &telling).prior(settings.wall_thickness_m);
    let last = Look { wall, last: true, ..look };
    fit_again((images, &regions), &mut borders, &last, |index| telling.contains(&index), |_| true);
    let each = images.iter().zip(regions.iter().zip(borders));
    let lumens = each.map(|(image, (region, border))| {
        let lumen = match (region, border) {
            (Ok(region), Ok(border)) => look.accepted(image, &border, region),
            (Err(why), _) => Err(*why),
            (_, Err(why)) => Err(why),
        };
        ImageLumen { number: image.bscan.number, lumen, others: Vec::new() }
    });
    let mut lumens: Vec<ImageLumen> = lumens.collect();
    branches::in_sweep(images, &Look { last: true, ..look }, &mut lumens);
    lumens
}

/// Fits the wall once more in the images that are `wanted`, with what the beam's thickness takes in, as the images that are
/// `asked` say it.
fn fit_again(
    (images, regions): (&[PlacedBScan], &[Result<Region, NoLumen>]),
    borders: &mut [Result<Border, NoLumen>],
    look: &Look<'_>,
    asked: impl Fn(usize) -> bool,
    wanted: impl Fn(usize) -> bool + Sync,
) {
    let planes = beam::planes(images, borders, &look.settings.point_spread, asked);
    let inputs = images.par_iter().zip(regions).zip(&planes).enumerate();
    inputs.zip(borders).for_each(|((index, ((image, region), planes)), border)| {
        if let (true, Ok(region), Ok(earlier)) = (wanted(index), region, &*border) {
            *border = look.fitted(image, region, planes, Start::Again(earlier));
        }
    });
}

/// The images that are asked how thick the wall is: nearer ones see the same speckle.
fn telling(images: &[PlacedBScan], borders: &[Result<Border, NoLumen>]) -> BTreeSet<usize> {
    let mut last: Option<Vector3<f64>> = None;
    let far = |(index, (image, border)): (usize, (&PlacedBScan, &Result<Border, NoLumen>))| {
        let centre = centre(image, border.as_ref().ok()?);
        let apart = last.is_none_or(|last| (last - centre).norm() >= TELLING_M);
        apart.then(|| last = Some(centre)).map(|()| index)
    };
    images.iter().zip(borders).enumerate().filter_map(far).collect()
}

/// Where a border is in the World (m).
fn centre(image: &PlacedBScan, border: &Border) -> Vector3<f64> {
    (image.world_from_image * Point::new(border.centre.0, border.centre.1, 0.0)).vector()
}

/// What these images say of the wall.
fn wall_of(images: &[PlacedBScan], borders: &[Result<Border, NoLumen>], telling: &BTreeSet<usize>) -> Walls {
    let mut walls = Walls::default();
    for (image, border) in telling.iter().filter_map(|&index| Some((images.get(index)?, borders.get(index)?)))
    {
        if let Ok(border) = border {
            walls.add(border, centre(image, border));
        }
    }
    walls
}

/// Images that are fitted one after the other, each from where the one before ended.
const RUN: usize = 16;
/// Regions this near to each other (m) are of one place.
const BESIDE_M: f64 = 1.0e-3;

/// The wall round every region, the beam's thickness not thought of yet.
fn first_borders(
    images: &[PlacedBScan],
    regions: &[Result<Region, NoLumen>],
    look: &Look<'_>,
) -> Vec<Result<Border, NoLumen>> {
    let run = |(images, regions): (&[PlacedBScan], &[Result<Region, NoLumen>])| {
        let mut last: Option<(Point<World>, Border)> = None;
        let mut borders = Vec::with_capacity(images.len());
        for (image, region) in images.iter().zip(regions) {
            let border = region.as_ref().map_err(|why| *why).and_then(|region| {
                let centre = image.world_from_image * Point::new(region.centre.0, region.centre.1, 0.0);
                let beside = last.as_ref().filter(|last| last.0.distance(&centre) < BESIDE_M);
                let warm = beside.and_then(|(_, from)| {
                    let border = look.fitted(image, region, &Plane::ITSELF, Start::Beside(from)).ok()?;
                    look.accepted(image, &border, region).is_ok().then_some(border)
                });
                let border =
                    warm.map_or_else(|| look.fitted(image, region, &Plane::ITSELF, Start::Front), Ok)?;
                last = Some((centre, border.clone()));
                Ok(border)
            });
            borders.push(border);
        }
        borders
    };
    images.par_chunks(RUN).zip(regions.par_chunks(RUN)).flat_map_iter(run).collect()
}

/// Images nearer to each other than this (m) say hardly more of the wall than one of them.
const TELLING_M: f64 = 1.2e-3;

/// What every fit needs.
#[derive(Clone, Copy)]
struct Look<'a> {
    table: &'a PowerOfGrey,
    settings: &'a LumenSettings,
    wall: WallPrior,
    /// Whether what is fitted is fitted for the last time.
    last: bool,
}

impl Look<'_> {
    /// The wall round a region, when it is one of a lumen.
    fn walled(&self, image: &PlacedBScan, region: &Region) -> Option<Border> {
        let border = self.fitted(image, region, &Plane::ITSELF, Start::Front).ok()?;
        self.accepted(image, &border, region).is_ok().then_some(border)
    }

    /// The wall, fitted round a region.
    fn fitted(
        &self,
        image: &PlacedBScan,
        region: &Region,
        planes: &[Plane],
        start: Start<'_>,
    ) -> Result<Border, NoLumen> {
        let setting = &image.bscan.setting;
        let depth = setting.window_top_m + region.centre.1;
        let spread = &self.settings.point_spread;
        let sigma = (spread.lateral_m(depth, setting) / FWHM, spread.axial_fwhm_m / FWHM);
        let (wall, last, sigma_sd) = (self.wall, self.last, self.settings.point_spread_sd);
        let (bscan, table) = (&image.bscan, self.table);
        fit::fit(&FitInput { bscan, table, region, sigma, sigma_sd, wall, planes, last, start })
    }

    /// The contour of a border that is one of a lumen.
    fn accepted(&self, image: &PlacedBScan, border: &Border, region: &Region) -> Result<Contour, NoLumen> {
        let contour = contour(image, border, region);
        let radius = (contour.area_mm2 / std::f64::consts::PI).sqrt();
        let (low, high) = self.settings.radius_range_m;
        if !(low * 1e3..high * 1e3).contains(&radius) {
            return Err(NoLumen::Radius { radius_mm: radius });
        }
        if border.walled < 0.6 {
            return Err(NoLumen::NoWall { percent: 100.0 * border.walled });
        }
        if border.contrast_db < 6.0 {
            return Err(NoLumen::NoContrast { contrast_db: border.contrast_db });
        }
        if border.misfit > MOST_MISFIT {
            return Err(NoLumen::Misfit { times: border.misfit });
        }
        let unsure = |(at, sd_mm): (&(f64, f64), &f64)| {
            let part = if hidden(image, region, *at) { MOST_UNSURE_HIDDEN } else { MOST_UNSURE };
            (*sd_mm > MOST_UNSURE_MM + part * radius).then_some(*sd_mm)
        };
        let unsure = contour.pixels.iter().zip(&contour.points_sd_mm).filter_map(unsure);
        match unsure.reduce(f64::max) {
            Some(sd_mm) => Err(NoLumen::Unsure { sd_mm }),
            None => Ok(contour),
        }
    }
}

/// Whether a shadow or the picture's edge hides what is at a pixel.
fn hidden(image: &PlacedBScan, region: &Region, (column, row): (f64, f64)) -> bool {
    let (width, height) = (image.bscan.width() as f64, image.bscan.height() as f64);
    let seen = (0.0..width).contains(&column) && (0.0..height).contains(&row);
    !seen || region.shadows.cover(column * image.bscan.setting.spacing.x_m)
}

/// A border that is less sure than this (mm), and a part of the radius, somewhere is not given. Where a shadow or
/// the picture's edge hides the wall, its standard deviation says so, and the surface weighs it accordingly.
const MOST_UNSURE_MM: f64 = 0.3;
const MOST_UNSURE: f64 = 0.1;
const MOST_UNSURE_HIDDEN: f64 = 0.25;
/// What a wall round a lumen cannot be by speckle: 0.7 to 0.95 are usual, wrong borders are above 1.2.
const MOST_MISFIT: f64 = 1.15;

fn contour(image: &PlacedBScan, border: &Border, region: &Region) -> Contour {
    let places = border.contour();
    let uncertainty = Uncertainty {
        points_sd_mm: (0..RAYS).map(|ray| border.sd_at(angle(ray)) * 1e3).collect(),
        sd_mm: border.sd * 1e3,
        common_sd_mm: border.common_sd * 1e3,
        common_size_sd_mm: border.common_size_sd * 1e3,
    };
    let contour = Contour::of(image, &places, uncertainty);
    let own = places.len() as f64;
    let filled = region.radii.iter().map(|r| r * r).sum::<f64>() * std::f64::consts::PI / own * region.excess;
    Contour {
        branches: region.excess > 1.3 || filled * 1e6 > 1.1 * contour.area_mm2,
        wall_mm: border.wall * 1e3,
        contrast_db: border.contrast_db,
        ..contour
    }
}

impl SeedPoint {
    /// In metres from the centre of the first pixel.
    fn place(&self, image: &PlacedBScan) -> (f64, f64) {
        let spacing = image.bscan.setting.spacing;
        match *self {
            Self::Pixel { column, row } => (column * spacing.x_m, row * spacing.y_m),
            Self::Millimetres { x_mm, y_mm } => (x_mm * 1e-3, y_mm * 1e-3),
        }
    }
}

#[cfg(test)]
mod tests;
