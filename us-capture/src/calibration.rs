//! [`Calibration`]: where the image's plane is in the probe, for one setting of the machine, with its error.

mod quality;
mod setting_mm;

use std::fs;
use std::path::Path;
use std::sync::Arc;

use probepath_frames::{FrameError, Image, NamedPose, Pose, Probe, Span};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Setting;
pub use quality::{Covariance, DepthMm, ErrorsMm, FoundMm, PromisedMm, Quality, RepeatabilityMm, Water};
pub use setting_mm::SettingMm;

/// Settings that differ by less than this (m) are the same: a file prints what a machine rounds.
const SAME_LENGTH_M: f64 = 1e-6;
/// Pixel spacings that differ by less than this part of themselves are the same: 0.05 mm over 640 columns of 0.1 mm.
const SAME_SPACING: f64 = 1e-3;

/// A spatial and temporal calibration. It belongs to one setting of depth, focus and zoom ([P1], section II.D), and
/// travels with its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Its id, as the exam and the report name it.
    pub id: String,
    /// When it was made (ISO 8601).
    pub date: String,
    /// The phantom it was made on.
    pub phantom: String,
    /// Where the image's plane is.
    pub probe_from_image: Pose<Probe, Image>,
    /// The setting it belongs to, with the size of a pixel.
    pub setting: Setting,
    /// A B-scan stamped t was formed at t + lag by the arm's clock (FIELD.md, section 2): negative for a machine that
    /// stamps its images late.
    pub image_lag: Span,
    /// How good it is.
    pub error: CalibrationError,
    /// All that is known of that; `None` for a calibration that nobody fitted, or of an older file.
    pub quality: Option<Quality>,
}

/// How good a calibration is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationError {
    /// Root mean square distance of the fiducials from where they should be (mm).
    pub rms_mm: f64,
    /// Standard deviation of these distances (mm).
    pub sd_mm: f64,
    /// Whether they were measured on images that the calibration had not seen.
    pub held_out: bool,
}

/// A calibration that cannot be read, written or used.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum BadCalibration {
    /// The file cannot be read or written.
    #[error("calibration {path}: {source}")]
    File {
        /// The file.
        path: String,
        /// The cause.
        source: Arc<std::io::Error>,
    },
    /// The text is not a calibration.
    #[error("not a calibration: {why}")]
    Text {
        /// What is wrong, with line and column where they are known.
        why: String,
    },
    /// The pose is not one, or between other systems.
    #[error("the calibration's probe_from_image: {0}")]
    Pose(#[from] FrameError),
    /// The phantom's place is none, or between other systems.
    #[error("the calibration's quality.world_from_phantom: {0}")]
    Place(FrameError),
    /// A number that no calibration can have.
    #[error("the calibration's {field} is {found}; it has to be {wanted}")]
    Number {
        /// The field.
        field: &'static str,
        /// What is there.
        found: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// The covariance is none.
    #[error("the calibration's covariance: {why}")]
    Covariance {
        /// What is wrong.
        why: String,
    },
    /// The machine is set differently.
    #[error(
        "calibration {id} belongs to another setting: {differences}; \
         set the machine as it was calibrated, or calibrate this setting"
    )]
    OtherSetting {
        /// The calibration.
        id: String,
        /// What differs, in mm.
        differences: String,
    },
}

/// The file's layout: units in the names.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Layout {
    id: String,
    date: String,
    phantom: String,
    image_lag_ms: f64,
    // Before the sections that have to be there: a file that is cut short is never read as one without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    quality: Option<Quality>,
    probe_from_image: NamedPose,
    setting: SettingMm,
    error: CalibrationError,
}

impl Calibration {
    /// The calibration of a TOML text.
    ///
    /// # Errors
    /// When it is not one: a field missing, unknown or of the wrong kind (with line and column), a pose between other
    /// systems or not rigid, a length that is not positive.
    pub fn from_toml(text: &str) -> Result<Self, BadCalibration> {
        let layout: Layout =
            toml::from_str(text).map_err(|error| BadCalibration::Text { why: error.to_string() })?;
        let calibration = Self {
            probe_from_image: layout.probe_from_image.check()?,
            setting: layout.setting.metres(),
            image_lag: lag(layout.image_lag_ms)?,
            id: layout.id,
            date: layout.date,
            phantom: layout.phantom,
            error: layout.error,
            quality: layout.quality,
        };
        calibration.check_numbers()?;
        Ok(calibration)
    }

