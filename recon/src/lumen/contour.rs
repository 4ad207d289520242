//! [`Contour`]: the border of a lumen in one image, with its uncertainty, and what makes one.

use probepath_frames::{Point, World};
use probepath_us_capture::PlacedBScan;

use super::NoLumen;

/// The border of the lumen in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Columns and rows of its points, a closed line round the centre.
    pub pixels: Vec<(f64, f64)>,
    /// Column and row of its centre of gravity.
    pub centre_pixel: (f64, f64),
    /// The same points in the World.
    pub world: Vec<Point<World>>,
    /// Its centre of gravity in the World.
    pub centre: Point<World>,
    /// Area inside it, in the image's plane, which need not be normal to the vessel (mm2).
    pub area_mm2: f64,
    /// Standard deviation of the mean radius (mm): what the speckle leaves open, no systematic error.
    pub sd_mm: f64,
    /// Standard deviation of each point along its outward normal (mm), of the same kind; one for each of `world`.
    /// Neighbouring points share most of it.
    pub points_sd_mm: Vec<f64>,
    /// Standard deviation of what moves all points of this image and its neighbours together (mm): the point spread
    /// that was assumed, and the model of the wall. It does not become less with more images.
    pub common_sd_mm: f64,
    /// Standard deviation of what moves their mean radii together (mm): most of what is shared leaves the size alone.
    pub common_size_sd_mm: f64,
    /// Which vessel it is: 0 for the one followed first; a branch keeps its own number from image to image.
    pub vessel: usize,
    /// Whether the dark region runs on beyond it: a branch, or a vein that lies against it.
    pub branches: bool,
    /// The wall's thickness (mm).
    pub wall_mm: f64,
    /// How much brighter than the lumen the wall is (dB).
    pub contrast_db: f64,
}

impl Contour {
    /// A contour that something else found: columns and rows of a closed line, and the standard deviation of each
    /// point along its normal (mm). What only the image can say (wall, contrast) is left at zero.
    ///
    /// # Errors
    /// When it is no border: fewer than 8 points, a number that is not finite, not one standard deviation a point,
    /// a line that crosses itself, or no area.
    pub fn new(
        image: &PlacedBScan,
        pixels: Vec<(f64, f64)>,
        points_sd_mm: Vec<f64>,
        common_sd_mm: f64,
    ) -> Result<Self, NoLumen> {
        let bad = |what| Err(NoLumen::BadContour { what });
        if pixels.len() < 8 {
            return bad("has fewer than 8 points");
        }
        if points_sd_mm.len() != pixels.len() {
            return bad("does not have one standard deviation a point");
        }
        let known = |sd: &f64| sd.is_finite() && *sd > 0.0;
        let common_known = common_sd_mm.is_finite() && common_sd_mm >= 0.0;
        if !(common_known && points_sd_mm.iter().all(known)) {
            return bad("has a standard deviation that is not a positive number");
        }
        if !pixels.iter().all(|(column, row)| column.is_finite() && row.is_finite()) {
            return bad("has a point that is not finite");
        }
        if crosses_itself(&pixels) {
            return bad("crosses itself");
        }
        let spacing = image.bscan.setting.spacing;
        let places: Vec<(f64, f64)> = pixels.iter().map(|p| (p.0 * spacing.x_m, p.1 * spacing.y_m)).collect();
        if area_and_centre(&places).0 <= 0.0 {
            return bad("has no area");
        }
        // A point's own error and its neighbours' agree over about a tenth of the circumference.
        let mean = points_sd_mm.iter().map(|sd| sd * sd).sum::<f64>() / points_sd_mm.len() as f64;
        let sd_mm = (mean / 10.0).sqrt();
        let uncertainty = Uncertainty { points_sd_mm, sd_mm, common_sd_mm, common_size_sd_mm: common_sd_mm };
        Ok(Self::of(image, &places, uncertainty))
    }

    /// From places in the image (m).
    pub(super) fn of(image: &PlacedBScan, places: &[(f64, f64)], uncertainty: Uncertainty) -> Self {
        let (area, centre) = area_and_centre(places);
        let spacing = image.bscan.setting.spacing;
        let pixel = |(x, y): (f64, f64)| (x / spacing.x_m, y / spacing.y_m);
        let world = |(x, y): (f64, f64)| image.world_from_image * Point::new(x, y, 0.0);
        Self {
            pixels: places.iter().map(|&place| pixel(place)).collect(),
            centre_pixel: pixel(centre),
            world: places.iter().map(|&place| world(place)).collect(),
            centre: world(centre),
            area_mm2: area * 1e6,
            sd_mm: uncertainty.sd_mm,
            points_sd_mm: uncertainty.points_sd_mm,
            common_sd_mm: uncertainty.common_sd_mm,
            common_size_sd_mm: uncertainty.common_size_sd_mm,
            vessel: 0,
            branches: false,
            wall_mm: 0.0,
            contrast_db: 0.0,
        }
    }

