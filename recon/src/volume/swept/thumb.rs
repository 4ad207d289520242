//! An image at the volume's own resolution: as many pixels as make a voxel are averaged, so that a filled voxel is as
//! smooth as those beside it.

use super::super::clip::Clip;
use super::super::{Grid, Slice};

/// Means of blocks of pixels, in 256ths of a grey level plus one; 0 where the region has no pixel.
pub(super) struct Thumb {
    cells: Vec<u16>,
    columns: usize,
    rows: usize,
    /// Blocks for each pixel, along columns and rows.
    scale: [f32; 2],
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
    let blocks = slice.width.div_ceil(across) as u64 * slice.height().div_ceil(down) as u64;
    blocks * size_of::<u16>() as u64
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
        let cells = sums.iter().map(|[sum, count]| mean(*sum, *count)).collect();
        Self { cells, columns, rows, scale: [1.0 / across as f32, 1.0 / down as f32] }
    }

    /// The image at a place in pixels, in 256ths of a grey level: between the four means around it, or those of them
    /// that are in the region.
    pub(super) fn at(&self, column: f64, row: f64) -> Option<f32> {
        let (x, across) = place(column as f32, self.scale[0], self.columns);
        let (y, down) = place(row as f32, self.scale[1], self.rows);
        let first = y * self.columns + x;
        // Where there is no further block, it has no weight either.
        let (next, below) = (usize::from(across > 0.0), if down > 0.0 { self.columns } else { 0 });
        let four = [first, first + next, first + below, first + below + next]
            .map(|at| self.cells.get(at).copied().unwrap_or(0));
        let weights =
            [(1.0 - across) * (1.0 - down), across * (1.0 - down), (1.0 - across) * down, across * down];
        let (mut sum, mut total) = (0.0, 0.0);
        for (cell, weight) in four.into_iter().zip(weights) {
            let weight = if cell == 0 { 0.0 } else { weight };
            sum += weight * f32::from(cell.saturating_sub(1));
            total += weight;
        }
        (total > 0.0).then(|| sum / total)
    }
}

fn mean(sum: u32, count: u32) -> u16 {
    (u64::from(sum) * 256 + u64::from(count / 2))
        .checked_div(u64::from(count))
        .map_or(0, |mean| mean as u16 + 1)
}

/// The block before a place, and how far the place is beyond its middle.
fn place(pixel: f32, scale: f32, blocks: usize) -> (usize, f32) {
    let at = ((pixel + 0.5) * scale - 0.5).clamp(0.0, blocks.saturating_sub(1) as f32);
    (at as usize, at - at.floor())
}
