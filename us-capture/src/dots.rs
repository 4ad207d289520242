//! Dots: the echoes of wires in a B-scan, found without knowing the phantom.

use nalgebra::Matrix2;

/// The echo of a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Its centre (column, row), in pixels of the MF image; (0, 0) is the centre of the first.
    pub at_px: [f64; 2],
    /// How uncertain the centre is (px²).
    pub covariance_px2: Matrix2<f64>,
    /// Its shape: second moments of its brightness (px²).
    pub spread_px2: Matrix2<f64>,
    /// How bright its brightest pixel is (0 to 255).
    pub peak: f64,
    /// Sum of its brightness over what lies around it.
    pub mass: f64,
    /// Cut by the edge of the image, the region of interest or the fan: its centre is not to be trusted.
    pub cut: bool,
}
