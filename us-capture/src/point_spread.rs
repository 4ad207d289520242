//! How wide the image of a point is: a model by the machine's setting, and widths read from the wires of a phantom.
//!
//! ```
//! use probepath_us_capture::point_spread::PointSpread;
//! # use probepath_us_capture::{PixelSpacing, Setting};
//! let spacing = PixelSpacing { x_m: 0.0625e-3, y_m: 0.146e-3 };
//! let setting = Setting { depth_m: 0.07, focus_m: 0.045, window_top_m: 0.0, window_height_m: 0.07, window_width_m: 0.04, spacing };
//! let lateral_m = PointSpread::default().lateral_m(0.03, &setting);
//! assert!((1e-3..2e-3).contains(&lateral_m));
//! ```
//!
//! A [`PointSpread`] gives widths at a depth. [`read_from_wires`] measures one: a wire is a point that is seen
//! everywhere, and of a Gaussian beam the amplitude of its dot is a parabola in decibels, so its curvature is the
//! width, whatever the gain, and pixels that are saturated are not needed. A wire that runs obliquely through the beam's
//! thickness is smeared by it, which tells the thickness. [`PointSpreadMm`] is what a calibration keeps of that.
//!
//! What it does not do: take out the thickness of the wires. One of 0.1 mm makes a pulse of 0.35 mm look 1.4 % longer.

mod dot;
mod fit;
mod read;
mod stored;

use serde::{Deserialize, Serialize};

use crate::Setting;
pub use read::{NoSpread, read_from_wires};
pub use stored::PointSpreadMm;

/// Full width at half maximum of a Gaussian of standard deviation 1.
const FWHM: f64 = 2.354_820_045_030_949;

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

impl PointSpread {
    /// Lateral full width at `depth_m` (m).
    pub fn lateral_m(&self, depth_m: f64, setting: &Setting) -> f64 {
        let off = (depth_m - self.lateral_waist_of_focus * setting.focus_m) / self.lateral_depth_of_field_m;
        (self.lateral_fwhm_m * (1.0 + off * off).sqrt()).hypot(self.lines_m(setting))
    }

    /// What the distance of the lines adds to the lateral width (m).
    fn lines_m(&self, setting: &Setting) -> f64 {
        2.0 * self.line_spacing_per_m2 * setting.depth_m * setting.window_width_m
    }

    /// Elevational full width at `depth_m` (m).
    pub fn elevational_m(&self, depth_m: f64) -> f64 {
        let off = (depth_m - self.elevational_focus_m) / self.elevational_depth_of_field_m;
        self.elevational_fwhm_m * (1.0 + off * off).sqrt()
    }
}
