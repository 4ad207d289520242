//! How a lumen is looked for: [`LumenSettings`], and the machine's [`PointSpread`].

use probepath_us_capture::Setting;
use serde::{Deserialize, Serialize};

use crate::{ErrorBudget, ReconError, ReferenceChoice};

/// How a lumen is looked for and measured. The default is meant to need no change on leg arteries.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LumenSettings {
    /// A place inside the lumen of the first image, from the protocol; found when absent.
    pub seed: Option<SeedPoint>,
    /// Decibels between grey level 0 and 255: the machine's log compression is undone with it.
    pub dynamic_range_db: f64,
    /// The point spread that the wall is seen through.
    pub point_spread: PointSpread,
    /// Depths under the probe's face between which a lumen is looked for without a seed (m).
    pub depth_range_m: (f64, f64),
    /// Smallest and largest radius of a lumen (m).
    pub radius_range_m: (f64, f64),
    /// How thick the wall is, before an image says otherwise (m).
    pub wall_thickness_m: f64,
    /// Points of the surface's grid along the vessel and around it ([P1] II.C: 300 x 20).
    pub grid: (usize, usize),
    /// A stretch of vessel longer than this without a lumen seen in it is not measured (m).
    pub longest_gap_m: f64,
    /// The least percent area that is called a stenosis.
    pub least_percent_area: f64,
    /// What stenoses are measured against.
    pub reference: ReferenceChoice,
    /// What calibration, poses and contours are off by: the 95 % intervals follow from it.
    pub errors: ErrorBudget,
}

/// A place inside a lumen, in an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SeedPoint {
    /// Column and row.
    Pixel {
        /// Column.
        column: f64,
        /// Row.
        row: f64,
    },
    /// Millimetres right of the first column and below the first row.
    Millimetres {
        /// Along the columns (mm).
        x_mm: f64,
        /// Along the rows (mm).
        y_mm: f64,
    },
}

impl Default for LumenSettings {
    fn default() -> Self {
        Self {
            seed: None,
            dynamic_range_db: 60.0,
            point_spread: PointSpread::default(),
            depth_range_m: (0.005, 0.060),
            radius_range_m: (0.0008, 0.0075),
            wall_thickness_m: 0.0008,
            grid: (300, 20),
            longest_gap_m: 0.004,
            least_percent_area: 35.0,
            reference: ReferenceChoice::default(),
            errors: ErrorBudget::default(),
        }
    }
}

impl LumenSettings {
    /// Whether every number can be worked with.
    ///
    /// # Errors
    /// Names the first that cannot.
    pub fn check(&self) -> Result<(), ReconError> {
        let (low, high) = self.radius_range_m;
        let positive = [
            ("dynamic_range_db", self.dynamic_range_db),
            ("radius_range_m.0", low),
            ("radius_range_m.1", high - low),
            ("depth_range_m", self.depth_range_m.1 - self.depth_range_m.0),
            ("wall_thickness_m", self.wall_thickness_m),
            ("longest_gap_m", self.longest_gap_m),
            ("point_spread.axial_fwhm_m", self.point_spread.axial_fwhm_m),
            ("point_spread.lateral_fwhm_m", self.point_spread.lateral_fwhm_m),
            ("point_spread.elevational_fwhm_m", self.point_spread.elevational_fwhm_m),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(ReconError::Setting {
                    name,
                    value,
                    must: "must be positive (a range must rise)",
                });
            }
        }
        if self.grid.0 < 2 || self.grid.1 < 3 {
            let value = self.grid.0.min(self.grid.1) as f64;
            return Err(ReconError::Setting {
                name: "grid",
                value,
                must: "must be at least 2 along x 3 around",
            });
        }
        if !(0.0..100.0).contains(&self.least_percent_area) {
            let value = self.least_percent_area;
            return Err(ReconError::Setting { name: "least_percent_area", value, must: "must be in 0..100" });
        }
        if let ReferenceChoice::Between { from_mm, to_mm } = self.reference
            && !(from_mm.is_finite() && to_mm - from_mm >= 2.0 && to_mm.is_finite())
        {
            let must = "must begin 2 mm or more before it ends";
            return Err(ReconError::Setting { name: "reference", value: to_mm - from_mm, must });
        }
        self.errors.check()
    }
}

/// Full widths at half maximum of the image of a point, in amplitude, as functions of depth.
///
/// The shape is that of a focused beam: `lateral(z) = w sqrt(1 + ((z - k F) / l)^2)`, widened by the distance of
/// the lines, and likewise across the plane; the default figures are [P1]'s at 3 cm (axial 0.3-0.4 mm, lateral
/// 1-2 mm, elevational 3-4 mm) in the form of FIELD.md section 8. Measure your own on a wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PointSpread {
    /// Along the beam (m).
    pub axial_fwhm_m: f64,
    /// Along the array, at the narrowest (m).
    pub lateral_fwhm_m: f64,
    /// Where it is narrowest, as a part of the focus depth.
    pub lateral_waist_of_focus: f64,
    /// How far from there it is `sqrt(2)` times as wide (m).
    pub lateral_depth_of_field_m: f64,
    /// Distance of the lines for each metre of depth and each metre of window width (1/m).
    pub line_spacing_per_m2: f64,
    /// Across the plane, at the narrowest (m).
    pub elevational_fwhm_m: f64,
    /// Where that is (m).
    pub elevational_focus_m: f64,
    /// How far from there it is `sqrt(2)` times as wide (m).
    pub elevational_depth_of_field_m: f64,
}

impl Default for PointSpread {
    fn default() -> Self {
        Self {
            axial_fwhm_m: 0.35e-3,
            lateral_fwhm_m: 0.95e-3,
            lateral_waist_of_focus: 0.78,
            lateral_depth_of_field_m: 14e-3,
            // 0.1 mm a centimetre of depth, for a window of 40 mm.
            line_spacing_per_m2: 0.1e-3 / 0.01 / 0.040,
            elevational_fwhm_m: 3.0e-3,
            elevational_focus_m: 30e-3,
            elevational_depth_of_field_m: 28e-3,
        }
    }
}

/// Full width at half maximum of a Gaussian of standard deviation 1.
pub(crate) const FWHM: f64 = 2.354_820_045_030_949;

impl PointSpread {
    /// Lateral full width at `depth_m` (m).
    pub fn lateral_m(&self, depth_m: f64, setting: &Setting) -> f64 {
        let off = (depth_m - self.lateral_waist_of_focus * setting.focus_m) / self.lateral_depth_of_field_m;
        let lines = 2.0 * self.line_spacing_per_m2 * setting.depth_m * setting.window_width_m;
        (self.lateral_fwhm_m * (1.0 + off * off).sqrt()).hypot(lines)
    }

    /// Elevational full width at `depth_m` (m).
    pub fn elevational_m(&self, depth_m: f64) -> f64 {
        let off = (depth_m - self.elevational_focus_m) / self.elevational_depth_of_field_m;
        self.elevational_fwhm_m * (1.0 + off * off).sqrt()
    }
}
