//! [`ErrorBudget`]: what is known of the errors behind a scan.

use nalgebra::SMatrix;
use probepath_us_capture::Calibration;
use serde::{Deserialize, Serialize};

use super::tracking::Tracking;
use crate::ReconError;

/// Parameters of a calibration that an area hangs on.
pub(crate) const PARAMETERS: usize = 10;
/// Which of them shift the image on the probe.
const SHIFTS: std::ops::Range<usize> = 3..6;

/// What is known of the errors behind a scan: what its calibration, its poses and its contours are off by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ErrorBudget {
    /// Covariance of the calibration's errors, in the order of [`ErrorBudget::PARAMETERS`]; an entry has the product
    /// of both units.
    pub calibration: [[f64; PARAMETERS]; PARAMETERS],
    /// Standard deviation of an image's place, beside what all images share (m).
    pub pose_sd_m: f64,
    /// Standard deviation of its orientation (rad).
    pub pose_sd_rad: f64,
    /// Along this much of the path a pose's error stays the same (m); zero: every image has its own.
    pub pose_shared_m: f64,
    /// Standard deviation of a shift of the border that all contours share, beside what they state themselves (m).
    pub border_sd_m: f64,
}

impl Default for ErrorBudget {
    /// Nothing is known of the calibration: half a millimetre. Nor of what tracked the probe: each pose to 0.1 mm.
    fn default() -> Self {
        Self::unfitted(0.5e-3)
    }
}

fn diagonal(sd: [f64; PARAMETERS]) -> [[f64; PARAMETERS]; PARAMETERS] {
    std::array::from_fn(|i| std::array::from_fn(|k| if i == k { sd[i] * sd[i] } else { 0.0 }))
}

impl ErrorBudget {
    /// The calibration's parameters, as [`probepath_us_capture::fit::Parameter`] names and defines them: turns in the
    /// Image's axes about its origin (rad), shifts in the Probe's axes (m), factors on a column's and a row's size,
    /// shear (rad), lag (s).
    pub const PARAMETERS: [&str; PARAMETERS] = [
        "image_turn_x",
        "image_turn_y",
        "image_turn_z",
        "image_shift_x",
        "image_shift_y",
        "image_shift_z",
        "column_scale",
        "row_scale",
        "shear",
        "lag",
    ];

    /// With what a calibration says of itself: its covariance, or, where nobody fitted it, its error in millimetres.
    /// A parameter that a fit held fast was known: its error is zero. The speed of sound in the tissue is taken to be
    /// what the machine assumes.
    pub fn of(calibration: &Calibration) -> Self {
        let covariance = calibration.quality.as_ref().and_then(|quality| quality.covariance.as_ref());
        let Some(covariance) = covariance else { return Self::unfitted(calibration.error.rms_mm * 1e-3) };
        let about = covariance.about(&Self::PARAMETERS);
        let calibration = std::array::from_fn(|i| std::array::from_fn(|k| about[(i, k)]));
        Self { calibration, ..Self::default() }
    }

    /// A calibration of which only its error is known (m): as a shift, as a turn over the depth of an artery, and
    /// pixels of the size that the machine says to 0.2 %, a lag to 5 ms.
    fn unfitted(error_m: f64) -> Self {
        let (shift, turn) = (error_m, error_m / 0.04);
        let sd = [turn, turn, turn, shift, shift, shift, 2e-3, 2e-3, 0.0, 5e-3];
        Self {
            calibration: diagonal(sd),
            pose_sd_m: 0.1e-3,
            pose_sd_rad: 1e-3,
            pose_shared_m: 5e-3,
            border_sd_m: 0.0,
        }
    }

    /// With the errors of what tracked the probe. What it is off by all along a scan moves every image alike, as an
    /// error of the image's place on the probe would, and comes on top of it: a calibration made with the same arm
    /// bears the arm's error where it was made, in another posture.
    #[must_use]
    pub fn tracked_by(mut self, tracking: &Tracking) -> Self {
        for shift in SHIFTS {
            self.calibration[shift][shift] += 2.0 * tracking.place_sd_m().powi(2);
        }
        Self { pose_sd_m: tracking.pose_sd_m(), ..self }
    }

