//! Pixels into voxels. The volume is cut into slabs along z; a thread owns the slab it works on and puts all images into
//! it, one after the other: nothing is shared, the order of the pixels is the same for any number of threads, and sums
//! are exact. Only the slabs at work hold cells; the volume itself holds a grey level and a mark for each voxel.

use std::ops::Range;

use rayon::prelude::*;

use super::clip::Clip;
use super::compound::{Brightest, Cell, CountedMean, Last, Tally, WeightedMean};
use super::rows::FixedMap;
use super::slab::{Ready, Slab, rim};
use super::strip::{ONE, WHOLE};
use super::{Compounding, Grid, Mark, Slice, VolumeError, VolumeSettings, Weights};

/// Cells of a slab take about this many bytes, so that they stay near the processor.
const SLAB_BYTES: u64 = 8 << 20;
/// Slabs are no thinner than this many layers, where an image that crosses many would be cut into too many pieces.
const LEAST_LAYERS: u64 = 8;

/// Slices ready to be walked, and one clip for every size of image.
pub(super) struct Walk<'a> {
    slices: Vec<Ready<'a>>,
    clips: Vec<Clip>,
    /// Layers that each slice touches.
    layers: Vec<Range<i64>>,
}

impl<'a> Walk<'a> {
    pub(super) fn prepare(
        slices: &[Slice<'a>],
        grid: &Grid,
        settings: &VolumeSettings,
    ) -> Result<Self, VolumeError> {
        let mut walk =
            Self { slices: Vec::with_capacity(slices.len()), clips: Vec::new(), layers: Vec::new() };
        for (image, slice) in slices.iter().enumerate() {
            walk.push(slice, grid, settings).ok_or(VolumeError::OffGrid { image })?;
        }
        Ok(walk)
    }

    /// `None` when the slice lies too far away.
    fn push(&mut self, slice: &Slice<'a>, grid: &Grid, settings: &VolumeSettings) -> Option<()> {
        let map = FixedMap::of(slice, grid, settings.weights == Weights::Nearest)?;
        let size = (slice.width, slice.height());
        let clip = Clip::number(&mut self.clips, size, |width, height| {
            Clip::of(&settings.region, width, height).weighted(settings.importance.as_ref())
        });
        self.layers.push(map.span(2, slice.width, slice.height()));
        let (pixels, width, weights) = (slice.pixels, slice.width, slice.weights);
        self.slices.push(Ready { pixels, weights, width, map, clip });
        Some(())
    }

    /// Whether any pixel has a weight.
    fn weighted(&self, settings: &VolumeSettings) -> bool {
        settings.importance.is_some() || self.slices.iter().any(|slice| slice.weights.is_some())
    }

    /// The slices that touch these layers, in their order.
    pub(super) fn touching(&self, layers: &Range<i64>) -> impl Iterator<Item = (&Ready<'a>, &Clip)> {
        let touch = |own: &Range<i64>| own.start < layers.end && layers.start < own.end;
        let near = self.slices.iter().zip(&self.layers).filter(move |(_, own)| touch(own));
        near.filter_map(|(slice, _)| Some((slice, self.clips.get(slice.clip)?)))
    }
}

/// Grey levels and marks of the layers from `first` on, as many as fit into `grey`.
pub(super) fn splat(
    walk: &Walk<'_>,
    grid: &Grid,
    settings: &VolumeSettings,
    first: usize,
    (grey, marks): (&mut [u8], &mut [Mark]),
) {
    let weighted = walk.weighted(settings);
    let work = match (settings.compounding, settings.weights) {
        (Compounding::Mean, Weights::Nearest) if !weighted => run::<CountedMean>,
        (Compounding::Mean, _) => run::<WeightedMean>,
        (Compounding::Maximum, _) => run::<Brightest>,
        (Compounding::Latest, _) => run::<Last>,
        (Compounding::Median, _) => run::<Tally>,
    };
    work(walk, grid, settings, first, (grey, marks));
}

fn run<C: Cell>(
    walk: &Walk<'_>,
    grid: &Grid,
    settings: &VolumeSettings,
    first: usize,
    (grey, marks): (&mut [u8], &mut [Mark]),
) {
    let [nx, ny, _] = grid.size;
    let layer = nx * ny;
    let thick = slab_layers(grid, settings).min(grey.len() / layer.max(1)).max(1);
    let slabs = grey.par_chunks_mut(layer * thick).zip(marks.par_chunks_mut(layer * thick)).enumerate();
    let plain = if walk.weighted(settings) { WHOLE } else { ONE };
    let room = || Slab::<C>::over(&[0..0, 0..0, 0..0], settings.weights, plain);
    slabs.for_each_init(room, |slab, (number, (grey, marks))| {
        let low = (first + number * thick) as i64;
        let layers = low..low + (grey.len() / layer.max(1)) as i64;
        slab.clear(&[0..nx as i64, 0..ny as i64, layers.clone()]);
        for pass in 0..C::PASSES {
            if pass > 0 {
                slab.next_pass();
            }
            walk.touching(&layers).for_each(|(slice, clip)| slab.add(slice, clip));
        }
        finish(slab, nx, (grey, marks));
    });
}

fn finish<C: Cell>(slab: &Slab<C>, nx: usize, (grey, marks): (&mut [u8], &mut [Mark])) {
    let rows = grey.chunks_exact_mut(nx).zip(marks.chunks_exact_mut(nx));
    for ((grey, marks), cells) in rows.zip(slab.rows()) {
        for ((grey, mark), cell) in grey.iter_mut().zip(marks).zip(cells) {
            if let Some(value) = cell.grey() {
                (*grey, *mark) = (value, Mark::Seen);
            }
        }
    }
}

/// Bytes of a cell.
const fn cell_bytes(settings: &VolumeSettings) -> u64 {
    let bytes = match (settings.compounding, settings.weights) {
        (Compounding::Mean, _) => size_of::<WeightedMean>(),
        (Compounding::Maximum | Compounding::Latest, _) => size_of::<Last>(),
        (Compounding::Median, _) => size_of::<Tally>(),
    };
    bytes as u64
}

/// Cells of one layer, rim and all; saturating, because it is asked before sizes are known to be sound.
fn layer_bytes(grid: &Grid, settings: &VolumeSettings) -> u64 {
    let around = 2 * rim(settings.weights) as u64;
    let [nx, ny, _] = grid.size.map(|n| (n as u64).saturating_add(around));
    nx.saturating_mul(ny).saturating_mul(cell_bytes(settings))
}

/// Layers of a slab.
pub(super) fn slab_layers(grid: &Grid, settings: &VolumeSettings) -> usize {
    let layers = (SLAB_BYTES / layer_bytes(grid, settings).max(1)).max(LEAST_LAYERS);
    layers.min(grid.size[2].max(1) as u64) as usize
}

/// What the cells of the slabs at work take (bytes).
pub(super) fn working_bytes(grid: &Grid, settings: &VolumeSettings) -> u64 {
    let layers = slab_layers(grid, settings) as u64 + 2 * rim(settings.weights) as u64;
    let slabs = rayon::current_num_threads() as u64;
    layer_bytes(grid, settings).saturating_mul(layers).saturating_mul(slabs)
}
