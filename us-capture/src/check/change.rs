//! How far the image has moved in the probe, over the whole image.

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, Vector3};

use super::{CheckError, CheckOptions, Verdict};
use crate::fit::{self, Fit, Parameter};
use crate::{Calibration, Covariance, PixelSpacing, Setting};

/// Points of the comparison on each side of the image.
const GRID: u32 = 9;
/// The pose's six numbers as the fit names them, and what the first row's depth hangs on.
const NAMES: [&str; 7] = [
    "image_turn_x",
    "image_turn_y",
    "image_turn_z",
    "image_shift_x",
    "image_shift_y",
    "image_shift_z",
    "row_scale",
];
/// Standard errors that make a difference one.
const CLEAR: f64 = 3.0;
/// The same for the lag: the few images of a weak scan state their errors with heavy tails (at three, 2 of 75 such
/// scans gave a false alarm).
const CLEAR_LAG: f64 = 4.0;

/// How far the image is from where it was calibrated: the scan's answer less the stored calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// How far the worst pixel's point has moved in the probe (m).
    pub worst_m: f64,
    /// That pixel (column, row).
    pub worst_px: [f64; 2],
    /// Standard error of that distance, of both calibrations together (m).
    pub worst_error_m: f64,
    /// Mean distance over the image (m).
    pub mean_m: f64,
    /// How far the middle of the image has moved, in the probe's axes (m).
    pub shift_m: Vector3<f64>,
    /// Standard errors of that.
    pub shift_error_m: Vector3<f64>,
    /// How the image has turned: a rotation vector in the probe's axes (rad).
    pub turn_rad: Vector3<f64>,
    /// Standard errors of that.
    pub turn_error_rad: Vector3<f64>,
    /// By how much the lag changed, and the standard error of that (s); `None` when the scan tells no lag.
    pub lag_s: Option<(f64, f64)>,
    /// The chance of such a difference of the poses when nothing moved.
    pub chance: f64,
    /// The largest standard error of any point of the image in any direction (m).
    pub blur_m: f64,
    /// Height of a row in this scan over the calibration's: below one in water.
    pub row_scale: f64,
}

impl Change {
    pub(super) fn of(calibration: &Calibration, fit: &Fit, size: (usize, usize)) -> Result<Self, CheckError> {
        let difference = Difference::of(calibration, fit)?;
        let points: Vec<([f64; 2], Vector3<f64>)> = grid(size).map(|at| (at, difference.moved(at))).collect();
        let mean_m = points.iter().map(|(_, m)| m.norm()).sum::<f64>() / points.len().max(1) as f64;
        let worst = points.iter().max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()));
        let (worst_px, worst) = worst.copied().unwrap_or_default();
        let along = worst.try_normalize(1e-12).unwrap_or_else(Vector3::x);
        let blurs = grid(size).map(|at| difference.covariance_at(at).symmetric_eigenvalues().max());
        let centre = [size.0 as f64 / 2.0, size.1 as f64 / 2.0];
        let (turn_rad, turn_error_rad) = difference.turn_in_probe();
        Ok(Self {
            worst_m: worst.norm(),
            worst_px,
            worst_error_m: root((along.transpose() * difference.covariance_at(worst_px) * along).x),
            mean_m,
            shift_m: difference.moved(centre),
            shift_error_m: difference.covariance_at(centre).diagonal().map(root),
            turn_rad,
            turn_error_rad,
            lag_s: lag_moved(calibration, fit),
            chance: difference.chance()?,
            blur_m: root(blurs.fold(0.0, f64::max)),
            row_scale: fit.spacing.y_m / calibration.setting.spacing.y_m,
        })
    }

    /// Whether the lag changed, clearly and by more than is allowed.
    pub(super) fn is_late(&self, options: &CheckOptions) -> bool {
        self.lag_s.is_some_and(|(moved, error)| {
            moved.abs() > options.lag_tolerance.seconds() && moved.abs() > CLEAR_LAG * error
        })
    }

    /// Whether the image moved, clearly and by more than is allowed.
    pub(super) fn is_elsewhere(&self, options: &CheckOptions) -> bool {
        let clear = self.chance < options.false_alarm && self.worst_m > CLEAR * self.worst_error_m;
        clear && self.worst_m > options.tolerance_m
    }

    /// What holds is surely not off by twice the tolerance.
    pub(super) fn verdict(&self, options: &CheckOptions) -> Verdict {
        let allowed = options.tolerance_m;
        if self.is_elsewhere(options) || self.is_late(options) {
            Verdict::Moved
        } else if self.worst_m <= allowed && self.worst_m + CLEAR * self.blur_m <= 2.0 * allowed {
            Verdict::Holds
        } else {
            Verdict::CannotTell
        }
    }
}

fn root(variance: f64) -> f64 {
    variance.max(0.0).sqrt()
}

/// What the scan says less what was stored, and the covariance of that.
struct Difference {
    stored: Isometry3<f64>,
    found: Isometry3<f64>,
    spacing: PixelSpacing,
    /// Turn in the image's axes, shift in the probe's.
    covariance: SMatrix<f64, 6, 6>,
}

