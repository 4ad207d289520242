//! An image at the volume's own resolution: as many pixels as make a voxel are averaged, so that a filled voxel is as
//! smooth as those beside it.

use super::super::clip::Clip;
use super::super::{Grid, Slice};

/// Bits of a fraction of a block, or of the way between two images.
const PART: u32 = 15;

/// Means of blocks of pixels, in 256ths of a grey level plus one; 0 where the region has no pixel. The last column and
/// the last row are there twice, so that every place lies between four.
pub(super) struct Thumb {
    cells: Vec<u16>,
    /// Cells of a row.
    stride: usize,
    /// The most that a place along columns and rows can be: that of the last block.
    last: [f64; 2],
    /// Parts of blocks for each pixel, along columns and rows.
    scale: [f64; 2],
}

/// A place in an image: the cell before it, and how far beyond its middle it is, in parts.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    first: usize,
    part: [i32; 2],
}

/// Pixels of a block along columns and rows.
fn block(slice: &Slice<'_>, grid: &Grid) -> [usize; 2] {
    let steps = [(slice.map.column_step(), slice.width), (slice.map.row_step(), slice.height())];
    steps.map(|(step, most)| {
        let pixels = 1.0 / grid.in_voxels(step).norm();
        // As integers out of floats saturate, steps of nothing and of NaN become a block of a sound size too.
        (pixels.round() as usize).clamp(1, most.max(1))
    })
}

/// What the means of an image take.
pub(super) fn bytes(slice: &Slice<'_>, grid: &Grid) -> u64 {
    let [across, down] = block(slice, grid);
    let (columns, rows) = (slice.width.div_ceil(across) as u64, slice.height().div_ceil(down) as u64);
    let cells = columns.saturating_add(1).saturating_mul(rows.saturating_add(1));
    cells.saturating_mul(size_of::<u16>() as u64)
}

impl Thumb {
    /// What it takes (bytes).
    pub(super) fn bytes(&self) -> u64 {
        (self.cells.len() * size_of::<u16>()) as u64
    }

    pub(super) fn of(slice: &Slice<'_>, clip: &Clip, grid: &Grid) -> Self {
        let [across, down] = block(slice, grid);
        let (columns, rows) = (slice.width.div_ceil(across), slice.height().div_ceil(down));
        let mut sums = vec![[0_u32; 2]; columns * rows];
        for (row, run) in clip.runs() {
            let start = row * slice.width;
            let Some(pixels) = slice.pixels.get(start + run.start..start + run.end) else { continue };
            let first = row / down * columns;
            // Whole blocks at a time, the first and last of them cut.
            let mut column = run.start;
            while column < run.end {
                let end = ((column / across + 1) * across).min(run.end);
                let part = pixels.get(column - run.start..end - run.start).unwrap_or_default();
                if let Some([sum, count]) = sums.get_mut(first + column / across) {
                    *sum += part.iter().map(|grey| u32::from(*grey)).sum::<u32>();
                    *count += part.len() as u32;
                }
                column = end;
            }
        }
        let twice = |count: usize| (0..count).chain(count.checked_sub(1));
        let of = |row: usize| twice(columns).map(move |column| row * columns + column);
        let blocks = twice(rows).flat_map(of).filter_map(|at| sums.get(at));
        let cells = blocks.map(|[sum, count]| mean(*sum, *count)).collect();
        let one = f64::from(1 << PART);
        let last = [columns, rows].map(|blocks| blocks.saturating_sub(1) as f64 * one);
        Self {
            cells,
            stride: columns.saturating_add(1),
            last,
            scale: [across, down].map(|pixels| one / pixels as f64),
        }
    }

    /// Whether a place is the same spot in both.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let numbers = |thumb: &Self| [thumb.last, thumb.scale].map(|two| two.map(f64::to_bits));
        self.stride == other.stride && numbers(self) == numbers(other)
    }

    /// A place in pixels.
    #[inline]
    pub(super) fn spot(&self, column: f64, row: f64) -> Spot {
        let half = 0.5 * f64::from(1 << PART);
        let at = |pixel: f64, axis: usize| {
            ((pixel + 0.5) * self.scale[axis] - half).clamp(0.0, self.last[axis]) as u32
        };
        let (x, y) = (at(column, 0), at(row, 1));
        let part = [x, y].map(|at| (at & ((1 << PART) - 1)).cast_signed());
        Spot { first: (y >> PART) as usize * self.stride + (x >> PART) as usize, part }
    }

    /// The image at a spot, in 256ths of a grey level: between the four means around it, or those of them that are in
    /// the region.
    #[inline]
    pub(super) fn at(&self, spot: &Spot) -> Option<i32> {
        let above = self.cells.get(spot.first..)?.first_chunk::<2>()?;
        let under = self.cells.get(spot.first + self.stride..)?.first_chunk::<2>()?;
        let [a, b, c, d] = [above[0], above[1], under[0], under[1]].map(i32::from);
        if a == 0 || b == 0 || c == 0 || d == 0 {
            return some([a, b, c, d], spot.part);
        }
        Some(between(between(a, b, spot.part[0]), between(c, d, spot.part[0]), spot.part[1]) - 1)
    }
}

/// From `a` to `b`, that many parts of the way. Both have 16 bits, so nothing overflows.
pub(super) fn between(a: i32, b: i32, part: i32) -> i32 {
    a + (((b - a) * part + (1 << (PART - 1))) >> PART)
}

/// How far on the way `t` (0 to 1) is, in parts.
pub(super) fn parts(t: f64) -> i32 {
    (t.clamp(0.0, 1.0) * f64::from(1 << PART)) as i32
}

/// Between those of four means that are in the region.
fn some(four: [i32; 4], part: [i32; 2]) -> Option<i32> {
    let [across, down] = part.map(|part| f64::from(part) / f64::from(1 << PART));
    let weights =
        [(1.0 - across) * (1.0 - down), across * (1.0 - down), (1.0 - across) * down, across * down];
    let (mut sum, mut total) = (0.0, 0.0);
    for (cell, weight) in four.into_iter().zip(weights).filter(|(cell, _)| *cell > 0) {
        sum += weight * f64::from(cell - 1);
        total += weight;
    }
    (total > 0.0).then(|| (sum / total).round() as i32)
}

fn mean(sum: u32, count: u32) -> u16 {
    (u64::from(sum) * 256 + u64::from(count / 2))
        .checked_div(u64::from(count))
        .map_or(0, |mean| mean as u16 + 1)
}
