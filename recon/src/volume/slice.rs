//! An image with the places of its pixels.

use probepath_frames::World;
use probepath_us_capture::sequence::Placed;
use probepath_us_capture::{PixelMap, PlacedBScan};

/// A picture and where its pixels are.
#[derive(Clone, Copy, Debug)]
pub struct Slice<'a> {
    pub(super) pixels: &'a [u8],
    pub(super) width: usize,
    pub(super) weights: Option<&'a [u8]>,
    pub(super) map: PixelMap<World>,
}

impl<'a> Slice<'a> {
    /// Grey levels row after row, `width` a row.
    pub const fn new(pixels: &'a [u8], width: usize, world_from_pixel: PixelMap<World>) -> Self {
        Self { pixels, width, weights: None, map: world_from_pixel }
    }

    /// What each pixel of this image counts, beside [`VolumeSettings::importance`](super::VolumeSettings::importance):
    /// less in a shadow, 0 where it is not to be used.
    #[must_use]
    pub const fn weighted(self, weights: &'a [u8]) -> Self {
        Self { weights: Some(weights), ..self }
    }

    /// Rows.
    pub(super) const fn height(&self) -> usize {
        match self.pixels.len().checked_div(self.width) {
            Some(rows) => rows,
            None => 0,
        }
    }
}

impl<'a> From<&'a PlacedBScan> for Slice<'a> {
    fn from(placed: &'a PlacedBScan) -> Self {
        let bscan = &placed.bscan;
        let map = PixelMap::of(&placed.world_from_image, bscan.setting.spacing);
        Self::new(bscan.pixels(), bscan.width(), map)
    }
}

/// With the calibration as it stands, shear and all.
impl<'a> From<&'a Placed> for Slice<'a> {
    fn from(placed: &'a Placed) -> Self {
        let bscan = &placed.bscan.bscan;
        Self::new(bscan.pixels(), bscan.width(), placed.world_from_pixel)
    }
}
