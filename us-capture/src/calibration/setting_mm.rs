//! [`SettingMm`]: a machine's setting as files have it.

use serde::{Deserialize, Serialize};

use super::mm;
use crate::{PixelSpacing, Setting};

/// How a machine is set, in millimetres: in a calibration's file, and in a cell's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettingMm {
    /// Scan depth under the transducer's face (mm).
    pub depth_mm: f64,
    /// Depth of the transmit focus (mm).
    pub focus_mm: f64,
    /// Depth of the picture's first row under the face (mm).
    pub window_top_mm: f64,
    /// Height of the picture (mm).
    pub window_height_mm: f64,
    /// Width of the picture (mm).
    pub window_width_mm: f64,
    /// Size of a pixel along a row (mm).
    pub pixel_x_mm: f64,
    /// Size of a pixel along a column (mm).
    pub pixel_y_mm: f64,
}

impl SettingMm {
    /// A setting as it is written in a file: it reads back to the last digit.
    pub fn of(setting: &Setting) -> Self {
        Self {
            depth_mm: mm(setting.depth_m),
            focus_mm: mm(setting.focus_m),
            window_top_mm: mm(setting.window_top_m),
            window_height_mm: mm(setting.window_height_m),
            window_width_mm: mm(setting.window_width_m),
            pixel_x_mm: mm(setting.spacing.x_m),
            pixel_y_mm: mm(setting.spacing.y_m),
        }
    }

    /// The setting in metres.
    pub fn metres(&self) -> Setting {
        Setting {
            depth_m: self.depth_mm / 1e3,
            focus_m: self.focus_mm / 1e3,
            window_top_m: self.window_top_mm / 1e3,
            window_height_m: self.window_height_mm / 1e3,
            window_width_m: self.window_width_mm / 1e3,
            spacing: PixelSpacing { x_m: self.pixel_x_mm / 1e3, y_m: self.pixel_y_mm / 1e3 },
        }
    }

    /// Every number with its name.
    pub(super) fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("depth_mm", self.depth_mm),
            ("focus_mm", self.focus_mm),
            ("window_top_mm", self.window_top_mm),
            ("window_height_mm", self.window_height_mm),
            ("window_width_mm", self.window_width_mm),
            ("pixel_x_mm", self.pixel_x_mm),
            ("pixel_y_mm", self.pixel_y_mm),
        ]
    }
}