    /// The TOML text that [`Calibration::from_toml`] reads back, lengths to the last digit of a double.
    ///
    /// # Errors
    /// When a number is one that no calibration can have.
    pub fn to_toml(&self) -> Result<String, BadCalibration> {
        self.check_numbers()?;
        let layout = Layout {
            id: self.id.clone(),
            date: self.date.clone(),
            phantom: self.phantom.clone(),
            quality: self.quality.clone(),
            image_lag_ms: self.image_lag.nanoseconds() as f64 / 1e6,
            probe_from_image: NamedPose::from(&self.probe_from_image),
            setting: SettingMm::of(&self.setting),
            error: self.error,
        };
        toml::to_string(&layout).map_err(|error| BadCalibration::Text { why: error.to_string() })
    }

    /// Reads a calibration file.
    ///
    /// # Errors
    /// When it cannot be read, or is not one.
    pub fn read(path: &Path) -> Result<Self, BadCalibration> {
        Self::from_toml(&fs::read_to_string(path).map_err(|source| at(path, source))?)
    }

    /// Writes a calibration file.
    ///
    /// # Errors
    /// When it cannot be written, or a number is one that no calibration can have.
    pub fn write(&self, path: &Path) -> Result<(), BadCalibration> {
        fs::write(path, self.to_toml()?).map_err(|source| at(path, source))
    }

    /// Whether it belongs to this setting.
    ///
    /// # Errors
    /// When it does not, saying everything that differs.
    pub fn check_setting(&self, found: &Setting) -> Result<(), BadCalibration> {
        let pairs = SettingMm::of(&self.setting).named().into_iter().zip(SettingMm::of(found).named());
        let differences: Vec<String> = pairs
            .filter(|((name, ours), (_, theirs))| !same(name, *ours, *theirs))
            .map(|((name, ours), (_, theirs))| format!("{name} {theirs} instead of {ours}"))
            .collect();
        if differences.is_empty() {
            return Ok(());
        }
        Err(BadCalibration::OtherSetting { id: self.id.clone(), differences: differences.join(", ") })
    }

    fn check_numbers(&self) -> Result<(), BadCalibration> {
        for (field, found) in SettingMm::of(&self.setting).named() {
            // A window begins at the face at the earliest; everything else has a size.
            let (good, wanted) = match field {
                "window_top_mm" => (found >= 0.0, "zero or more"),
                _ => (found > 0.0, "more than zero"),
            };
            check(good && found.is_finite(), field, found, wanted)?;
        }
        for (field, found) in [("error.rms_mm", self.error.rms_mm), ("error.sd_mm", self.error.sd_mm)] {
            check(found >= 0.0 && found.is_finite(), field, found, "zero or more")?;
        }
        self.quality.as_ref().map_or(Ok(()), Quality::check)
    }
}

/// Metres as millimetres that read back to the same metres where any double does: 0.07 m is 70 mm, though the product
/// of the doubles is 70.00000000000001.
pub(crate) fn mm(metres: f64) -> f64 {
    let product = metres * 1e3;
    let neighbours = [product, product.next_up(), product.next_down()];
    neighbours.into_iter().find(|mm| (mm / 1e3).to_bits() == metres.to_bits()).unwrap_or(product)
}

fn same(name: &str, ours: f64, theirs: f64) -> bool {
    let within = if name.starts_with("pixel") { SAME_SPACING * ours } else { SAME_LENGTH_M * 1e3 };
    (ours - theirs).abs() <= within
}

fn lag(lag_ms: f64) -> Result<Span, BadCalibration> {
    // A machine that is ten seconds late is not one that anybody scans with.
    check(lag_ms.abs() <= 10_000.0, "image_lag_ms", lag_ms, "between -10000 and 10000")?;
    Ok(Span::from_nanoseconds((lag_ms * 1e6).round() as i64))
}

fn check(good: bool, field: &'static str, found: f64, wanted: &'static str) -> Result<(), BadCalibration> {
    if good { Ok(()) } else { Err(BadCalibration::Number { field, found, wanted }) }
}

fn at(path: &Path, source: std::io::Error) -> BadCalibration {
    BadCalibration::File { path: path.display().to_string(), source: Arc::new(source) }
}

#[cfg(test)]
mod tests;
