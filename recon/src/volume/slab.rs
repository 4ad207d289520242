//! A box of cells that one thread owns, and the ways of putting an image's pixels into it.

use std::ops::Range;

use super::clip::Clip;
use super::compound::Cell;
use super::rows::{FixedMap, FixedRow, LocalRow};
use super::strip::{MOST, Pixels, Strip};
use super::{Mark, Weights};

/// A slice ready to be walked.
#[derive(Clone, Debug)]
pub(super) struct Ready<'a> {
    pub(super) pixels: &'a [u8],
    pub(super) weights: Option<&'a [u8]>,
    pub(super) width: usize,
    pub(super) map: FixedMap,
    /// Which of the clips is its own.
    pub(super) clip: usize,
}

/// Cells of a box of voxels. For linear weights there is one more voxel on every side, which takes what pixels at the
/// rim give to voxels outside, so that no corner has to be asked whether it is inside.
pub(super) struct Slab<C> {
    cells: Vec<C>,
    /// The first cell's voxel.
    low: [i64; 3],
    /// Cells along x, y, z.
    size: [usize; 3],
    rim: usize,
    /// What a pixel without a weight counts.
    plain: u8,
    strip: Strip,
}

impl<C: Cell> Slab<C> {
    /// Empty cells for the voxels of a box.
    pub(super) fn over(voxels: &[Range<i64>; 3], weights: Weights, plain: u8) -> Self {
        let (rim, strip) = (rim(weights), Strip::new());
        let mut slab = Self { cells: Vec::new(), low: [0; 3], size: [0; 3], rim, plain, strip };
        slab.clear(voxels);
        slab
    }

    /// Empty cells for another box, in the same memory.
    pub(super) fn clear(&mut self, voxels: &[Range<i64>; 3]) {
        let rim = self.rim;
        self.low = [0, 1, 2].map(|axis: usize| voxels[axis].start - rim as i64);
        self.size =
            [0, 1, 2].map(|axis: usize| (voxels[axis].end - voxels[axis].start).max(0) as usize + 2 * rim);
        self.cells.clear();
        self.cells.resize(self.size.iter().product(), C::default());
    }

    /// What each grey level stands for, for cells that ask.
    pub(super) const fn set_levels(&mut self, levels: &[u32; 256]) {
        self.strip.set_levels(levels);
    }

    /// The voxels of the box.
    pub(super) fn voxels(&self) -> [Range<i64>; 3] {
        let rim = self.rim as i64;
        [0, 1, 2].map(|axis: usize| self.low[axis] + rim..self.low[axis] + self.size[axis] as i64 - rim)
    }

    /// What the cells of a box take (bytes).
    pub(super) fn bytes(voxels: &[Range<i64>; 3], weights: Weights) -> u64 {
        let cells =
            voxels.iter().map(|range| (range.end - range.start).max(0) as u64 + 2 * rim(weights) as u64);
        cells.fold(size_of::<C>() as u64, u64::saturating_mul)
    }

    /// A larger box with the same cells. Its rim is new: what went to the old one belongs to no voxel that an image
    /// reached so far.
    pub(super) fn grow(&mut self, voxels: &[Range<i64>; 3]) {
        if *voxels == self.voxels() {
            return;
        }
        let weights = if self.rim == 0 { Weights::Nearest } else { Weights::Linear };
        let mut grown = Self::over(voxels, weights, self.plain);
        let [x, y, z] = self.voxels();
        let places = z.flat_map(|z| y.clone().map(move |y| [x.start, y, z]));
        for (place, row) in places.zip(self.rows()) {
            let first = grown.index(place);
            if let Some(cells) = first.and_then(|first| grown.cells.get_mut(first..first + row.len())) {
                cells.copy_from_slice(row);
            }
        }
        *self = grown;
    }

