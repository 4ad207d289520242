//! Colours that mean a number, told apart by people of any colour vision and in black and white.

use super::drawing::Drawing;
use super::picture::{Anchor, Colour};

/// Black on white, a little softened; and what is said more quietly.
pub const INK: Colour = [28, 36, 48];
/// For axes and notes.
pub const SOFT: Colour = [92, 104, 120];
/// For grids.
pub const FAINT: Colour = [223, 228, 234];
/// For what the reader should look at first.
pub const MARK: Colour = [0, 90, 160];

/// From a number to a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The number at the first colour, and at the last.
    pub range: (f64, f64),
    stops: &'static [Colour],
}

/// Where nothing is known.
const UNKNOWN: Colour = [170, 170, 170];
/// Matplotlib's magma from light to dark without its ends (public domain, CC0).
const LIGHT_TO_DARK: &[Colour] = &[
    [254, 216, 154],
    [254, 180, 123],
    [249, 133, 97],
    [229, 89, 100],
    [196, 60, 117],
    [156, 46, 127],
    [114, 31, 129],
    [72, 16, 110],
];
/// Blue, white, orange.
const TWO_SIDED: &[Colour] = &[
    [5, 58, 120],
    [36, 113, 184],
    [110, 174, 217],
    [190, 219, 236],
    [247, 247, 245],
    [250, 214, 165],
    [240, 160, 75],
    [205, 105, 20],
    [135, 62, 8],
];

impl Scale {
    /// From light (`low`) to dark (`high`).
    pub fn sequential(low: f64, high: f64) -> Self {
        Self { range: (low, high), stops: LIGHT_TO_DARK }
    }

    /// From blue (`-most`) over white (zero) to orange (`most`).
    pub fn two_sided(most: f64) -> Self {
        Self { range: (-most, most), stops: TWO_SIDED }
    }

    /// The colour of a number; grey for none.
    pub fn colour(&self, value: f64) -> Colour {
        let (low, high) = self.range;
        if !value.is_finite() {
            return UNKNOWN;
        }
        let last = self.stops.len().saturating_sub(1);
        let place = ((value - low) / (high - low).max(1e-12)).clamp(0.0, 1.0) * last as f64;
        let first = (place as usize).min(last.saturating_sub(1));
        let pair = [first, first + 1].map(|i| self.stops.get(i).copied().unwrap_or(UNKNOWN));
        let part = place - first as f64;
        std::array::from_fn(|k| {
            let [a, b] = pair.map(|colour| f64::from(colour[k]));
            (a + (b - a) * part).round() as u8
        })
    }

    /// Draws the scale as a bar with its numbers, its upper left corner at a place.
    pub fn bar(
        &self,
        drawing: &mut Drawing,
        (x, y): (f64, f64),
        (width, height): (f64, f64),
        title: &str,
        size: f64,
    ) {
        const STEPS: usize = 96;
        let (low, high) = self.range;
        for i in 0..STEPS {
            let value = low + (high - low) * (i as f64 + 0.5) / STEPS as f64;
            // Each to the bar's end, the next over it: no seam shows.
            let (a, b) = (x + width * i as f64 / STEPS as f64, x + width);
            drawing.area(&[(a, y), (b, y), (b, y + height), (a, y + height)], self.colour(value), 1.0);
        }
        for (part, value) in [(0.0, low), (0.5, (low + high) / 2.0), (1.0, high)] {
            let at = x + width * part;
            drawing.line(&[(at, y + height), (at, y + height + size * 0.25)], size / 12.0, SOFT);
            drawing.text((at, y + height + size * 1.2), &short(value), size, Anchor::Middle, SOFT);
        }
        drawing.text((x + width / 2.0, y - size * 0.45), title, size, Anchor::Middle, SOFT);
    }
}

/// A number without zeros that say nothing.
fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_darkens_steadily_so_that_it_reads_without_colour() {
        let grey = |[r, g, b]: Colour| 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        let scale = Scale::sequential(0.0, 100.0);
        let greys: Vec<f64> = (0..=100).map(|i| grey(scale.colour(f64::from(i)))).collect();
        assert!(greys.windows(2).all(|pair| pair[1] <= pair[0] + 0.6), "{greys:?}");
        let sides = Scale::two_sided(1.0);
        assert!(
            grey(sides.colour(0.0)) > 240.0
                && grey(sides.colour(-1.0)) < 80.0
                && grey(sides.colour(1.0)) < 90.0
        );
        assert_eq!(scale.colour(f64::NAN), UNKNOWN);
        assert_eq!(scale.colour(1e9), scale.colour(100.0));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([short(0.5), short(-0.0), short(80.0), short(0.25)], ["0.5", "0", "80", "0.25"]);
    }
}
