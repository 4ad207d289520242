//! [`LumenFinder`]: whatever finds the lumen in images as they come.

use std::collections::VecDeque;

use nalgebra::Vector3;
use probepath_frames::Point;
use probepath_us_capture::PlacedBScan;

use super::beam::{self, Section};
use super::branches::Branches;
use super::region::Region;
use super::wall::{WallPrior, Walls};
use super::{Border, Contour, ImageLumen, Look, NoLumen, Plane, Start, track};
use crate::LumenSettings;
use crate::patch::PowerOfGrey;

/// Finds the lumen in images as they come. [`Tracker`] is ours; a network, or a function in another language, can
/// stand in its place.
///
/// ```
/// use probepath_recon::{Contour, ImageLumen, LumenFinder};
/// use probepath_us_capture::PlacedBScan;
///
/// /// Takes every lumen for a circle of 4 mm in the middle.
/// struct Circle;
///
/// impl LumenFinder for Circle {
///     fn find(&mut self, image: &PlacedBScan) -> ImageLumen {
///         let (bscan, spacing) = (&image.bscan, image.bscan.setting.spacing);
///         let middle = (bscan.width() as f64 / 2.0, bscan.height() as f64 / 2.0);
///         let point = |k: i32| {
///             let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 64.0).sin_cos();
///             (middle.0 + 4e-3 / spacing.x_m * cos, middle.1 + 4e-3 / spacing.y_m * sin)
///         };
///         let lumen = Contour::new(image, (0..64).map(point).collect(), vec![1.0; 64], 0.0);
///         ImageLumen { number: bscan.number, lumen, others: Vec::new() }
///     }
/// }
/// ```
pub trait LumenFinder: Send {
    /// Images in the order they come; the finder may remember those before.
    fn find(&mut self, image: &PlacedBScan) -> ImageLumen;
}

/// Follows the lumen from image to image, and asks nothing of images to come.
///
/// It knows less than [`segment`](super::segment), which sees the images on both sides of each.
///
/// The settings and images are taken as they are: [`LumenSettings::check`] says whether they can be worked with.
#[derive(Clone, Debug)]
pub struct Tracker {
    table: PowerOfGrey,
    settings: LumenSettings,
    main: Followed,
    branches: Branches,
    first: bool,
}

impl Tracker {
    /// Before the first image.
    pub fn new(settings: LumenSettings) -> Self {
        let table = PowerOfGrey::new(settings.dynamic_range_db);
        Self { table, settings, main: Followed::default(), branches: Branches::default(), first: true }
    }
}

impl LumenFinder for Tracker {
    fn find(&mut self, image: &PlacedBScan) -> ImageLumen {
        let wall = WallPrior::unknown(self.settings.wall_thickness_m);
        let look = Look { table: &self.table, settings: &self.settings, wall, last: true };
        let given = self.settings.seed.filter(|_| self.first).map(|seed| seed.place(image));
        self.first = false;
        let region = track::region(image, &self.table, &self.settings, &self.main.trail, given);
        let lumen = region.and_then(|region| self.main.contour(image, &region, &look));
        let others = self.branches.find(image, lumen.as_ref().ok(), &look);
        ImageLumen { number: image.bscan.number, lumen, others }
    }
}

/// Sections are remembered over more than the beam's thickness.
const REMEMBERED: usize = 100;
/// A border this near to the last one (m) begins where that ended.
const BESIDE_M: f64 = 1.5e-3;
/// A trail is a place each (m), however slow the sweep.
const TRAIL_STEP_M: f64 = 0.05e-3;

/// A vessel that is followed: what was seen of it so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Followed {
    pub(super) trail: Vec<Vector3<f64>>,
    sections: VecDeque<Section>,
    last: Option<Border>,
    walls: Walls,
}

impl Followed {
    /// The contour round a region, with the beam as the images so far let expect it.
    pub(super) fn contour(
        &mut self,
        image: &PlacedBScan,
        region: &Region,
        look: &Look<'_>,
    ) -> Result<Contour, NoLumen> {
        let look = &Look { wall: self.walls.prior(look.settings.wall_thickness_m), ..*look };
        let centre = image.world_from_image * Point::new(region.centre.0, region.centre.1, 0.0);
        let beside = |section: &&Section| (section.centre - centre.vector()).norm() < BESIDE_M;
        let found = match (self.sections.front().filter(beside), &self.last) {
            (Some(section), Some(last)) => {
                let own = Section { centre: centre.vector(), radius: section.radius };
                let planes = beam::of_image(image, &own, self.sections.iter(), &look.settings.point_spread);
                self.walled(image, region, look, (&planes, Start::Beside(last)))
            }
            _ => Err(NoLumen::Unsettled),
        };
        let (border, contour) =
            found.or_else(|_| self.walled(image, region, look, (&Plane::ITSELF, Start::Front)))?;
        self.remember(image, border);
        Ok(contour)
    }

    fn walled(
        &self,
        image: &PlacedBScan,
        region: &Region,
        look: &Look<'_>,
        (planes, start): (&[Plane], Start<'_>),
    ) -> Result<(Border, Contour), NoLumen> {
        let border = look.fitted(image, region, planes, start)?;
        let contour = look.accepted(image, &border, region)?;
        Ok((border, contour))
    }

    fn remember(&mut self, image: &PlacedBScan, border: Border) {
        let section = Section::of(image, &border);
        let moved = |last: &Vector3<f64>| (last - section.centre).norm() > TRAIL_STEP_M;
        if self.trail.last().is_none_or(moved) {
            self.trail.push(section.centre);
        }
        self.walls.add(&border, section.centre);
        self.sections.push_front(section);
        self.sections.truncate(REMEMBERED);
        self.last = Some(border);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Phantom;

    #[test]
    fn the_tracker_finds_the_lumen_image_by_image() {
        let phantom = Phantom { pixels: (200, 200), window: (20.0, 25.0), ..Phantom::default() };
        let mut tracker: Box<dyn LumenFinder> = Box::new(Tracker::new(LumenSettings::default()));
        let truth = std::f64::consts::PI * phantom.radius * phantom.radius;
        for number in 0..8 {
            let found = tracker.find(&phantom.bscan(number, number as f64));
            assert_eq!(found.number, number);
            let contour = found.lumen.expect("a lumen");
            assert!((contour.area_mm2 / truth - 1.0).abs() < 0.12, "{} mm2", contour.area_mm2);
            assert_eq!(contour.points_sd_mm.len(), contour.world.len());
        }
    }
}