    /// Where a voxel's cell is; `None` outside.
    fn index(&self, voxel: [i64; 3]) -> Option<usize> {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| {
            usize::try_from(voxel[axis] - self.low[axis]).ok().filter(|at| *at < self.size[axis])
        });
        Some((z? * self.size[1] + y?) * self.size[0] + x?)
    }

    /// Grey levels and marks of a layer's voxels from `first` on, `[nx, ny]` of them.
    pub(super) fn layer(
        &self,
        first: [i64; 3],
        [nx, ny]: [usize; 2],
        (grey, marks): (&mut [u8], &mut [Mark]),
    ) {
        let [own, rows, _] = self.voxels();
        let columns = own.start.max(first[0])..own.end.min(first[0] + nx as i64);
        if columns.is_empty() {
            return;
        }
        for y in rows.start.max(first[1])..rows.end.min(first[1] + ny as i64) {
            let count = (columns.end - columns.start) as usize;
            let start = (y - first[1]) as usize * nx + (columns.start - first[0]) as usize;
            let Some(cell) = self.index([columns.start, y, first[2]]) else { continue };
            let cells = self.cells.get(cell..cell + count).unwrap_or_default();
            let out = grey.iter_mut().zip(marks.iter_mut()).skip(start);
            for (cell, (grey, mark)) in cells.iter().zip(out) {
                if let Some(value) = cell.grey() {
                    (*grey, *mark) = (value, Mark::Seen);
                }
            }
        }
    }

    /// Puts an image's pixels in.
    pub(super) fn add(&mut self, slice: &Ready<'_>, clip: &Clip) {
        let low = self.low;
        // With a rim the eight cells around a pixel begin at its own and end one further.
        let reach = [0, 1, 2].map(|axis| low[axis]..low[axis] + (self.size[axis] - self.rim) as i64);
        for (row, run) in clip.runs() {
            let fixed = slice.map.row(row);
            let columns = fixed.within(run, &reach);
            self.row(slice, clip, (row, &fixed), columns);
        }
    }

    fn row(
        &mut self,
        slice: &Ready<'_>,
        clip: &Clip,
        (row, fixed): (usize, &FixedRow),
        columns: Range<usize>,
    ) {
        let mut mixed = [0; MOST];
        for start in columns.clone().step_by(MOST) {
            let end = columns.end.min(start + MOST);
            let (first, last) = (row * slice.width + start, row * slice.width + end);
            let Some(grey) = slice.pixels.get(first..last) else { return };
            let own = slice.weights.and_then(|weights| weights.get(first..last));
            let weight = mix(own, clip.weights(first..last), &mut mixed);
            let local = fixed.local(start, self.low);
            let pixels = Pixels { grey, weight, plain: self.plain };
            if self.rim == 0 { self.nearest(&local, &pixels) } else { self.linear(&local, &pixels) }
        }
    }

    /// Neighbouring pixels mostly fall into one voxel: they are added up first.
    fn nearest(&mut self, row: &LocalRow, pixels: &Pixels<'_>) {
        let runs = self.strip.locate(row, self.strides(), pixels.grey.len());
        if C::SUMS {
            self.strip.sum(pixels);
        }
        for (voxel, run) in self.strip.runs(runs) {
            if let Some(cell) = self.cells.get_mut(voxel) {
                cell.run(pixels, &self.strip, run);
            }
        }
    }

    /// The same with the eight voxels around.
    fn linear(&mut self, row: &LocalRow, pixels: &Pixels<'_>) {
        let [y, z] = self.strides();
        let runs = self.strip.locate_within(row, [y, z], pixels.grey.len());
        for (voxel, run) in self.strip.runs(runs) {
            let at = [0, 1, y, y + 1, z, z + 1, z + y, z + y + 1].map(|corner| voxel + corner);
            C::around(&mut self.cells, at, pixels, &self.strip, run);
        }
    }

    const fn strides(&self) -> [usize; 2] {
        [self.size[0], self.size[0] * self.size[1]]
    }

    /// Between two passes over all pixels.
    pub(super) fn next_pass(&mut self) {
        self.cells.iter_mut().for_each(C::next_pass);
    }

    /// The cells of the box without its rim, row after row.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[C]> {
        let (rim, [nx, ny, nz]) = (self.rim, self.size);
        let rows = (rim..nz - rim).flat_map(move |z| (rim..ny - rim).map(move |y| (z * ny + y) * nx));
        rows.filter_map(move |first| self.cells.get(first + rim..first + nx - rim))
    }
}

/// Voxels around the box.
pub(super) const fn rim(weights: Weights) -> usize {
    match weights {
        Weights::Nearest => 0,
        Weights::Linear => 1,
    }
}

/// An image's own weights and its region's, multiplied where both are.
fn mix<'a>(own: Option<&'a [u8]>, region: Option<&'a [u8]>, mixed: &'a mut [u8; MOST]) -> Option<&'a [u8]> {
    let (Some(own), Some(region)) = (own, region) else { return own.or(region) };
    for ((mixed, own), region) in mixed.iter_mut().zip(own).zip(region) {
        *mixed = ((u16::from(*own) * u16::from(*region) + 127) / 255) as u8;
    }
    mixed.get(..own.len())
}
