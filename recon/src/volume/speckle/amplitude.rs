//! The sum of amplitudes in a voxel.

use std::ops::Range;

use super::super::compound::{Cell, merge_at, trilinear};
use super::super::strip::{Pixels, Strip, WHOLE};
use super::{Estimate, Grain};

/// The amplitude of grey 255.
const FULL: f64 = 65_535.0;
/// Trilinear weights keep 20 of their 30 bits here, so that the sums fit.
const DROPPED: u32 = 10;

/// Sums of weights (255 x 2^20 for a whole pixel) and of weighted amplitudes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Amplitude {
    weights: u64,
    sum: u64,
}

/// The amplitude of each grey level.
pub(super) fn levels(dynamic_range_db: f64) -> [u32; 256] {
    std::array::from_fn(|grey| {
        let db = (grey as f64 / 255.0 - 1.0) * dynamic_range_db;
        (FULL * 10.0_f64.powf(db / 20.0)).round() as u32
    })
}

/// The grey level of an amplitude.
pub(super) fn grey(amplitude: f32, dynamic_range_db: f64) -> u8 {
    let db = 20.0 * (f64::from(amplitude) / FULL).log10();
    (255.0 * (1.0 + db / dynamic_range_db)).round().clamp(0.0, 255.0) as u8
}

impl Amplitude {
    /// The mean amplitude and how many looks it has.
    pub(super) fn estimate(&self, grain: &Grain) -> Estimate {
        if self.weights == 0 {
            return [0.0, 0.0];
        }
        let pixels = self.weights as f64 / (u64::from(WHOLE) << (30 - DROPPED)) as f64;
        [(self.sum as f64 / self.weights as f64) as f32, grain.looks(pixels) as f32]
    }
}

impl Cell for Amplitude {
    /// Not of a grey level but of its amplitude, which only the strip knows.
    fn add(&mut self, _weight: u64, _grey: u8) {}

    fn merge(&mut self, later: &Self) {
        self.weights += later.weights;
        self.sum += later.sum;
    }

    fn grey(&self) -> Option<u8> {
        None
    }

    fn run(&mut self, pixels: &Pixels<'_>, strip: &Strip, run: Range<usize>) {
        for at in run {
            let weight = u64::from(pixels.weight_at(at)) << (30 - DROPPED);
            self.weights += weight;
            self.sum += weight * u64::from(strip.level(pixels.grey_at(at)));
        }
    }

    fn around(cells: &mut [Self], at: [usize; 8], pixels: &Pixels<'_>, strip: &Strip, run: Range<usize>) {
        let mut runs = [Self::default(); 8];
        for pixel in run {
            let (importance, level) =
                (u64::from(pixels.weight_at(pixel)), strip.level(pixels.grey_at(pixel)));
            for (cell, weight) in runs.iter_mut().zip(trilinear(strip.fraction(pixel))) {
                let weight = importance * (weight >> DROPPED);
                cell.weights += weight;
                cell.sum += weight * u64::from(level);
            }
        }
        merge_at(cells, at, &runs);
    }
}