    /// Radius of the circle of the same area (mm).
    pub fn radius_mm(&self) -> f64 {
        (self.area_mm2 / std::f64::consts::PI).sqrt()
    }
}

/// How sure a contour is (mm).
pub(super) struct Uncertainty {
    pub(super) points_sd_mm: Vec<f64>,
    pub(super) sd_mm: f64,
    pub(super) common_sd_mm: f64,
    pub(super) common_size_sd_mm: f64,
}

/// Area and centre of gravity of a closed line (Green's theorem). A line without area has its mean as centre.
pub(crate) fn area_and_centre(points: &[(f64, f64)]) -> (f64, (f64, f64)) {
    let n = points.len().max(1) as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
        let (ax, ay, bx, by) = (a.0 - mean.0, a.1 - mean.1, b.0 - mean.0, b.1 - mean.1);
        let cross = ax * by - bx * ay;
        area += cross / 2.0;
        x += (ax + bx) * cross / 6.0;
        y += (ay + by) * cross / 6.0;
    }
    if area.abs() < 1e-30 {
        return (0.0, mean);
    }
    (area.abs(), (mean.0 + x / area, mean.1 + y / area))
}

/// Whether two sides of a closed line that are not neighbours meet.
fn crosses_itself(line: &[(f64, f64)]) -> bool {
    let n = line.len();
    let side = |i: usize| (line[i], line[(i + 1) % n]);
    (0..n).any(|i| {
        let last = if i == 0 { n - 1 } else { n };
        (i + 2..last).any(|j| cross(side(i), side(j)))
    })
}

/// Whether two stretches cross: the ends of each lie on different sides of the other.
fn cross((a, b): ((f64, f64), (f64, f64)), (c, d): ((f64, f64), (f64, f64))) -> bool {
    let turn =
        |p: (f64, f64), q: (f64, f64), r: (f64, f64)| (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
    turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Phantom;

    fn image() -> PlacedBScan {
        Phantom { pixels: (40, 40), window: (20.0, 25.0), ..Phantom::default() }.bscan(0, 0.0)
    }

    fn circle(points: usize) -> Vec<(f64, f64)> {
        let angle = |k: usize| std::f64::consts::TAU * k as f64 / points as f64;
        (0..points).map(|k| (20.0 + 8.0 * angle(k).cos(), 20.0 + 8.0 * angle(k).sin())).collect()
    }

    #[test]
    fn a_contour_from_elsewhere_has_its_area_and_its_place() {
        let image = image();
        let contour = Contour::new(&image, circle(64), vec![0.1; 64], 0.05).expect("a circle");
        let spacing = image.bscan.setting.spacing;
        let truth = std::f64::consts::PI * 64.0 * spacing.x_m * spacing.y_m * 1e6;
        assert!((contour.area_mm2 / truth - 1.0).abs() < 2e-3, "{} {truth}", contour.area_mm2);
        assert!((contour.centre_pixel.0 - 20.0).abs() < 1e-9 && (contour.centre_pixel.1 - 20.0).abs() < 1e-9);
        let expected = image.world_from_image * spacing.point(20.0, 20.0);
        assert!(contour.centre.distance(&expected) < 1e-12);
        assert!(contour.sd_mm < 0.1 && contour.points_sd_mm.len() == 64);
    }

    #[test]
    fn what_is_no_border_is_refused_with_the_reason() {
        let image = image();
        let refused = |pixels: Vec<(f64, f64)>, sd: Vec<f64>| {
            Contour::new(&image, pixels, sd, 0.0).expect_err("no border").to_string()
        };
        assert!(refused(circle(6), vec![0.1; 6]).contains("fewer than 8"));
        assert!(refused(circle(9), vec![0.1; 8]).contains("one standard deviation"));
        assert!(refused(circle(9), vec![f64::NAN; 9]).contains("not a positive number"));
        let mut bad = circle(9);
        bad[3].0 = f64::INFINITY;
        assert!(refused(bad, vec![0.1; 9]).contains("not finite"));
        let mut eight = circle(12);
        eight.swap(2, 9);
        assert!(refused(eight, vec![0.1; 12]).contains("crosses itself"));
        assert!(refused(vec![(3.0, 3.0); 8], vec![0.1; 8]).contains("no area"));
    }
}
