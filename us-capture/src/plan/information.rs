//! What an image of the phantom would say about the calibration: its Fisher information, from predicted dots.
//!
//! The unknowns, in this order: a small motion of the image's plane written in Probe (3 m, 3 rad), the lag (s), a small
//! motion of the phantom in itself (3 m, 3 rad), and the parts by which columns and rows are larger than stated.

use std::fmt;

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector2, Vector3};
use probepath_frames::{Image, Phantom, Pose, Probe, World};

use super::{Bench, VisitOptions};
use crate::phantom::Wire;

/// How many unknowns.
pub(super) const N: usize = 15;
const LAG: usize = 6;
/// Names and units of the unknowns.
const NAMES: [(&str, &str, f64); N] = [
    ("image plane along probe x", "mm", 1e3),
    ("image plane along probe y", "mm", 1e3),
    ("image plane along probe z", "mm", 1e3),
    ("image plane about probe x", "degrees", DEGREES),
    ("image plane about probe y", "degrees", DEGREES),
    ("image plane about probe z", "degrees", DEGREES),
    ("lag", "ms", 1e3),
    ("phantom along its x", "mm", 1e3),
    ("phantom along its y", "mm", 1e3),
    ("phantom along its z", "mm", 1e3),
    ("phantom about its x", "degrees", DEGREES),
    ("phantom about its y", "degrees", DEGREES),
    ("phantom about its z", "degrees", DEGREES),
    ("size of a column", "percent", 1e2),
    ("size of a row", "percent", 1e2),
];
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// What is known of the lag before (s): nothing to speak of.
const LAG_SD_S: f64 = 0.5;
/// A size of a pixel that is not to be estimated is known to this part of itself.
const KNOWN_SCALE: f64 = 1e-6;
/// Steps of the difference quotients (m, rad, s).
const STEP: f64 = 1e-6;
/// Places along a column and along a row that the standard error is asked at.
const GRID: usize = 9;

/// An information matrix of the unknowns.
pub(super) type Information = SMatrix<f64, N, N>;
type Unknowns = SVector<f64, N>;

/// How well the calibration is determined.
#[derive(Clone, Debug, PartialEq)]
pub struct Expected {
    /// Standard error of a reconstructed point in Probe, mean over the image (m).
    pub point_mean_m: f64,
    /// Its 95th percentile over the image (m).
    pub point_p95_m: f64,
    /// Its root mean square over the image (m).
    pub point_rms_m: f64,
    /// Standard error of the lag (s); what was known before when nothing moves.
    pub lag_s: f64,
    /// Standard error of every unknown, by name.
    pub parameters: Vec<ExpectedParameter>,
}

/// How well one unknown is determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedParameter {
    /// What it is.
    pub name: &'static str,
    /// Its standard error.
    pub sd: f64,
    /// In this unit.
    pub unit: &'static str,
}

impl Expected {
    pub(super) fn of(information: &Information, bench: &Bench<'_>, options: &VisitOptions) -> Self {
        let covariance = covariance(information);
        let mut errors: Vec<f64> = grid(bench)
            .map(|jacobian| (jacobian * covariance * jacobian.transpose()).trace().sqrt())
            .collect();
        errors.sort_by(f64::total_cmp);
        let p95 = errors.get((errors.len() * 95).div_ceil(100).saturating_sub(1)).copied();
        let variances = covariance.diagonal();
        let asked = |i: &usize| *i < N - 2 || options.scale_sd > 0.0;
        let named = NAMES.iter().zip(variances.iter()).enumerate().filter(|(i, _)| asked(i));
        Self {
            point_mean_m: errors.iter().sum::<f64>() / errors.len().max(1) as f64,
            point_p95_m: p95.unwrap_or(f64::INFINITY),
            point_rms_m: (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt(),
            lag_s: covariance[(LAG, LAG)].sqrt(),
            parameters: named
                .map(|(_, ((name, unit, per_si), variance))| ExpectedParameter {
                    name,
                    unit,
                    sd: variance.sqrt() * per_si,
                })
                .collect(),
        }
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mean, p95, lag) = (self.point_mean_m * 1e3, self.point_p95_m * 1e3, self.lag_s * 1e3);
        write!(f, "{mean:.3} mm over the image, {p95:.3} mm at its 95th percentile, the lag {lag:.2} ms")
    }
}

/// Every standard error squared and every covariance; infinite where the information has a hole.
pub(super) fn covariance(information: &Information) -> Information {
    information.cholesky().map_or_else(|| Information::from_diagonal_element(f64::INFINITY), |c| c.inverse())
}

