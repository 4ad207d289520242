//! The median without keeping the pixels: two bits of it are found in each pass.

use std::ops::Range;

use super::{Cell, Pixels, Strip, trilinear};

/// Weights of the pixels that agree with the bits found so far, by the next two bits.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct Tally {
    weights: [u64; 4],
    /// How much of the weight lies at or below the median, among the pixels that agree.
    rank: u64,
    found: u16,
    passed: u8,
}

impl Tally {
    /// The two bits at which half of the weight is reached, and the weight below them.
    fn bits(&self) -> Option<(u16, u64)> {
        let total: u64 = self.weights.iter().sum();
        let rank = if self.passed == 0 { total.div_ceil(2) } else { self.rank };
        let mut below = 0;
        for (bits, weight) in (0_u16..).zip(self.weights) {
            if weight > 0 && below + weight >= rank {
                return Some((bits, below));
            }
            below += weight;
        }
        None
    }
}

impl Cell for Tally {
    const PASSES: usize = 4;

    fn add(&mut self, weight: u64, grey: u8) {
        let shift = 6 - 2 * self.passed;
        let bits = u16::from(grey) >> shift;
        if bits >> 2 == self.found {
            self.weights[usize::from(bits & 3)] += weight;
        }
    }

    /// Never asked: what a run becomes depends on the cell it is added to.
    fn merge(&mut self, later: &Self) {
        self.weights.iter_mut().zip(later.weights).for_each(|(mine, its)| *mine += its);
    }

    fn grey(&self) -> Option<u8> {
        self.bits().map(|(bits, _)| (self.found << 2 | bits) as u8)
    }

    fn next_pass(&mut self) {
        let Some((bits, below)) = self.bits() else { return };
        let total: u64 = self.weights.iter().sum();
        let rank = if self.passed == 0 { total.div_ceil(2) } else { self.rank };
        let found = self.found << 2 | bits;
        *self = Self { weights: [0; 4], rank: rank - below, found, passed: self.passed + 1 };
    }

    fn around(cells: &mut [Self], at: [usize; 8], pixels: &Pixels<'_>, strip: &Strip, run: Range<usize>) {
        for pixel in run {
            let importance = u64::from(pixels.weight_at(pixel));
            for (index, weight) in at.into_iter().zip(trilinear(strip.fraction(pixel))) {
                if let Some(cell) = cells.get_mut(index) {
                    cell.add(importance * weight, pixels.grey_at(pixel));
                }
            }
        }
    }
}
