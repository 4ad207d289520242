//! [`DotSettings`]: what counts as a dot.

use super::BadDots;
use crate::PixelSpacing;

/// The longest a dot may be (m): a wire of 0.3 mm that is crossed at 45 degrees, 60 mm deep, smears to 5 mm.
const LONGEST_M: f64 = 6.0e-3;
/// With an unknown spacing: the longest, as a part of the image's longer side.
const LONGEST_PART: f64 = 0.1;
/// With an unknown spacing: the longest is no shorter than this (px), as the image may be a piece of another.
const LONGEST_LEAST: f64 = 64.0;

/// What counts as a dot. Lengths come from the pixels' spacing where it is known, else from the size of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DotSettings {
    /// The longest it may be, along columns and along rows (px).
    pub longest_px: Option<[f64; 2]>,
    /// How far a dot stands out, at least: the part of its height (over the floor) down to which it is one compact
    /// piece of its own.
    pub prominence: f64,
    /// How much higher than the floor its summit is, at least, as a part of the brightest dots' height.
    pub faintest: f64,
    /// Where its edge is drawn, as a part of its height. Its centre is that of the brightness inside. At a tenth, the
    /// centres of real wires are the steadiest from image to image, and the nearest to PLUS's.
    pub edge: f64,
    /// How uncertain its centre is by its shape alone: standard deviation, as a part of its spread. From one image to
    /// the next, real wires in water move by 0.03 to 0.07 of it against each other; what changes slowly is unseen there.
    pub wobble: f64,
    /// No more dots than this are given.
    pub most: usize,
}

impl Default for DotSettings {
    /// For images whose spacing nobody knows.
    fn default() -> Self {
        Self { longest_px: None, prominence: 0.5, faintest: 0.2, edge: 0.1, wobble: 0.1, most: 48 }
    }
}

impl DotSettings {
    /// Lengths by the size of the pixels. A spacing that is none (zero, NaN) counts as unknown.
    pub fn for_spacing(spacing: PixelSpacing) -> Self {
        let longest = [LONGEST_M / spacing.x_m, LONGEST_M / spacing.y_m];
        let usable = longest.iter().all(|length| length.is_finite() && *length >= 1.0);
        Self { longest_px: usable.then_some(longest), ..Self::default() }
    }

    /// The longest a dot may be in an image of this size (px).
    pub(super) fn longest_in(&self, width: usize, height: usize) -> [f64; 2] {
        let fallback = (LONGEST_PART * width.max(height) as f64).max(LONGEST_LEAST);
        self.longest_px.unwrap_or([fallback; 2]).map(|length| length.max(5.0))
    }

    pub(super) fn check(&self) -> Result<(), BadDots> {
        let part = "a part, above 0 and below 1";
        let parts = [("prominence", self.prominence), ("faintest", self.faintest), ("edge", self.edge)];
        let bad = parts.into_iter().find(|(_, value)| !(*value > 0.0 && *value < 1.0));
        if let Some((name, value)) = bad {
            return Err(BadDots::Setting { name, value, range: part });
        }
        if !(self.wobble >= 0.0 && self.wobble < 10.0) {
            return Err(BadDots::Setting { name: "wobble", value: self.wobble, range: "0 to 10" });
        }
        let lengths = self.longest_px.into_iter().flatten();
        let bad = lengths.into_iter().find(|length| !(*length >= 1.0 && length.is_finite()));
        let range = "at least one pixel, and finite";
        bad.map_or(Ok(()), |value| Err(BadDots::Setting { name: "longest_px", value, range }))
    }
}
