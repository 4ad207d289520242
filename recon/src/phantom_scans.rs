//! Seeded scans of vessels whose lumen is known, as contours without pictures, with errors drawn from an
//! [`ErrorBudget`]: where the images truly are, and where they are thought to be.

use nalgebra::{Isometry3, Matrix3, Rotation3, SVector, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Point, Pose, Stamp, Wrench};
use probepath_us_capture::{BScan, PixelSpacing, PlacedBScan, Setting};

use crate::phantom_images::Dice;
use crate::{Contour, ErrorBudget, ImageLumen};

/// Points of a contour.
const POINTS: usize = 64;
/// Noise of contours this far apart is hardly the same (mm).
const SPECKLE_MM: f64 = 2.0;

/// A vessel on an arc in the World's x-z plane. Lengths in mm.
#[derive(Clone, Debug)]
pub(crate) struct Vessel {
    pub(crate) radius: f64,
    /// Place, length and lost part of the area of each stenosis.
    pub(crate) stenoses: Vec<(f64, f64, f64)>,
    /// Curvature of its axis (1/mm).
    pub(crate) bend: f64,
}

impl Vessel {
    pub(crate) fn radius_at(&self, s: f64) -> f64 {
        let lost = |&(at, length, area): &(f64, f64, f64)| {
            let off = s - at;
            let depth = self.radius * (1.0 - (1.0 - area).sqrt());
            let wave = (1.0 + (std::f64::consts::TAU * off / length).cos()) / 2.0;
            if off.abs() <= length / 2.0 { depth * wave } else { 0.0 }
        };
        self.radius - self.stenoses.iter().map(lost).sum::<f64>()
    }

    pub(crate) fn area_at(&self, s: f64) -> f64 {
        std::f64::consts::PI * self.radius_at(s).powi(2)
    }

    /// Point and direction of the axis.
    fn axis(&self, s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let k = self.bend.max(1e-7);
        let (sin, cos) = (k * s).sin_cos();
        (Vector3::new((1.0 - cos) / k, 0.0, sin / k), Vector3::new(sin, 0.0, cos))
    }

    /// Where along the axis a point is (mm), looked for from `s` on.
    pub(crate) fn nearest(&self, point: &Vector3<f64>, mut s: f64) -> f64 {
        for _ in 0..4 {
            let (centre, along) = self.axis(s);
            s += (point - centre).dot(&along);
        }
        s
    }

    /// How far a point is outside the lumen, looked for from `s` on.
    fn outside(&self, point: &Vector3<f64>, s: f64) -> f64 {
        let s = self.nearest(point, s);
        (point - self.axis(s).0).norm() - self.radius_at(s)
    }
}

/// How a vessel is scanned.
#[derive(Clone, Debug)]
pub(crate) struct Sweep {
    /// First and last image along the axis, and their distance (mm).
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) step: f64,
    /// Angle between the images' normal and the vessel (rad), and to which side.
    pub(crate) tilt: f64,
    pub(crate) toward: f64,
    /// Standard deviation of a contour's mean radius from speckle (mm).
    pub(crate) speckle_mm: f64,
    /// What the errors are drawn from.
    pub(crate) budget: ErrorBudget,
    pub(crate) force_n: f64,
}

impl Default for Sweep {
    fn default() -> Self {
        Self {
            from: 0.0,
            to: 90.0,
            step: 0.5,
            tilt: 0.0,
            toward: 0.0,
            speckle_mm: 0.08,
            budget: ErrorBudget::default(),
            force_n: 5.0,
        }
    }
}

/// Errors of one scan: the calibration's parameters as [`ErrorBudget::PARAMETERS`], and a shift of every border (mm).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrong {
    pub(crate) parameters: [f64; 10],
    pub(crate) border_mm: f64,
}

/// What a scan brings.
pub(crate) type Brought = (Vec<PlacedBScan>, Vec<ImageLumen>);

impl Sweep {
    /// Errors of a whole scan, drawn from the budget.
    pub(crate) fn draw(&self, dice: &mut Dice) -> Wrong {
        let normal = SVector::<f64, 10>::from_fn(|_, _| dice.normal_pair().0);
        let parameters = (self.budget.root() * normal).into();
        Wrong { parameters, border_mm: 1e3 * self.budget.border_sd_m * dice.normal_pair().0 }
    }