/// What is known before the first image.
pub(super) fn prior(options: &VisitOptions) -> Information {
    let scale = options.scale_sd.max(KNOWN_SCALE);
    // Of the image's plane nothing is known: 10 m and 10 rad only keep the matrix regular.
    let mut sd = Unknowns::repeat(10.0);
    sd[LAG] = LAG_SD_S;
    sd.fixed_rows_mut::<3>(LAG + 1).fill(options.place_sd_m);
    sd.fixed_rows_mut::<3>(LAG + 4).fill(options.place_sd_rad);
    sd.fixed_rows_mut::<2>(N - 2).fill(scale);
    Information::from_diagonal(&sd.map(|sd| sd.powi(-2)))
}

/// What the covariance is multiplied with to give the mean variance of a reconstructed point (m²).
pub(super) fn over_the_image(bench: &Bench<'_>) -> Information {
    grid(bench).fold(Information::zeros(), |sum, j| sum + j.transpose() * j) / (GRID * GRID) as f64
}

/// How points over the image move in Probe with the unknowns.
fn grid(bench: &Bench<'_>) -> impl Iterator<Item = SMatrix<f64, 3, N>> {
    let (probe_from_image, spacing) = (bench.probe_from_image, bench.setting.spacing);
    let [right, bottom] =
        [bench.size.0, bench.size.1].map(|n| n.saturating_sub(1) as f64 / (GRID - 1) as f64);
    (0..GRID * GRID).map(move |i| {
        let in_image = spacing.point((i % GRID) as f64 * right, (i / GRID) as f64 * bottom);
        let turn = probe_from_image.isometry().rotation;
        let mut jacobian = SMatrix::<f64, 3, N>::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        let about = -(probe_from_image * in_image).vector().cross_matrix();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&about);
        jacobian.set_column(N - 2, &(turn * Vector3::new(in_image.vector().x, 0.0, 0.0)));
        jacobian.set_column(N - 1, &(turn * Vector3::new(0.0, in_image.vector().y, 0.0)));
        jacobian
    })
}

/// The phantom as the probe would see it.
pub(super) struct View<'a> {
    bench: &'a Bench<'a>,
    options: &'a VisitOptions,
}

impl<'a> View<'a> {
    pub(super) const fn new(bench: &'a Bench<'a>, options: &'a VisitOptions) -> Self {
        Self { bench, options }
    }

    /// The wires that cut the window and whose dots stand alone, by index.
    pub(super) fn wires(&self, world_from_probe: &Pose<World, Probe>) -> Vec<usize> {
        let image_from_phantom =
            self.image_from_phantom(world_from_probe, &Vector3::zeros(), &Unknowns::zeros());
        let wires = self.bench.phantom.wires.iter().enumerate();
        let crossing = |(i, wire): (usize, &Wire)| {
            crossing(&image_from_phantom, wire)
                .filter(|(_, share)| (0.0..=1.0).contains(share))
                .map(|(at, _)| (i, at))
        };
        let dots: Vec<(usize, Vector2<f64>)> = wires.filter_map(crossing).collect();
        let [across, down] = self.options.apart_m;
        let merges = |at: &Vector2<f64>, other: &Vector2<f64>| {
            (at.x - other.x).abs() < across && (at.y - other.y).abs() < down
        };
        let alone = |(i, at): &&(usize, Vector2<f64>)| {
            dots.iter().all(|(other, place)| other == i || !merges(at, place))
        };
        dots.iter().filter(|(_, at)| self.inside(at)).filter(alone).map(|(i, _)| *i).collect()
    }

    /// Whether a dot there would be whole: its tails are three standard deviations of a point spread long.
    fn inside(&self, at: &Vector2<f64>) -> bool {
        const EDGE_M: [f64; 2] = [1.5e-3, 0.8e-3];
        let (size, spacing) = (self.bench.size, self.bench.setting.spacing);
        let (right, bottom) = (size.0 as f64 * spacing.x_m, size.1 as f64 * spacing.y_m);
        (EDGE_M[0]..=right - EDGE_M[0]).contains(&at.x) && (EDGE_M[1]..=bottom - EDGE_M[1]).contains(&at.y)
    }

    /// The information of the images at one pose, the arm's error shared among them.
    pub(super) fn at_rest(&self, world_from_probe: &Pose<World, Probe>) -> Information {
        let one = self.of_dots(world_from_probe, &Vector3::zeros());
        self.with_pose_error(one * self.options.images_per_pose as f64)
    }

