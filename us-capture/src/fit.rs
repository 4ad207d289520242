//! The fit: where the image's plane is in the probe, and when it was formed, from labelled dots and poses.

use nalgebra::Matrix2;
use probepath_frames::Stamp;

/// The labelled dots of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// The image's number in its sequence.
    pub image: usize,
    /// When the image says it was formed; the pose is asked at this stamp plus the lag.
    pub stamp: Stamp,
    /// What was seen of which wire.
    pub dots: Vec<SeenWire>,
}

/// A dot with its wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenWire {
    /// Index into the phantom's wires.
    pub wire: usize,
    /// Its centre (column, row), in pixels.
    pub at_px: [f64; 2],
    /// How uncertain the centre is (px²).
    pub covariance_px2: Matrix2<f64>,
}