    /// The images and contours of a scan whose whole is wrong by `wrong`, and each image by itself by noise.
    pub(crate) fn scan(&self, vessel: &Vessel, wrong: &Wrong, dice: &mut Dice) -> Brought {
        let count = ((self.to - self.from) / self.step) as usize + 1;
        let sd = [self.budget.pose_sd_m, self.budget.pose_sd_rad];
        let shared = 1e3 * self.budget.pose_shared_m;
        let poses: [Vec<f64>; 6] = std::array::from_fn(|k| self.noise(count, shared, sd[k / 3], dice));
        let speckle: [Vec<f64>; 5] =
            std::array::from_fn(|_| self.noise(count, SPECKLE_MM, self.speckle_mm, dice));
        let each = (0..count).map(|i| {
            let noise = |k: usize| Vector3::new(poses[k][i], poses[k + 1][i], poses[k + 2][i]);
            let border = speckle.each_ref().map(|row| row[i]);
            self.image(vessel, wrong, i, (noise(0), noise(3)), border)
        });
        each.unzip()
    }

    /// Noise of standard deviation `sd` that neighbours within `shared` mm have in common.
    fn noise(&self, count: usize, shared: f64, sd: f64, dice: &mut Dice) -> Vec<f64> {
        // White noise through a Gaussian has the autocorrelation exp(-(d / shared)^2) when this is its width.
        let reach = (1.8 * shared / self.step).ceil() as usize;
        let tap =
            |k: usize| (-2.0 * ((k as f64 - reach as f64) * self.step / shared.max(1e-9)).powi(2)).exp();
        let taps: Vec<f64> = (0..=2 * reach).map(tap).collect();
        let size = taps.iter().map(|t| t * t).sum::<f64>().sqrt();
        let white: Vec<f64> = (0..count + 2 * reach).map(|_| dice.normal_pair().0).collect();
        let at = |i: usize| taps.iter().zip(&white[i..]).map(|(t, w)| t * w).sum::<f64>() * sd / size;
        (0..count).map(at).collect()
    }

    fn image(
        &self,
        vessel: &Vessel,
        wrong: &Wrong,
        i: usize,
        (shift, turn): (Vector3<f64>, Vector3<f64>),
        border: [f64; 5],
    ) -> (PlacedBScan, ImageLumen) {
        let s = self.from + i as f64 * self.step;
        let speed_mm_s = 10.0;
        let [rx, ry, rz, tx, ty, tz, columns, rows, shear, lag] = wrong.parameters;
        let (true_image, probe_from_image) = (self.true_image(vessel, s), held());
        // What the tracker says: where the probe was `lag` later, and noise.
        let late = self.true_image(vessel, s + speed_mm_s * lag) * probe_from_image.inverse();
        let noise = Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::identity());
        let probe = noise * late * UnitQuaternion::from_scaled_axis(turn);
        let believed = Isometry3::from_parts(
            Translation3::from(probe_from_image.translation.vector + Vector3::new(tx, ty, tz)),
            probe_from_image.rotation * UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz)),
        );
        let outline = self.outline(vessel, &true_image, s, wrong.border_mm, border);
        let spacing = PixelSpacing { x_m: 1e-4 * (1.0 + columns), y_m: 1e-4 * (1.0 + rows) };
        let image = placed(i as u64, probe, probe * believed, spacing, s / speed_mm_s, self.force_n);
        let lumen = Ok(contour(&image, &outline, shear, self.speckle_mm));
        (image, ImageLumen { number: i as u64, lumen, others: Vec::new() })
    }

    /// Where the image truly is: the vessel's centre in the middle of it.
    fn true_image(&self, vessel: &Vessel, s: f64) -> Isometry3<f64> {
        let (centre, along) = vessel.axis(s);
        let (y, x) = (Vector3::y(), Vector3::y().cross(&along));
        let side = x * self.toward.cos() + y * self.toward.sin();
        let normal = along * self.tilt.cos() + side * self.tilt.sin();
        let down = (y - normal * normal.dot(&y)).normalize();
        let axes = Matrix3::from_columns(&[down.cross(&normal), down, normal]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let origin = centre * 1e-3 - turn * MIDDLE;
        Isometry3::from_parts(Translation3::from(origin), turn)
    }

    /// Where the true plane cuts the lumen, with noise, in the image (m).
    fn outline(
        &self,
        vessel: &Vessel,
        image: &Isometry3<f64>,
        s: f64,
        shift_mm: f64,
        border: [f64; 5],
    ) -> Vec<(f64, f64)> {
        (0..POINTS)
            .map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / POINTS as f64;
                let way = Vector3::new(angle.cos(), angle.sin(), 0.0);
                let place = |r: f64| image * nalgebra::Point3::from(MIDDLE + way * r * 1e-3);
                let (mut low, mut high) = (0.0, 3.0 * vessel.radius);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    let out = vessel.outside(&(place(middle).coords * 1e3), s) > 0.0;
                    (low, high) = if out { (low, middle) } else { (middle, high) };
                }
                let waves = border[1] * angle.cos() + border[2] * angle.sin();
                let ovals = border[3] * (2.0 * angle).cos() + border[4] * (2.0 * angle).sin();
                let at = MIDDLE + way * (low + shift_mm + border[0] + waves + ovals) * 1e-3;
                (at.x, at.y)
            })
            .collect()
    }
}

