//! What many pixels in one voxel become, as cells that runs of pixels are added to.

mod tally;

use std::ops::Range;

pub(super) use tally::Tally;

use super::strip::{Pixels, Strip};

/// A cell of the volume while it is built. Its default is a voxel no pixel came to.
pub(super) trait Cell: Copy + Default + Send + Sync {
    /// How often all pixels are gone through.
    const PASSES: usize = 1;
    /// Whether sums up to each pixel of a row are wanted, so that a run costs the same however long it is.
    const SUMS: bool = false;

    /// Adds one pixel; its weight is above zero.
    fn add(&mut self, weight: u64, grey: u8);

    /// Adds what a run of later pixels became.
    fn merge(&mut self, later: &Self);

    /// The grey level, when any pixel came.
    fn grey(&self) -> Option<u8>;

    /// Between two passes.
    fn next_pass(&mut self) {}

    /// Adds the pixels of a run, each with its importance.
    fn run(&mut self, pixels: &Pixels<'_>, _strip: &Strip, run: Range<usize>) {
        for at in run {
            let weight = u64::from(pixels.weight_at(at));
            if weight > 0 {
                self.add(weight, pixels.grey_at(at));
            }
        }
    }

    /// Adds the pixels of a run to the eight cells around them.
    fn around(cells: &mut [Self], at: [usize; 8], pixels: &Pixels<'_>, strip: &Strip, run: Range<usize>) {
        let mut runs = [Self::default(); 8];
        for pixel in run {
            let importance = u64::from(pixels.weight_at(pixel));
            if importance == 0 {
                continue;
            }
            for (cell, weight) in runs.iter_mut().zip(trilinear(strip.fraction(pixel))) {
                if weight > 0 {
                    cell.add(importance * weight, pixels.grey_at(pixel));
                }
            }
        }
        merge_at(cells, at, &runs);
    }
}

/// Adds what runs became to the eight cells around them.
pub(super) fn merge_at<C: Cell>(cells: &mut [C], at: [usize; 8], runs: &[C; 8]) {
    for (index, run) in at.into_iter().zip(runs) {
        if let Some(cell) = cells.get_mut(index) {
            cell.merge(run);
        }
    }
}

/// Trilinear weights of the eight voxels around, x fastest; they sum to 2^30.
pub(super) fn trilinear([x, y, z]: [u32; 3]) -> [u64; 8] {
    let (x, y, z) = ([1024 - x, x], [1024 - y, y], [1024 - z, z]);
    std::array::from_fn(|corner| u64::from(x[corner & 1]) * u64::from(y[corner >> 1 & 1] * z[corner >> 2]))
}

/// The quotient, rounded, a half up. Doubles divide faster than integers, and exactly enough: below 2^42 a quotient that
/// is under a whole number is so by more than doubles round.
fn rounded(sum: u64, count: u64) -> Option<u8> {
    if count == 0 {
        return None;
    }
    let sum = sum + count / 2;
    Some(if count < 1 << 42 { (sum as f64 / count as f64) as u8 } else { (sum / count) as u8 })
}

/// Sum and count in one word: 28 bits of count, 36 of sum.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CountedMean(u64);

/// Sums of weights and of weighted grey levels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WeightedMean {
    weights: u64,
    sum: u64,
}

/// The brightest, plus one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Brightest(u16);

/// The last one, plus one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Last(u16);

impl Cell for CountedMean {
    const SUMS: bool = true;

    fn add(&mut self, _weight: u64, grey: u8) {
        self.0 += (u64::from(grey) << 28) | 1;
    }

    fn merge(&mut self, later: &Self) {
        self.0 += later.0;
    }

    fn grey(&self) -> Option<u8> {
        rounded(self.0 >> 28, self.0 & 0xFFF_FFFF)
    }

    /// Only for pixels that count alike.
    fn run(&mut self, _pixels: &Pixels<'_>, strip: &Strip, run: Range<usize>) {
        let count = run.len() as u64;
        self.0 += (u64::from(strip.greys(run)) << 28) | count;
    }
}

impl Cell for WeightedMean {
    const SUMS: bool = true;

    fn add(&mut self, weight: u64, grey: u8) {
        self.weights += weight;
        self.sum += weight * u64::from(grey);
    }

    fn merge(&mut self, later: &Self) {
        self.weights += later.weights;
        self.sum += later.sum;
    }

    fn grey(&self) -> Option<u8> {
        rounded(self.sum, self.weights)
    }

    fn run(&mut self, pixels: &Pixels<'_>, strip: &Strip, run: Range<usize>) {
        let sum = u64::from(strip.greys(run.clone()));
        let (weight, sum) = match pixels.weight {
            Some(_) => (u64::from(strip.weights(run)), sum),
            None => (u64::from(pixels.plain) * run.len() as u64, u64::from(pixels.plain) * sum),
        };
        self.weights += weight;
        self.sum += sum;
    }
}

impl Cell for Brightest {
    fn add(&mut self, _weight: u64, grey: u8) {
        self.0 = self.0.max(u16::from(grey) + 1);
    }

    fn merge(&mut self, later: &Self) {
        self.0 = self.0.max(later.0);
    }

    fn grey(&self) -> Option<u8> {
        self.0.checked_sub(1).map(|g| g as u8)
    }
}

impl Cell for Last {
    fn add(&mut self, _weight: u64, grey: u8) {
        self.0 = u16::from(grey) + 1;
    }

    fn merge(&mut self, later: &Self) {
        if later.0 > 0 {
            *self = *later;
        }
    }

    fn grey(&self) -> Option<u8> {
        self.0.checked_sub(1).map(|g| g as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_in_doubles_are_those_of_integers() {
        let mut seed = 3_u64;
        let mut next = |below: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((u128::from(seed) * u128::from(below)) >> 64) as u64
        };
        for _ in 0..300_000 {
            let bits = next(42);
            let count = 1 + next(1 << bits);
            // On and around the places where the rounding changes.
            let sum = (count * next(256)).saturating_sub(count / 2) + next(3);
            let sum = sum.saturating_sub(1).min(255 * count);
            assert_eq!(rounded(sum, count), Some(((sum + count / 2) / count) as u8), "{sum} {count}");
        }
        assert_eq!((rounded(0, 0), rounded(255 << 55, 1 << 55)), (None, Some(255)));
    }
}
