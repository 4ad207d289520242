//! A stretch of one row on its way into the voxels: which voxel each pixel falls into, and where that changes.

use std::ops::Range;

use super::rows::LocalRow;

/// Columns that are worked on at once.
pub(super) const MOST: usize = 256;

/// Grey levels of a stretch and what each counts: `plain` without weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixels<'a> {
    pub(super) grey: &'a [u8],
    pub(super) weight: Option<&'a [u8]>,
    pub(super) plain: u8,
}

/// What a pixel counts where no weights are about, so that sums stay small.
pub(super) const ONE: u8 = 1;
/// What a pixel without a weight counts beside those that have one.
pub(super) const WHOLE: u8 = 255;

impl Pixels<'_> {
    pub(super) fn grey_at(&self, at: usize) -> u8 {
        self.grey.get(at).copied().unwrap_or(0)
    }

    pub(super) fn weight_at(&self, at: usize) -> u8 {
        self.weight.map_or(self.plain, |weight| weight.get(at).copied().unwrap_or(0))
    }
}

/// Room for a stretch, used again and again.
pub(super) struct Strip {
    index: [u32; MOST],
    fraction: [[u32; MOST]; 3],
    ends: [u16; MOST],
    greys: [u32; 2 * MOST],
    weights: [u32; 2 * MOST],
    levels: [u32; 256],
}

impl Strip {
    pub(super) const fn new() -> Self {
        Self {
            index: [0; MOST],
            fraction: [[0; MOST]; 3],
            ends: [0; MOST],
            greys: [0; 2 * MOST],
            weights: [0; 2 * MOST],
            levels: [0; 256],
        }
    }

    /// What each grey level stands for, where it is not itself that is added up.
    pub(super) const fn set_levels(&mut self, levels: &[u32; 256]) {
        self.levels = *levels;
    }

    /// What a grey level stands for.
    pub(super) fn level(&self, grey: u8) -> u32 {
        self.levels[usize::from(grey)]
    }

    /// Finds the voxel of every pixel, and the runs of pixels that fall into one; gives how many runs.
    pub(super) fn locate(&mut self, row: &LocalRow, strides: [usize; 2], pixels: usize) -> usize {
        let pixels = pixels.min(MOST);
        row.indices(strides, &mut self.index[..pixels]);
        self.find_runs(pixels)
    }

    /// The same, and where in its voxel every pixel lies (1024ths).
    pub(super) fn locate_within(&mut self, row: &LocalRow, strides: [usize; 2], pixels: usize) -> usize {
        let pixels = pixels.min(MOST);
        let runs = self.locate(row, strides, pixels);
        row.fractions(&mut self.fraction, pixels);
        runs
    }

    /// Without a branch: whether the voxel changes cannot be foretold.
    fn find_runs(&mut self, pixels: usize) -> usize {
        let Some(last) = pixels.checked_sub(1) else { return 0 };
        let index = &self.index[..pixels];
        let mut runs = 0;
        for (end, pair) in (1_u16..).zip(index.windows(2)) {
            self.ends[runs % MOST] = end;
            runs += usize::from(pair[0] != pair[1]);
        }
        self.ends[runs % MOST] = last as u16 + 1;
        runs + 1
    }

    /// Sums from the stretch's beginning up to each pixel. There is room for twice as many, because a power of two is
    /// stayed within for nothing.
    pub(super) fn sum(&mut self, pixels: &Pixels<'_>) {
        let mut sum = 0;
        match pixels.weight {
            None => {
                for (grey, total) in pixels.grey.iter().zip(&mut self.greys[1..]) {
                    sum += u32::from(*grey);
                    *total = sum;
                }
            }
            Some(weight) => {
                let mut weights = 0;
                let totals = self.greys[1..].iter_mut().zip(&mut self.weights[1..]);
                for ((grey, weight), (total, total_weight)) in pixels.grey.iter().zip(weight).zip(totals) {
                    weights += u32::from(*weight);
                    sum += u32::from(*weight) * u32::from(*grey);
                    (*total, *total_weight) = (sum, weights);
                }
            }
        }
    }

    /// The runs found by [`locate`](Self::locate), each with its voxel.
    pub(super) fn runs(&self, runs: usize) -> impl Iterator<Item = (usize, Range<usize>)> {
        let mut start = 0;
        self.ends[..runs.min(MOST)].iter().map(move |end| {
            let run = start..usize::from(*end);
            let voxel = self.index[start % MOST] as usize;
            start = run.end;
            (voxel, run)
        })
    }

    /// The sum of the (weighted) grey levels of a run.
    pub(super) fn greys(&self, run: Range<usize>) -> u32 {
        self.greys[run.end % (2 * MOST)].wrapping_sub(self.greys[run.start % (2 * MOST)])
    }

    /// The sum of the weights of a run.
    pub(super) fn weights(&self, run: Range<usize>) -> u32 {
        self.weights[run.end % (2 * MOST)].wrapping_sub(self.weights[run.start % (2 * MOST)])
    }

    /// Where in its voxel a pixel lies, in 1024ths.
    pub(super) fn fraction(&self, pixel: usize) -> [u32; 3] {
        let at = pixel % MOST;
        [self.fraction[0][at], self.fraction[1][at], self.fraction[2][at]]
    }
}
