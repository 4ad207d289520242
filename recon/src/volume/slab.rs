//! A box of cells that one thread owns, and the ways of putting an image's pixels into it.

use std::ops::Range;

use super::Weights;
use super::clip::Clip;
use super::compound::Cell;
use super::rows::{FixedMap, FixedRow};
use super::strip::{MOST, Pixels, Strip};

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
    strip: Strip,
}

impl<C: Cell> Slab<C> {
    /// Empty cells for the voxels of a box.
    pub(super) fn over(voxels: &[Range<i64>; 3], weights: Weights) -> Self {
        let mut slab =
            Self { cells: Vec::new(), low: [0; 3], size: [0; 3], rim: rim(weights), strip: Strip::new() };
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
            let pixels = Pixels { grey, weight };
            if self.rim == 0 { self.nearest(&local, &pixels) } else { self.linear(&local, &pixels) }
        }
    }

    /// Neighbouring pixels mostly fall into one voxel: they are added up first.
    fn nearest(&mut self, row: &super::rows::LocalRow, pixels: &Pixels<'_>) {
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
    fn linear(&mut self, row: &super::rows::LocalRow, pixels: &Pixels<'_>) {
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