    /// Whether every number can be worked with.
    pub(crate) fn check(&self) -> Result<(), ReconError> {
        let lengths = [
            ("errors.pose_sd_m", self.pose_sd_m),
            ("errors.pose_sd_rad", self.pose_sd_rad),
            ("errors.pose_shared_m", self.pose_shared_m),
            ("errors.border_sd_m", self.border_sd_m),
        ];
        let variances = (0..PARAMETERS).map(|k| ("errors.calibration", self.calibration[k][k]));
        for (name, value) in lengths.into_iter().chain(variances) {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ReconError::Setting { name, value, must: "must be zero or more" });
            }
        }
        self.check_covariance()
    }

    fn check_covariance(&self) -> Result<(), ReconError> {
        let must = "must be symmetric and no larger than its variances allow";
        for i in 0..PARAMETERS {
            for k in 0..i {
                let (one, two) = (self.calibration[i][k], self.calibration[k][i]);
                let most = (self.calibration[i][i] * self.calibration[k][k]).sqrt();
                // Written so that NaN is refused as well.
                if !((one - two).abs() <= 1e-6 * most && one.abs() <= most * (1.0 + 1e-6)) {
                    return Err(ReconError::Setting { name: "errors.calibration", value: one, must });
                }
            }
        }
        Ok(())
    }

    /// The calibration's errors as independent causes of standard deviation one.
    pub(super) fn causes(&self) -> Causes {
        // In units of each parameter's own standard deviation: radians and metres differ by orders of magnitude.
        let sd: [f64; PARAMETERS] = std::array::from_fn(|k| self.calibration[k][k].max(0.0).sqrt());
        let unit = |i: usize, k: usize| {
            if sd[i] * sd[k] > 0.0 { self.calibration[i][k] / (sd[i] * sd[k]) } else { 0.0 }
        };
        let eigen = SMatrix::<f64, PARAMETERS, PARAMETERS>::from_fn(unit).symmetric_eigen();
        Causes(SMatrix::from_fn(|k, cause| {
            sd[k] * eigen.eigenvectors[(k, cause)] * eigen.eigenvalues[cause].max(0.0).sqrt()
        }))
    }

    /// A root of the calibration's covariance: normal numbers times this are errors of it.
    #[cfg(test)]
    pub(crate) fn root(&self) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
        self.causes().0
    }

    /// How many independent poses images `spacing` m apart have along `length` m.
    pub(super) fn poses_in(&self, length: f64, spacing: f64) -> f64 {
        (length / spacing.max(self.pose_shared_m).max(1e-6)).max(1.0)
    }
}

/// A square root of a covariance: column by column the parameters' errors that one independent cause makes.
pub(super) struct Causes(pub(super) SMatrix<f64, PARAMETERS, PARAMETERS>);

impl Causes {
    /// What each cause does, when each parameter does `gradient`.
    pub(super) fn along(&self, gradient: [f64; PARAMETERS]) -> [f64; PARAMETERS] {
        let gradient = nalgebra::SVector::<f64, PARAMETERS>::from(gradient);
        (self.0.transpose() * gradient).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_causes_make_the_covariance() {
        let mut budget = ErrorBudget::default();
        (budget.calibration[0][4], budget.calibration[4][0]) = (3e-6, 3e-6);
        let causes = budget.causes().0;
        let product = causes * causes.transpose();
        for i in 0..PARAMETERS {
            for k in 0..PARAMETERS {
                let scale = (budget.calibration[i][i] * budget.calibration[k][k]).sqrt();
                assert!((product[(i, k)] - budget.calibration[i][k]).abs() <= 1e-12 * scale.max(1e-12));
            }
        }
    }

    #[test]
    fn an_arm_that_is_off_shifts_all_images_and_leaves_turns_and_sizes_alone() {
        let calibrated = ErrorBudget::default();
        let tracked =
            calibrated.clone().tracked_by(&Tracking { accuracy_m: 0.5e-3, repeatability_m: 0.1e-3 });
        for k in 0..PARAMETERS {
            let added = tracked.calibration[k][k] - calibrated.calibration[k][k];
            let expected = if SHIFTS.contains(&k) { 2.0 * (0.5e-3_f64 / 1.5958).powi(2) } else { 0.0 };
            assert!((added - expected).abs() < 1e-11, "{k}: {added}");
        }
        assert!((tracked.pose_sd_m - 0.1e-3 / 3.616).abs() < 1e-8, "{}", tracked.pose_sd_m);
        assert_eq!(tracked.check(), Ok(()));
    }

    #[test]
    fn a_budget_that_no_errors_have_is_refused() {
        assert_eq!(ErrorBudget::default().check(), Ok(()));
        let mut larger = ErrorBudget::default();
        (larger.calibration[0][1], larger.calibration[1][0]) = (1.0, 1.0);
        let nan = ErrorBudget { pose_sd_m: f64::NAN, ..ErrorBudget::default() };
        let mut lopsided = ErrorBudget::default();
        lopsided.calibration[2][1] = 1e-6;
        for budget in [larger, nan, lopsided] {
            assert!(matches!(budget.check(), Err(ReconError::Setting { .. })), "{budget:?}");
        }
    }
}
