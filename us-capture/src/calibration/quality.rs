//! [`Quality`]: how good a calibration is, in the field's own measures, as it is stored with it.

use nalgebra::DMatrix;
use probepath_frames::{NamedPose, Phantom, Pose, World};
use serde::{Deserialize, Serialize};

use super::{BadCalibration, check};
use crate::errors::{Found, Repeatability, Summary};
use crate::fit::{Fit, Uncertainty};
use crate::point_spread::PointSpreadMm;

/// Depths that errors are kept apart for (m).
const BAND_M: f64 = 0.01;
/// Correlation matrices are positive to rounding within this.
const POSITIVE_WITHIN: f64 = 1e-6;

/// What is known of a calibration beside its pose. Every section may be missing: nobody measured it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// The program that calibrated, with its version.
    pub software: String,
    /// Images the fit used.
    pub images: usize,
    /// Dots the fit used.
    pub dots: usize,
    /// Standard error of a reconstructed point over the image, as the covariance promises it.
    pub standard_error: PromisedMm,
    /// Errors found on images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found: Option<FoundMm>,
    /// Repeatability, when several calibrations were made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeatability: Option<RepeatabilityMm>,
    /// The water the phantom stood in, when the scale was corrected by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water: Option<Water>,
    /// Where the phantom stood, as the fit found it: where a check looks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world_from_phantom: Option<NamedPose>,
    /// How wide the image of a point is, where the wires told it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_spread: Option<PointSpreadMm>,
    /// The covariance of what was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Covariance>,
}

/// Standard error of a reconstructed point over the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PromisedMm {
    /// Its mean (mm).
    pub mean_mm: f64,
    /// What 95 % of the image stays below (mm).
    pub p95_mm: f64,
}

/// Errors as FIELD.md section 2 defines them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundMm {
    /// Whether the fit had not seen these images.
    pub held_out: bool,
    /// Of all depths.
    pub all: ErrorsMm,
    /// Depth by depth, from the first row down.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub depths: Vec<DepthMm>,
}

/// The errors of some dots. Without middle wires there is only the distance from the wires.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorsMm {
    /// Middle wires seen with both their sides.
    pub mids: usize,
    /// Mean of the best 95 % of their errors (mm).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_mean95_mm: Option<f64>,
    /// Standard deviation of the best 95 % (mm).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_sd95_mm: Option<f64>,
    /// Root mean square of all (mm).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mid_rms_mm: Option<f64>,
    /// Dots of any wire.
    pub lines: usize,
    /// Root mean square distance from their wires (mm).
    pub line_rms_mm: f64,
}

/// The errors of the dots at some depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthMm {
    /// From this depth under the image's first row (mm).
    pub from_mm: f64,
    /// To this (mm).
    pub to_mm: f64,
    /// The errors there.
    pub errors: ErrorsMm,
}

/// How well calibrations repeat.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RepeatabilityMm {
    /// Calibrations that were compared.
    pub calibrations: usize,
    /// Points that were.
    pub points: usize,
    /// C_rms ([P1] section II.B, with the root where it belongs) (mm).
    pub c_rms_mm: f64,
    /// The plain mean distance (mm).
    pub mean_mm: f64,
}

/// The water of the phantom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Water {
    /// Its temperature (degrees Celsius).
    pub temperature_celsius: f64,
    /// Speed of sound in it (m/s).
    pub speed_of_sound_m_s: f64,
    /// The speed that the machine assumes (m/s).
    pub assumed_m_s: f64,
}

/// A covariance with the names and units of what it is about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// Names, in the order of the rows (`image_turn_x`, …: [`Parameter`](crate::fit::Parameter)).
    pub parameters: Vec<String>,
    /// Their units: `rad`, `m`, `s` or `1`.
    pub units: Vec<String>,
    /// The matrix, row by row; an entry has the product of its row's and its column's unit.
    pub rows: Vec<Vec<f64>>,
}

