//! How a lumen is looked for: [`LumenSettings`].

use probepath_us_capture::Calibration;
use probepath_us_capture::point_spread::PointSpread;
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
    /// How well that is known, as a part of itself (one standard deviation).
    pub point_spread_sd: f64,
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
            point_spread_sd: 0.1,
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

/// What a wire's thickness and the model's form leave open of a measured point spread, as a part of it.
const MEASURED_SD: f64 = 0.03;

impl LumenSettings {
    /// The default, with what a calibration says: how sure it is, and the point spread where its wires told it.
    pub fn of(calibration: &Calibration) -> Self {
        let usual = Self { errors: ErrorBudget::of(calibration), ..Self::default() };
        let measured = calibration.quality.as_ref().and_then(|quality| quality.point_spread);
        measured.map_or_else(
            || usual.clone(),
            |measured| Self {
                point_spread: measured.metres(&calibration.setting),
                point_spread_sd: measured.relative_sd().hypot(MEASURED_SD),
                ..usual.clone()
            },
        )
    }

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
            ("point_spread_sd", self.point_spread_sd),
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

/// Full width at half maximum of a Gaussian of standard deviation 1.
pub(crate) const FWHM: f64 = 2.354_820_045_030_949;