/// The vessel's centre in the image (m).
const MIDDLE: Vector3<f64> = Vector3::new(0.020, 0.034, 0.0);

/// How the image is held on the probe.
fn held() -> Isometry3<f64> {
    let turn = UnitQuaternion::from_euler_angles(1.55, 0.1, -0.05);
    Isometry3::from_parts(Translation3::new(-0.02, 0.004, 0.012), turn)
}

fn placed(
    number: u64,
    probe: Isometry3<f64>,
    image: Isometry3<f64>,
    spacing: PixelSpacing,
    seconds: f64,
    force_n: f64,
) -> PlacedBScan {
    let setting = Setting {
        depth_m: 0.07,
        focus_m: 0.045,
        window_top_m: 0.0,
        window_height_m: 0.07,
        window_width_m: 0.04,
        spacing,
    };
    let stamp = Stamp::from_nanoseconds((seconds * 1e9) as i64);
    let bscan = BScan::new(number, (stamp, stamp), setting, (1, 1), [0_u8]).expect("one pixel");
    PlacedBScan {
        bscan,
        // FRAMES: a scan made here; the vessel's system is the World.
        world_from_probe: Pose::assume(probe),
        // FRAMES: the same.
        world_from_image: Pose::assume(image),
        wrench: Some(Wrench::new(Vector3::new(0.0, 0.0, -force_n), Vector3::zeros())),
    }
}

/// What a finder that makes no mistake beside the noise brings of an outline in the true image.
fn contour(image: &PlacedBScan, outline: &[(f64, f64)], shear: f64, sd_mm: f64) -> Contour {
    let spacing = image.bscan.setting.spacing;
    // Pixels are what the machine shows; their believed size may be wrong.
    let pixels: Vec<(f64, f64)> = outline.iter().map(|&(x, y)| (x / 1e-4, y / 1e-4)).collect();
    let believed = |&(column, row): &(f64, f64)| {
        let place = spacing.point(column, row).vector();
        (place.x + shear * place.y, place.y)
    };
    let places: Vec<(f64, f64)> = pixels.iter().map(believed).collect();
    let world = |(x, y): (f64, f64)| image.world_from_image * Point::new(x, y, 0.0);
    let (area, centre) = crate::lumen::area_and_centre(&places);
    Contour {
        centre_pixel: (centre.0 / spacing.x_m, centre.1 / spacing.y_m),
        world: places.iter().map(|&place| world(place)).collect(),
        centre: world(centre),
        area_mm2: area * 1e6,
        sd_mm,
        points_sd_mm: vec![sd_mm * 10.0_f64.sqrt(); pixels.len()],
        common_sd_mm: 0.0,
        common_size_sd_mm: 0.0,
        vessel: 0,
        pixels,
        branches: false,
        wall_mm: 0.8,
        contrast_db: 20.0,
    }
}
