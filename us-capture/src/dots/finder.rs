//! [`DotFinder`]: the search, with room for images of one size.

use super::clutter::{self, Found};
use super::floor::Floor;
use super::region::{Grower, Grown, Whole};
use super::shrink::{factor, shrink};
use super::summits::{Summit, Summits};
use super::{BadDots, Dot, DotSettings, Mask};

/// No floor is lower than this over the common grey level (of 255).
const LEAST: u8 = 6;
/// A summit is at least so much higher than the floor (of 255).
const FAINTEST: f64 = 8.0;
/// The most summits that are measured.
const MOST_SUMMITS: usize = 256;

/// Finds dots in images of one size. Its buffers are kept from image to image.
pub struct DotFinder {
    settings: DotSettings,
    size: [usize; 2],
    /// How many pixels, each way, one of the searched image stands for.
    k: usize,
    small: Vec<u8>,
    sums: Vec<u16>,
    inside: Vec<u8>,
    floor: Floor,
    summits: Summits,
    grower: Grower,
    chosen: Vec<Summit>,
}

impl DotFinder {
    /// A finder for images of `width` x `height` pixels.
    ///
    /// # Errors
    /// When the size or a setting is out of range, or the mask leaves nothing.
    pub fn new(settings: DotSettings, mask: &Mask, width: usize, height: usize) -> Result<Self, BadDots> {
        settings.check()?;
        if !(8..=32768).contains(&width) || !(8..=32768).contains(&height) {
            return Err(BadDots::Size { width, height });
        }
        let k = factor(width, height);
        let (wide, high) = (width.div_ceil(k), height.div_ceil(k));
        let inside = inside(mask, [width, height], k);
        if inside.iter().all(|inside| *inside == 0) {
            return Err(BadDots::Masked { width, height });
        }
        let longest = settings.longest_in(width, height).map(|length| length / k as f64);
        let block = (longest[0].max(longest[1]) as usize).clamp(16, 96);
        Ok(Self {
            size: [width, height],
            k,
            small: vec![0; wide * high],
            sums: Vec::new(),
            inside,
            floor: Floor::new(wide, high, block),
            summits: Summits::new(wide, high, longest, settings.prominence),
            grower: Grower::new(wide, high, longest),
            chosen: Vec::new(),
            settings,
        })
    }

    /// The dots of an image (grey, row after row, MF), the strongest first.
    ///
    /// # Errors
    /// When it is not of the finder's size.
    pub fn find(&mut self, pixels: &[u8]) -> Result<Vec<Dot>, BadDots> {
        let [width, height] = self.size;
        if pixels.len() != width * height {
            return Err(BadDots::Pixels { given: pixels.len(), width, height });
        }
        let wide = width.div_ceil(self.k);
        shrink(pixels, width, self.k, &mut self.small, &mut self.sums);
        self.floor.lay(&self.small, &self.inside, wide, LEAST);
        self.choose();
        let chosen = std::mem::take(&mut self.chosen);
        let mut found: Vec<Found> = chosen.iter().filter_map(|summit| self.found(pixels, summit)).collect();
        self.chosen = chosen;
        found.sort_by(|a, b| b.dot.mass.total_cmp(&a.dot.mass));
        clutter::drop_text(&mut found);
        clutter::drop_second_echoes(&mut found);
        Ok(found.into_iter().map(|found| found.dot).take(self.settings.most).collect())
    }

    /// The summits that are high enough, the highest over their floor first.
    fn choose(&mut self) {
        self.chosen.clear();
        self.chosen.extend(self.summits.find(&self.small, &self.inside, &self.floor));
        self.chosen.sort_by_key(|summit| std::cmp::Reverse(summit.level - summit.floor));
        let bright = self.chosen.get(self.chosen.len().min(9).saturating_sub(1));
        let least = bright.map_or(0.0, |s| self.settings.faintest * f64::from(s.level - s.floor));
        self.chosen.retain(|summit| f64::from(summit.level - summit.floor) >= least.max(FAINTEST));
        self.chosen.truncate(MOST_SUMMITS);
    }

    fn found(&mut self, pixels: &[u8], summit: &Summit) -> Option<Found> {
        let height = f64::from(summit.level - summit.floor);
        let edge = f64::from(summit.floor) + self.settings.edge * height;
        let level =
            edge.ceil().max(f64::from(summit.base) + 1.0).max(f64::from(summit.saddle) + 1.0).min(255.0);
        let grown = self.grower.grow(&self.small, &self.inside, summit, level as u8);
        if grown == Grown::NoDot {
            return None;
        }
        let whole = Whole { pixels, width: self.size[0], height: self.size[1] };
        let moments = self.grower.moments(&whole, self.k, level - 1.0)?;
        Some(Found::new(&moments, grown == Grown::Cut, self.settings.wobble))
    }
}

/// Where the searched image is looked at: pixels whose whole block is inside the mask.
fn inside(mask: &Mask, [width, height]: [usize; 2], k: usize) -> Vec<u8> {
    let (wide, high) = (width.div_ceil(k), height.div_ceil(k));
    let whole = |column: usize, row: usize| {
        let (columns, rows) =
            (column * k..((column + 1) * k).min(width), row * k..((row + 1) * k).min(height));
        rows.into_iter().all(|v| columns.clone().all(|u| mask.holds(u as f64, v as f64)))
    };
    (0..wide * high).map(|at| u8::from(whole(at % wide, at / wide))).collect()
}
