//! B-scans that know when they were formed and where the probe was: sources, tracked sequences, the exam file.
//!
//! It never hears of robots.

// Test support is written against the public names, and unit tests share it.
#[cfg(test)]
extern crate self as probepath_us_capture;

mod bscan;
mod calibration;
mod capture;
pub mod check;
pub mod dots;
pub mod errors;
pub mod exam;
pub mod fit;
pub mod igtl;
pub mod label;
pub mod lag;
pub mod phantom;
mod pixel_map;
pub mod plan;
pub mod plus;
pub mod point_spread;
pub mod pointer;
pub mod sequence;
pub mod shots;
mod source;
pub mod spatial;

pub use bscan::{BScan, BadBScan, PixelSpacing, PlacedBScan, Setting};
pub use calibration::{
    BadCalibration, Calibration, CalibrationError, Covariance, DepthMm, ErrorsMm, FoundMm, PromisedMm,
    Quality, RepeatabilityMm, SettingMm, Water,
};
pub use capture::{Capture, CaptureError, Counts, Keeping};
pub use pixel_map::{BadPixelMap, PixelMap};
pub use source::{BScanSource, SourceFault};
