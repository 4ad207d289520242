//! How wide the beam is: the point spread of FIELD.md section 8, Gaussian in amplitude.

use probepath_us_capture::Setting;

use super::config::ImagingConfig;

/// A Gaussian's full width at half maximum over its standard deviation: `2 sqrt(2 ln 2)`.
pub(super) const FWHM_PER_SIGMA: f64 = 2.354_820_045_030_949_4;

/// Widths of the point spread for one setting: standard deviations of the amplitude (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    focus_mm: f64,
    line_mm: f64,
    axial: f64,
    lateral_factor: f64,
    elevational_factor: f64,
}

impl Beam {
    pub(super) fn new(config: &ImagingConfig, setting: &Setting) -> Self {
        Self {
            focus_mm: setting.focus_m * 1e3,
            line_mm: 0.1 * (setting.depth_m * 1e2) * (setting.window_width_m * 1e3) / 40.0,
            axial: config.axial_fwhm_m / FWHM_PER_SIGMA,
            lateral_factor: config.lateral_factor,
            elevational_factor: config.elevational_factor,
        }
    }

    pub(super) const fn axial(&self) -> f64 {
        self.axial
    }

    /// At `depth` under the face (m): the beam's own width, and two scan lines'.
    pub(super) fn lateral(&self, depth: f64) -> f64 {
        let own = 0.95 * ((depth * 1e3 - 0.78 * self.focus_mm) / 14.0).hypot(1.0);
        own.hypot(2.0 * self.line_mm) * 1e-3 * self.lateral_factor / FWHM_PER_SIGMA
    }

    /// At `depth` under the face (m).
    pub(super) fn elevational(&self, depth: f64) -> f64 {
        let own = 3.0 * ((depth * 1e3 - 30.0) / 28.0).hypot(1.0);
        own * 1e-3 * self.elevational_factor / FWHM_PER_SIGMA
    }

    /// The widest of a width between two depths: both are convex in the depth, so it is at an end.
    pub(super) fn widest(&self, width: impl Fn(&Self, f64) -> f64, from: f64, to: f64) -> f64 {
        width(self, from).max(width(self, to))
    }
}