impl Difference {
    fn of(calibration: &Calibration, fit: &Fit) -> Result<Self, CheckError> {
        let stored = *calibration.probe_from_image.isometry();
        let kept = calibration.quality.as_ref().and_then(|q| q.covariance.as_ref());
        // What was stored is for tissue already; its own rows' error came into its shift when that was made.
        let before = kept.map_or_else(SMatrix::zeros, seven);
        let (found, by) = in_tissue(calibration, fit);
        let after = by * seven(&Covariance::of(&fit.uncertainty)) * by.transpose();
        let covariance = before.fixed_view::<6, 6>(0, 0) + after;
        let spacing = calibration.setting.spacing;
        if covariance.iter().all(|c| c.is_finite()) && found.translation.vector.iter().all(|x| x.is_finite())
        {
            return Ok(Self { stored, found, spacing, covariance });
        }
        Err(CheckError::Covariance)
    }

    /// How far a pixel's point has moved in the probe (m).
    fn moved(&self, at: [f64; 2]) -> Vector3<f64> {
        let point = self.spacing.point(at[0], at[1]).vector();
        (self.found * nalgebra::Point3::from(point)) - (self.stored * nalgebra::Point3::from(point))
    }

    fn covariance_at(&self, at: [f64; 2]) -> Matrix3<f64> {
        let turn = self.stored.rotation.to_rotation_matrix().into_inner();
        let point = self.spacing.point(at[0], at[1]).vector();
        let mut by = SMatrix::<f64, 3, 6>::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-turn * point.cross_matrix()));
        by.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        by * self.covariance * by.transpose()
    }

    /// In the image's axes (rad).
    fn turn(&self) -> Vector3<f64> {
        (self.stored.rotation.inverse() * self.found.rotation).scaled_axis()
    }

    fn turn_in_probe(&self) -> (Vector3<f64>, Vector3<f64>) {
        let turn = self.stored.rotation.to_rotation_matrix().into_inner();
        let covariance = turn * self.covariance.fixed_view::<3, 3>(0, 0) * turn.transpose();
        (turn * self.turn(), covariance.diagonal().map(root))
    }

    /// The chance of a chi square as large, exact for six degrees of freedom.
    fn chance(&self) -> Result<f64, CheckError> {
        let (turn, shift) = (self.turn(), self.found.translation.vector - self.stored.translation.vector);
        let step = SVector::<f64, 6>::from([turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]);
        // In units of each number's own error, so that radians and metres are alike.
        let unit = self.covariance.diagonal().map(f64::sqrt);
        let scaled = SMatrix::<f64, 6, 6>::from_fn(|i, k| self.covariance[(i, k)] / (unit[i] * unit[k]));
        let root = scaled.cholesky().ok_or(CheckError::Covariance)?;
        let step = step.component_div(&unit);
        let half = step.dot(&root.solve(&step)) / 2.0;
        Ok((-half).exp() * (1.0 + half + half * half / 2.0))
    }
}

fn seven(covariance: &Covariance) -> SMatrix<f64, 7, 7> {
    let about = covariance.about(&NAMES);
    SMatrix::from_fn(|i, k| about[(i, k)])
}

/// The scan's image as it lies in tissue, with the stored spacing, and its derivatives by the fit's numbers.
///
/// In water sound is slower than the machine takes it to be, so that the first row was less deep under the face, in the
/// ratio of the rows' sizes. In the stored calibration's own medium the ratio is one, and nothing changes.
fn in_tissue(calibration: &Calibration, fit: &Fit) -> (Isometry3<f64>, SMatrix<f64, 6, 7>) {
    let first_row_m = fit::first_row_m(&calibration.setting);
    let deeper = deeper(&calibration.setting, fit.spacing);
    let found = *fit.probe_from_image.isometry();
    let turn = found.rotation.to_rotation_matrix().into_inner();
    let mut by = SMatrix::<f64, 6, 7>::identity();
    by.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-turn * deeper.cross_matrix()));
    by.fixed_view_mut::<3, 1>(3, 6).copy_from(&(turn * Vector3::y() * -first_row_m));
    (found * Translation3::from(deeper), by)
}

/// By how much the first row lies deeper with the setting's rows than with those that are shown, along the rows.
pub(super) fn deeper(setting: &Setting, shown: PixelSpacing) -> Vector3<f64> {
    Vector3::y() * fit::deeper_in_tissue_m(shown, setting)
}

fn grid((width, height): (usize, usize)) -> impl Iterator<Item = [f64; 2]> {
    let step = |pixels: usize| pixels.saturating_sub(1) as f64 / f64::from(GRID - 1);
    let (x, y) = (step(width), step(height));
    (0..GRID * GRID).map(move |k| [f64::from(k % GRID) * x, f64::from(k / GRID) * y])
}

fn lag_moved(calibration: &Calibration, fit: &Fit) -> Option<(f64, f64)> {
    let after = fit.uncertainty.standard_error_of(Parameter::LAG)?;
    let kept = calibration.quality.as_ref().and_then(|q| q.covariance.as_ref());
    let before = kept.map_or(0.0, |covariance| covariance.about(&[Parameter::LAG.name])[(0, 0)]);
    Some((fit.lag.seconds() - calibration.image_lag.seconds(), after.hypot(root(before))))
}
