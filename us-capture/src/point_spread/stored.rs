//! [`PointSpreadMm`]: measured widths as a calibration's file has them.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::PointSpread;
use crate::Setting;

/// Widths of the point spread that were read from a phantom's wires: full widths at half maximum of the amplitude, with
/// their standard errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSpreadMm {
    /// Dots that they were read from.
    pub dots: usize,
    /// What lay between grey 0 and 255 (dB).
    pub dynamic_range_db: f64,
    /// Along the beam, as it shows (mm).
    pub axial_fwhm_mm: f64,
    /// Its standard error (mm).
    pub axial_sd_mm: f64,
    /// Along the array, at the narrowest (mm).
    pub lateral_fwhm_mm: f64,
    /// Its standard error (mm).
    pub lateral_sd_mm: f64,
    /// Where that is, under the face (mm).
    pub lateral_waist_depth_mm: f64,
    /// How far from there it is `sqrt(2)` times as wide (mm).
    pub lateral_depth_of_field_mm: f64,
    /// Across the plane, at the narrowest (mm).
    pub elevational_fwhm_mm: f64,
    /// Its standard error (mm).
    pub elevational_sd_mm: f64,
    /// Where that is, under the face (mm).
    pub elevational_waist_depth_mm: f64,
    /// How far from there it is `sqrt(2)` times as wide (mm).
    pub elevational_depth_of_field_mm: f64,
}

impl fmt::Display for PointSpreadMm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Point spread from {} dots: axial {:.2} ± {:.2} mm, lateral {:.2} ± {:.2} mm at {:.0} mm, elevational \
             {:.1} ± {:.1} mm at {:.0} mm.",
            self.dots,
            self.axial_fwhm_mm,
            self.axial_sd_mm,
            self.lateral_fwhm_mm,
            self.lateral_sd_mm,
            self.lateral_waist_depth_mm,
            self.elevational_fwhm_mm,
            self.elevational_sd_mm,
            self.elevational_waist_depth_mm
        )
    }
}

impl PointSpreadMm {
    /// In metres, for the setting that it was measured with.
    pub fn metres(&self, setting: &Setting) -> PointSpread {
        PointSpread {
            axial_fwhm_m: self.axial_fwhm_mm / 1e3,
            lateral_fwhm_m: self.lateral_fwhm_mm / 1e3,
            lateral_waist_of_focus: self.lateral_waist_depth_mm / 1e3 / setting.focus_m,
            lateral_depth_of_field_m: self.lateral_depth_of_field_mm / 1e3,
            line_spacing_per_m2: 0.0,
            elevational_fwhm_m: self.elevational_fwhm_mm / 1e3,
            elevational_focus_m: self.elevational_waist_depth_mm / 1e3,
            elevational_depth_of_field_m: self.elevational_depth_of_field_mm / 1e3,
        }
    }

    /// How sure the less sure of axial and lateral width is, as a part of itself.
    pub fn relative_sd(&self) -> f64 {
        (self.axial_sd_mm / self.axial_fwhm_mm).max(self.lateral_sd_mm / self.lateral_fwhm_mm)
    }

    /// Every number with its name, and whether it can be zero or less.
    pub(crate) fn numbers(&self) -> [(&'static str, f64, Least); 11] {
        use Least::{Any, Positive, Zero};
        [
            ("quality.point_spread.dynamic_range_db", self.dynamic_range_db, Positive),
            ("quality.point_spread.axial_fwhm_mm", self.axial_fwhm_mm, Positive),
            ("quality.point_spread.axial_sd_mm", self.axial_sd_mm, Zero),
            ("quality.point_spread.lateral_fwhm_mm", self.lateral_fwhm_mm, Positive),
            ("quality.point_spread.lateral_sd_mm", self.lateral_sd_mm, Zero),
            ("quality.point_spread.lateral_waist_depth_mm", self.lateral_waist_depth_mm, Any),
            ("quality.point_spread.lateral_depth_of_field_mm", self.lateral_depth_of_field_mm, Positive),
            ("quality.point_spread.elevational_fwhm_mm", self.elevational_fwhm_mm, Positive),
            ("quality.point_spread.elevational_sd_mm", self.elevational_sd_mm, Zero),
            ("quality.point_spread.elevational_waist_depth_mm", self.elevational_waist_depth_mm, Any),
            (
                "quality.point_spread.elevational_depth_of_field_mm",
                self.elevational_depth_of_field_mm,
                Positive,
            ),
        ]
    }
}

/// What a number may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Least {
    /// Anything finite.
    Any,
    /// Zero or more.
    Zero,
    /// More than zero.
    Positive,
}

impl Least {
    /// Whether a number is so, and how that is said.
    pub(crate) fn holds(self, number: f64) -> (bool, &'static str) {
        match self {
            Self::Any => (number.is_finite(), "finite"),
            Self::Zero => (number.is_finite() && number >= 0.0, "zero or more"),
            Self::Positive => (number.is_finite() && number > 0.0, "more than zero"),
        }
    }
}
