//! [`BScan`]: one picture of the ultrasound machine, with everything needed to measure in it.

use std::sync::Arc;

use probepath_frames::{Image, Point, Pose, Probe, Stamp, World, Wrench};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Size of a pixel: from the centre of one to the centre of the next (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PixelSpacing {
    /// Along a row, the lateral direction (m).
    pub x_m: f64,
    /// Along a column, the axial direction (m).
    pub y_m: f64,
}

impl PixelSpacing {
    /// Where the pixel at `column`, `row` (0, 0 is the centre of the first) lies in the image's plane.
    pub fn point(&self, column: f64, row: f64) -> Point<Image> {
        Point::new(column * self.x_m, row * self.y_m, 0.0)
    }

    /// The column and row of a point, dropping what it is off the plane.
    pub fn pixel(&self, point: Point<Image>) -> (f64, f64) {
        (point.vector().x / self.x_m, point.vector().y / self.y_m)
    }
}

/// How the ultrasound machine was set. A calibration belongs to one setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Scan depth under the transducer's face (m).
    pub depth_m: f64,
    /// Depth of the transmit focus (m); where the machine names a range, its middle.
    pub focus_m: f64,
    /// Depth of the picture's first row under the face (m): zero without zoom, the window's top with it.
    pub window_top_m: f64,
    /// Height of the picture (m): the whole depth without zoom, 2 to 4 cm with the paper's.
    pub window_height_m: f64,
    /// Width of the picture (m).
    pub window_width_m: f64,
    /// Size of a pixel.
    pub spacing: PixelSpacing,
}

/// One B-scan, oriented MF: columns toward the unmarked side, rows away from the probe; 8-bit grey.
#[derive(Clone, Debug, PartialEq)]
pub struct BScan {
    /// The machine's count; a skipped number is a lost B-scan.
    pub number: u64,
    /// When it was formed: the instant its echoes came back.
    pub formed: Stamp,
    /// When it arrived here. The difference is the machine's latency, which no pose may be asked at.
    pub arrived: Stamp,
    /// How the machine was set.
    pub setting: Setting,
    width: usize,
    height: usize,
    pixels: Arc<[u8]>,
}

/// Pixels that do not make a picture.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("a B-scan of {width} x {height} pixels needs {} bytes, {bytes} came", width * height)]
pub struct BadBScan {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Bytes that came.
    pub bytes: usize,
}

impl BScan {
    /// A B-scan of `width` columns and `height` rows, row after row.
    ///
    /// # Errors
    /// When the number of bytes is not `width * height`, or zero.
    pub fn new(
        number: u64,
        (formed, arrived): (Stamp, Stamp),
        setting: Setting,
        (width, height): (usize, usize),
        pixels: impl Into<Arc<[u8]>>,
    ) -> Result<Self, BadBScan> {
        let pixels = pixels.into();
        if pixels.is_empty() || width.checked_mul(height) != Some(pixels.len()) {
            return Err(BadBScan { width, height, bytes: pixels.len() });
        }
        Ok(Self { number, formed, arrived, setting, width, height, pixels })
    }

    /// Columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Grey levels, row after row from the probe down.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }
}

/// A B-scan that knows where it was.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedBScan {
    /// The picture.
    pub bscan: BScan,
    /// Where the probe was when it was formed (interpolated at `formed`, the lag taken off).
    pub world_from_probe: Pose<World, Probe>,
    /// Where its plane was: `world_from_probe * probe_from_image`.
    pub world_from_image: Pose<World, Image>,
    /// What the skin did to the probe then, when a sensor was there.
    pub wrench: Option<Wrench<Probe>>,
}
