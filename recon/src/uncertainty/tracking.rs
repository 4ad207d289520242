//! [`Tracking`]: how well whatever tracked the probe knew where it was.

/// How well whatever tracked the probe (an arm, a camera) knew where it was, as its data sheet says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracking {
    /// Mean distance between where the probe is and where it is said to be, over the workspace (m).
    pub accuracy_m: f64,
    /// Mean plus three standard deviations of the distance to the mean place when a pose is reached again (m; the pose
    /// repeatability of ISO 9283).
    pub repeatability_m: f64,
}

/// Of the length of a vector whose three components are normal, of standard deviation one (Maxwell's distribution): the
/// mean, `sqrt(8 / pi)`, and the standard deviation, `sqrt(3 - 8 / pi)`.
const MEAN_LENGTH: f64 = 1.595_769_121_605_731;
const SD_LENGTH: f64 = 0.673_440_246_353_797;

impl Tracking {
    /// Standard deviation, along each axis, of what all poses of a scan are off by (m).
    pub(super) fn place_sd_m(&self) -> f64 {
        self.accuracy_m / MEAN_LENGTH
    }

    /// Standard deviation, along each axis, of what a pose is off by beside that (m).
    pub(super) fn pose_sd_m(&self) -> f64 {
        self.repeatability_m / (MEAN_LENGTH + 3.0 * SD_LENGTH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::Dice;

    #[test]
    fn a_data_sheet_s_figures_come_back_from_the_errors_they_stand_for() {
        let tracking = Tracking { accuracy_m: 0.6e-3, repeatability_m: 0.2e-3 };
        let mut dice = Dice(1);
        let count = 40_000_u32;
        let mut lengths = |sd: f64| -> (f64, f64) {
            let mut normal = || sd * dice.normal_pair().0;
            let mut length = || normal().hypot(normal()).hypot(normal());
            let (sum, squares) = (0..count).fold((0.0, 0.0), |(sum, squares), _| {
                let length: f64 = length();
                (sum + length, squares + length * length)
            });
            let mean = sum / f64::from(count);
            (mean, (squares / f64::from(count) - mean * mean).sqrt())
        };
        let (accuracy, _) = lengths(tracking.place_sd_m());
        let (mean, sd) = lengths(tracking.pose_sd_m());
        assert!((accuracy / tracking.accuracy_m - 1.0).abs() < 0.01, "{accuracy}");
        assert!(((mean + 3.0 * sd) / tracking.repeatability_m - 1.0).abs() < 0.01, "{mean} {sd}");
    }
}
