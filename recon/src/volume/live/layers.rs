//! The cells of a volume that grows: slabs of layers, each as wide as the images that touched it.

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use super::super::clip::Clip;
use super::super::compound::Cell;
use super::super::slab::{Ready, Slab};
use super::super::strip::WHOLE;
use super::super::{Mark, Weights};

/// Layers of a slab.
const LAYERS: i64 = 16;
/// A slab that has to grow grows by this many voxels more, so that a slow drift does not copy it for every image.
const AHEAD: i64 = 8;

/// Cells, whatever is compounded in them.
pub(super) trait Cells: Send + Sync {
    /// Puts an image in; `voxels` are those its pixels may go to.
    fn insert(&mut self, slice: &Ready<'_>, clip: &Clip, voxels: &[Range<i64>; 3]);

    /// What the cells take once they hold these voxels (bytes).
    fn bytes_with(&self, voxels: &[Range<i64>; 3]) -> u64;

    /// Grey levels and marks of a layer from a voxel on, `[nx, ny]` of them.
    fn layer(&self, first: [i64; 3], size: [usize; 2], out: (&mut [u8], &mut [Mark]));
}

/// Slabs by their number along z.
pub(super) struct Layers<C> {
    slabs: BTreeMap<i64, Slab<C>>,
    weights: Weights,
}

impl<C: Cell> Layers<C> {
    pub(super) const fn new(weights: Weights) -> Self {
        Self { slabs: BTreeMap::new(), weights }
    }

    /// The box of a slab that holds these voxels and what it has held so far.
    fn wanted(&self, number: i64, voxels: &[Range<i64>; 3]) -> [Range<i64>; 3] {
        let [x, y, _] = voxels.clone();
        let z = number * LAYERS..(number + 1) * LAYERS;
        let Some(held) = self.slabs.get(&number).map(Slab::voxels) else { return [x, y, z] };
        let grown = |held: &Range<i64>, new: &Range<i64>| {
            let low = if new.start < held.start { new.start - AHEAD } else { held.start };
            low..if new.end > held.end { new.end + AHEAD } else { held.end }
        };
        [grown(&held[0], &x), grown(&held[1], &y), z]
    }
}

fn numbers(voxels: &[Range<i64>; 3]) -> Range<i64> {
    if voxels.iter().any(Range::is_empty) {
        return 0..0;
    }
    voxels[2].start.div_euclid(LAYERS)..(voxels[2].end - 1).div_euclid(LAYERS) + 1
}

impl<C: Cell> Cells for Layers<C> {
    fn insert(&mut self, slice: &Ready<'_>, clip: &Clip, voxels: &[Range<i64>; 3]) {
        let numbers = numbers(voxels);
        for number in numbers.clone() {
            let wanted = self.wanted(number, voxels);
            let slab = self.slabs.entry(number).or_insert_with(|| Slab::over(&wanted, self.weights, WHOLE));
            slab.grow(&wanted);
        }
        let touched: Vec<&mut Slab<C>> = self.slabs.range_mut(numbers).map(|(_, slab)| slab).collect();
        touched.into_par_iter().for_each(|slab| slab.add(slice, clip));
    }

    fn bytes_with(&self, voxels: &[Range<i64>; 3]) -> u64 {
        let numbers = numbers(voxels);
        let others = self.slabs.iter().filter(|(number, _)| !numbers.contains(number));
        let others = others.map(|(_, slab)| Slab::<C>::bytes(&slab.voxels(), self.weights));
        let grown =
            numbers.clone().map(|number| Slab::<C>::bytes(&self.wanted(number, voxels), self.weights));
        others.chain(grown).fold(0, u64::saturating_add)
    }

    fn layer(&self, first: [i64; 3], size: [usize; 2], out: (&mut [u8], &mut [Mark])) {
        if let Some(slab) = self.slabs.get(&first[2].div_euclid(LAYERS)) {
            slab.layer(first, size, out);
        }
    }
}
