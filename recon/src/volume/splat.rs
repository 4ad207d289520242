//! Pixels into voxels. Every thread owns a slab of the volume and walks all images, so that nothing is shared, the
//! order of the pixels is the same for any number of threads, and sums are exact.

use std::ops::Range;

use rayon::prelude::*;

use super::clip::Clip;
use super::compound::{Brightest, Cell, CountedMean, Last, WeightedMean};
use super::rows::{FixedMap, FixedRow};
use super::{Compounding, Grid, Mark, Slice, VolumeError, VolumeSettings, Weights};

type Voxels = (Vec<u8>, Vec<Mark>);

/// Grey levels and marks of all slices.
pub(super) fn splat(
    slices: &[Slice<'_>],
    grid: &Grid,
    settings: &VolumeSettings,
) -> Result<Voxels, VolumeError> {
    match (settings.compounding, settings.weights) {
        (Compounding::Mean, Weights::Nearest) => run::<CountedMean>(slices, grid, settings),
        (Compounding::Mean, Weights::Linear) => run::<WeightedMean>(slices, grid, settings),
        (Compounding::Maximum, _) => run::<Brightest>(slices, grid, settings),
        (Compounding::Latest, _) => run::<Last>(slices, grid, settings),
    }
}

/// A slice ready to be walked.
struct Ready<'a> {
    pixels: &'a [u8],
    width: usize,
    map: FixedMap,
    clip: usize,
}

fn run<C: Cell>(slices: &[Slice<'_>], grid: &Grid, settings: &VolumeSettings) -> Result<Voxels, VolumeError> {
    let (ready, clips) = prepare(slices, grid, settings)?;
    let [nx, ny, nz] = grid.size;
    let mut cells = vec![C::default(); nx * ny * nz];
    let layers = nz.div_ceil(4 * rayon::current_num_threads()).max(1);
    cells.par_chunks_mut(nx * ny * layers).enumerate().for_each(|(number, cells)| {
        let first = number * layers;
        let mut slab =
            Slab { cells, size: [nx as i64, ny as i64], z: first as i64..(first + layers).min(nz) as i64 };
        for slice in &ready {
            let Some(clip) = clips.get(slice.clip) else { continue };
            match settings.weights {
                Weights::Nearest => slab.nearest(slice, clip),
                Weights::Linear => slab.linear(slice, clip),
            }
        }
    });
    Ok(finish(&cells))
}

/// Slices in fixed point, and one clip for every size of image.
fn prepare<'a>(
    slices: &[Slice<'a>],
    grid: &Grid,
    settings: &VolumeSettings,
) -> Result<(Vec<Ready<'a>>, Vec<Clip>), VolumeError> {
    let mut clips: Vec<Clip> = Vec::new();
    let half = settings.weights == Weights::Nearest;
    let mut ready = Vec::with_capacity(slices.len());
    for (image, slice) in slices.iter().enumerate() {
        let map = FixedMap::of(slice, grid, half).ok_or(VolumeError::OffGrid { image })?;
        let size = (slice.width, slice.height());
        let known = clips.iter().position(|c| (c.width, c.height) == size);
        let clip = known.unwrap_or_else(|| {
            clips.push(Clip::of(&settings.region, size.0, size.1));
            clips.len() - 1
        });
        ready.push(Ready { pixels: slice.pixels, width: slice.width, map, clip });
    }
    Ok((ready, clips))
}

fn finish<C: Cell>(cells: &[C]) -> Voxels {
    let voxel = |cell: &C| cell.grey().map_or((0, Mark::Unseen), |grey| (grey, Mark::Seen));
    cells.par_iter().map(voxel).unzip()
}

/// The layers of one thread.
struct Slab<'c, C> {
    cells: &'c mut [C],
    size: [i64; 2],
    z: Range<i64>,
}

impl<C: Cell> Slab<'_, C> {
    /// Neighbouring pixels mostly fall into one voxel: they are added up first and merged once.
    fn nearest(&mut self, slice: &Ready<'_>, clip: &Clip) {
        let voxels = [0..self.size[0], 0..self.size[1], self.z.clone()];
        for (row, pixels, columns) in rows(slice, clip, voxels) {
            let (mut here, mut run) = (usize::MAX, C::default());
            for (column, grey) in columns.clone().zip(pixels) {
                let index = self.index(row.voxel(column).0);
                if index != here {
                    self.merge(here, &run);
                    (here, run) = (index, C::default());
                }
                run.add(1, *grey);
            }
            self.merge(here, &run);
        }
    }

    /// The same with the eight voxels around; a pixel may lie one voxel outside and still touch the slab.
    fn linear(&mut self, slice: &Ready<'_>, clip: &Clip) {
        let voxels = [-1..self.size[0], -1..self.size[1], self.z.start - 1..self.z.end];
        for (row, pixels, columns) in rows(slice, clip, voxels) {
            let (mut here, mut runs) = ([i64::MIN; 3], [C::default(); 8]);
            for (column, grey) in columns.clone().zip(pixels) {
                let (voxel, fraction) = row.voxel(column);
                if voxel != here {
                    self.merge_around(here, &runs);
                    (here, runs) = (voxel, [C::default(); 8]);
                }
                for (run, weight) in runs.iter_mut().zip(weights(fraction)) {
                    if weight > 0 {
                        run.add(weight, *grey);
                    }
                }
            }
            self.merge_around(here, &runs);
        }
    }

    fn merge(&mut self, index: usize, run: &C) {
        if let Some(cell) = self.cells.get_mut(index) {
            cell.merge(run);
        }
    }

    fn merge_around(&mut self, [x, y, z]: [i64; 3], runs: &[C; 8]) {
        if x == i64::MIN {
            return;
        }
        for (corner, run) in (0_i64..).zip(runs) {
            let at = [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
            let inside = (0..self.size[0]).contains(&at[0]) && (0..self.size[1]).contains(&at[1]);
            if inside && self.z.contains(&at[2]) {
                self.merge(self.index(at), run);
            }
        }
    }

    /// A voxel inside the slab.
    const fn index(&self, [x, y, z]: [i64; 3]) -> usize {
        (((z - self.z.start) * self.size[1] + y) * self.size[0] + x) as usize
    }
}

/// The rows of a slice with their pixels and columns that fall into the box.
fn rows<'s>(
    slice: &'s Ready<'_>,
    clip: &'s Clip,
    voxels: [Range<i64>; 3],
) -> impl Iterator<Item = (FixedRow, &'s [u8], Range<usize>)> {
    clip.runs().filter_map(move |(row, run)| {
        let fixed = slice.map.row(row);
        let columns = fixed.within(run, voxels.clone());
        let start = row * slice.width;
        let pixels = slice.pixels.get(start + columns.start..start + columns.end)?;
        (!pixels.is_empty()).then_some((fixed, pixels, columns))
    })
}

/// Trilinear weights of the eight voxels around, x fastest; they sum to 2^30.
fn weights([x, y, z]: [u64; 3]) -> [u64; 8] {
    let (x, y, z) = ([1024 - x, x], [1024 - y, y], [1024 - z, z]);
    std::array::from_fn(|corner| x[corner & 1] * y[corner >> 1 & 1] * z[corner >> 2])
}
