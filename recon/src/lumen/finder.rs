//! [`LumenFinder`]: whatever finds the lumen in images as they come.

use nalgebra::Vector3;
use probepath_us_capture::PlacedBScan;

use super::{ImageLumen, Look, Plane, track};
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
    trail: Vec<Vector3<f64>>,
    first: bool,
}

impl Tracker {
    /// Before the first image.
    pub fn new(settings: LumenSettings) -> Self {
        let table = PowerOfGrey::new(settings.dynamic_range_db);
        Self { table, settings, trail: Vec::new(), first: true }
    }
}

impl LumenFinder for Tracker {
    fn find(&mut self, image: &PlacedBScan) -> ImageLumen {
        let look = Look { table: &self.table, settings: &self.settings };
        let given = self.settings.seed.filter(|_| self.first).map(|seed| seed.place(image));
        self.first = false;
        let lumen =
            track::region(image, &self.table, &self.settings, &self.trail, given).and_then(|region| {
                let border = look.fitted(image, &region, &Plane::ITSELF, None)?;
                look.accepted(image, &border, &region)
            });
        if let Ok(contour) = &lumen {
            self.trail.push(contour.centre.vector());
        }
        ImageLumen { number: image.bscan.number, lumen, others: Vec::new() }
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