    /// The information of images along a sweep (poses and velocities in Probe, m/s), one error of the arm for all.
    pub(super) fn moving(&self, images: &[(Pose<World, Probe>, Vector3<f64>)]) -> Information {
        let each = images.iter().map(|(pose, velocity)| self.of_dots(pose, velocity));
        self.with_pose_error(each.fold(Information::zeros(), |sum, one| sum + one))
    }

    /// An error of the arm's pose moves the dots as a motion of the image's plane does, so that it is the first six
    /// unknowns once more, of known spread, and is left out by the Schur complement.
    fn with_pose_error(&self, dots: Information) -> Information {
        let (m, rad) = (self.options.pose_sd_m.powi(-2), self.options.pose_sd_rad.powi(-2));
        let pose = SMatrix::<f64, 6, 6>::from_diagonal(&SVector::from([m, m, m, rad, rad, rad]));
        let inner = pose + dots.fixed_view::<6, 6>(0, 0);
        let across = dots.fixed_columns::<6>(0);
        inner.cholesky().map_or(dots, |inner| dots - across * inner.solve(&across.transpose()))
    }

    /// Σ Jᵀ D⁻¹ J over the dots of one image.
    fn of_dots(&self, world_from_probe: &Pose<World, Probe>, velocity: &Vector3<f64>) -> Information {
        let wires = self.wires(world_from_probe);
        let [across, along] = self.options.dot_sd_m.map(|sd| sd.powi(-2));
        let mut rows = vec![[Unknowns::zeros(); 2]; wires.len()];
        for unknown in 0..N {
            let [more, less] = [STEP, -STEP].map(|step| {
                let mut unknowns = Unknowns::zeros();
                unknowns[unknown] = step;
                self.dots(&wires, world_from_probe, velocity, &unknowns)
            });
            for ((row, more), less) in rows.iter_mut().zip(more).zip(less) {
                let slope = (more - less) / (2.0 * STEP);
                (row[0][unknown], row[1][unknown]) = (slope.x, slope.y);
            }
        }
        rows.iter().fold(Information::zeros(), |sum, [x, y]| {
            sum + x * x.transpose() * across + y * y.transpose() * along
        })
    }

    /// Where the wires are seen with these unknowns, in the image's plane (m by the stated size of a pixel).
    fn dots(
        &self,
        wires: &[usize],
        world_from_probe: &Pose<World, Probe>,
        velocity: &Vector3<f64>,
        unknowns: &Unknowns,
    ) -> Vec<Vector2<f64>> {
        let image_from_phantom = self.image_from_phantom(world_from_probe, velocity, unknowns);
        let larger = Vector2::new(1.0 + unknowns[N - 2], 1.0 + unknowns[N - 1]);
        let wires = wires.iter().filter_map(|i| self.bench.phantom.wires.get(*i));
        let seen =
            wires.map(|wire| crossing(&image_from_phantom, wire).map_or(Vector2::zeros(), |(at, _)| at));
        seen.map(|at| at.component_div(&larger)).collect()
    }

    fn image_from_phantom(
        &self,
        world_from_probe: &Pose<World, Probe>,
        velocity: &Vector3<f64>,
        unknowns: &Unknowns,
    ) -> Pose<Image, Phantom> {
        // FRAMES: small motions written in Probe (of the image's plane on it, and of the probe itself during the lag) and
        // in Phantom (of the phantom), as the unknowns are defined.
        let plane: Pose<Probe, Probe> = Pose::assume(motion(unknowns, 0));
        // FRAMES: as above.
        let late: Pose<Probe, Probe> = Pose::assume(Translation3::from(velocity * unknowns[LAG]).into());
        // FRAMES: as above.
        let place: Pose<Phantom, Phantom> = Pose::assume(motion(unknowns, LAG + 1));
        let world_from_image = *world_from_probe * late * plane * self.bench.probe_from_image;
        world_from_image.inverse() * self.bench.world_from_phantom * place
    }
}

fn motion(unknowns: &Unknowns, from: usize) -> Isometry3<f64> {
    let v = |i: usize| Vector3::new(unknowns[i], unknowns[i + 1], unknowns[i + 2]);
    Isometry3::from_parts(v(from).into(), UnitQuaternion::from_scaled_axis(v(from + 3)))
}

/// Where a wire's line cuts the image's plane (m), and at what share of the wire from front to back; none when it runs
/// along the plane.
fn crossing(image_from_phantom: &Pose<Image, Phantom>, wire: &Wire) -> Option<(Vector2<f64>, f64)> {
    let front = (*image_from_phantom * wire.front).vector();
    let back = (*image_from_phantom * wire.back).vector();
    let share = front.z / (front.z - back.z);
    share.is_finite().then(|| ((front + (back - front) * share).xy(), share))
}