impl Quality {
    /// Of a fit, for an image of `width` x `height` pixels, with nothing measured yet.
    pub fn of(fit: &Fit, (width, height): (usize, usize)) -> Self {
        let map = fit.uncertainty.standard_error_map(width, height);
        Self {
            software: concat!("probepath ", env!("CARGO_PKG_VERSION")).into(),
            images: fit.images,
            dots: fit.dots,
            standard_error: PromisedMm { mean_mm: map.mean_m() * 1e3, p95_mm: map.p95_m() * 1e3 },
            found: None,
            repeatability: None,
            water: None,
            world_from_phantom: Some(NamedPose::from(&fit.world_from_phantom)),
            point_spread: None,
            covariance: Some(Covariance::of(&fit.uncertainty)),
        }
    }

    pub(super) fn check(&self) -> Result<(), BadCalibration> {
        let mut numbers = vec![
            ("quality.standard_error.mean_mm", self.standard_error.mean_mm),
            ("quality.standard_error.p95_mm", self.standard_error.p95_mm),
        ];
        if let Some(found) = &self.found {
            numbers.extend(found.all.numbers("quality.found.all"));
            for depth in &found.depths {
                numbers.extend(depth.errors.numbers("quality.found.depths"));
                numbers.push(("quality.found.depths.from_mm", depth.from_mm));
                numbers.push(("quality.found.depths.to_mm", depth.to_mm - depth.from_mm));
            }
        }
        if let Some(repeat) = &self.repeatability {
            numbers.push(("quality.repeatability.c_rms_mm", repeat.c_rms_mm));
            numbers.push(("quality.repeatability.mean_mm", repeat.mean_mm));
        }
        for (field, number) in numbers {
            check(number.is_finite() && number >= 0.0, field, number, "zero or more")?;
        }
        if let Some(water) = &self.water {
            water.check()?;
        }
        for (field, number, least) in self.point_spread.iter().flat_map(PointSpreadMm::numbers) {
            let (good, wanted) = least.holds(number);
            check(good, field, number, wanted)?;
        }
        self.place()?;
        self.covariance.as_ref().map_or(Ok(()), Covariance::check)
    }

    /// Where the phantom stood when this was calibrated; `None` in an older file.
    ///
    /// # Errors
    /// When what is stored is between other systems, or no pose.
    pub fn place(&self) -> Result<Option<Pose<World, Phantom>>, BadCalibration> {
        let place = self.world_from_phantom.as_ref().map(NamedPose::check::<World, Phantom>);
        place.transpose().map_err(BadCalibration::Place)
    }
}

impl FoundMm {
    /// Of the errors found on images, `held_out` when the fit had not seen them. `None` when no dot was judged.
    pub fn of(found: &Found, held_out: bool) -> Option<Self> {
        let depth = |(from_m, found): &(f64, Found)| {
            let (from_mm, to_mm) = (from_m.max(0.0) * 1e3, (from_m + BAND_M).max(0.0) * 1e3);
            Some(DepthMm { from_mm, to_mm, errors: ErrorsMm::of(found)? })
        };
        let depths = found.by_depth(BAND_M).iter().filter_map(depth).collect();
        Some(Self { held_out, all: ErrorsMm::of(found)?, depths })
    }
}

impl ErrorsMm {
    fn of(found: &Found) -> Option<Self> {
        let (mid, line): (Summary, Summary) = (found.mid(), found.line());
        let some = |number_m: f64| number_m.is_finite().then_some(number_m * 1e3);
        Some(Self {
            mids: mid.count,
            mid_mean95_mm: some(mid.mean95_m),
            mid_sd95_mm: some(mid.sd95_m),
            mid_rms_mm: some(mid.rms_m),
            lines: line.count,
            line_rms_mm: some(line.rms_m)?,
        })
    }

    fn numbers(&self, field: &'static str) -> Vec<(&'static str, f64)> {
        let mids = [self.mid_mean95_mm, self.mid_sd95_mm, self.mid_rms_mm];
        let all = mids.into_iter().flatten().chain([self.line_rms_mm]);
        all.map(|number| (field, number)).collect()
    }
}

impl RepeatabilityMm {
    /// Of so many calibrations.
    pub fn of(calibrations: usize, repeat: &Repeatability) -> Self {
        let (c_rms_mm, mean_mm) = (repeat.rms_m * 1e3, repeat.mean_m * 1e3);
        Self { calibrations, points: repeat.count, c_rms_mm, mean_mm }
    }
}

impl Water {
    fn check(&self) -> Result<(), BadCalibration> {
        let (celsius, field) = (self.temperature_celsius, "quality.water.temperature_celsius");
        check((0.0..=100.0).contains(&celsius), field, celsius, "between 0 and 100")?;
        for (field, speed) in [
            ("quality.water.speed_of_sound_m_s", self.speed_of_sound_m_s),
            ("quality.water.assumed_m_s", self.assumed_m_s),
        ] {
            check((1000.0..=2000.0).contains(&speed), field, speed, "between 1000 and 2000")?;
        }
        Ok(())
    }
}

impl Covariance {
    /// Of a fit's parameters.
    pub fn of(uncertainty: &Uncertainty) -> Self {
        let matrix = &uncertainty.covariance;
        // Symmetric to the bit: the products that made it are not.
        let entry = |i: usize, k: usize| (matrix[(i, k)] + matrix[(k, i)]) / 2.0;
        let size = matrix.nrows();
        Self {
            parameters: uncertainty.parameters.iter().map(|p| p.name.into()).collect(),
            units: uncertainty.parameters.iter().map(|p| p.unit.into()).collect(),
            rows: (0..size).map(|i| (0..size).map(|k| entry(i, k)).collect()).collect(),
        }
    }

    /// The part about these parameters, in this order; zero for what was not fitted, because it was known.
    pub fn about(&self, names: &[&str]) -> DMatrix<f64> {
        let index = |name: &str| self.parameters.iter().position(|p| p == name);
        let at: Vec<Option<usize>> = names.iter().map(|name| index(name)).collect();
        let entry = |i: Option<usize>, k: Option<usize>| Some(*self.rows.get(i?)?.get(k?)?);
        DMatrix::from_fn(names.len(), names.len(), |i, k| entry(at[i], at[k]).unwrap_or_default())
    }

    fn check(&self) -> Result<(), BadCalibration> {
        let wrong = |why: String| BadCalibration::Covariance { why };
        let size = self.parameters.len();
        let square = self.rows.len() == size && self.rows.iter().all(|row| row.len() == size);
        if !square || self.units.len() != size {
            let (units, rows) = (self.units.len(), self.rows.len());
            return Err(wrong(format!(
                "{size} parameters need as many units and a square of as many rows; it has {units} units, {rows} rows"
            )));
        }
        for (i, name) in self.parameters.iter().enumerate() {
            if self.parameters.iter().skip(i + 1).any(|other| other == name) {
                return Err(wrong(format!("{name} is there twice")));
            }
        }
        if let Some(unit) = self.units.iter().find(|u| !["rad", "m", "s", "1"].contains(&u.as_str())) {
            return Err(wrong(format!("unit {unit:?} is none of rad, m, s, 1")));
        }
        self.check_matrix().map_err(wrong)
    }

    /// Finite, symmetric, and the square of something.
    fn check_matrix(&self) -> Result<(), String> {
        let names: Vec<&str> = self.parameters.iter().map(String::as_str).collect();
        let matrix = self.about(&names);
        let sd = |i: usize| matrix[(i, i)].max(0.0).sqrt();
        for (i, name) in names.iter().enumerate() {
            if !(matrix[(i, i)].is_finite() && matrix[(i, i)] >= 0.0) {
                return Err(format!("the variance of {name} is {}", matrix[(i, i)]));
            }
            for (k, other) in names.iter().enumerate().skip(i + 1) {
                let (one, two) = (matrix[(i, k)], matrix[(k, i)]);
                let within = 1e-9 * sd(i) * sd(k);
                if !(one.is_finite() && (one - two).abs() <= within) {
                    return Err(format!("{name} with {other} is {one}, the other way round {two}"));
                }
            }
        }
        let unit =
            |i: usize, k: usize| if sd(i) * sd(k) > 0.0 { matrix[(i, k)] / (sd(i) * sd(k)) } else { 0.0 };
        let correlation = DMatrix::from_fn(names.len(), names.len(), unit);
        let least = correlation.symmetric_eigenvalues().iter().copied().fold(0.0, f64::min);
        if least < -POSITIVE_WITHIN {
            return Err(format!("its correlations have an eigenvalue of {least:.3e}: no errors have those"));
        }
        Ok(())
    }
}
