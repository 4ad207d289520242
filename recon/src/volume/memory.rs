//! What a volume needs, said and refused before anything is allocated.

use super::{Grid, Holes, Mark, Slice, VolumeError, VolumeSettings, splat, swept};

impl VolumeSettings {
    /// The memory that a volume on this grid needs while it is built (bytes), the images apart: a grey level and a mark
    /// for each voxel, the cells of the slabs at work (one for each of this thread pool's threads), and what filling
    /// holes takes.
    pub fn memory_bytes(&self, grid: &Grid) -> u64 {
        let voxels = grid.size.iter().fold(1_u64, |product, n| product.saturating_mul(*n as u64));
        let own = voxels.saturating_mul(Mark::BYTES);
        let filling = match self.holes {
            None => 0,
            Some(Holes::Sticks(_)) => own,
            Some(Holes::Swept(_)) => swept::working_bytes(grid),
        };
        own.saturating_add(splat::working_bytes(grid, self).max(filling))
    }

    /// Refuses what cannot be built, before anything is allocated; gives the memory it will take (bytes).
    pub(super) fn check(&self, slices: &[Slice<'_>], grid: &Grid) -> Result<u64, VolumeError> {
        grid.check()?;
        let needs = self.memory_bytes(grid).saturating_add(self.kept_bytes(slices, grid));
        if needs > self.most_bytes || grid.voxels().is_none() {
            return Err(self.too_large(grid, needs));
        }
        self.check_images(slices, grid)?;
        Ok(needs)
    }

    pub(super) fn too_large(&self, grid: &Grid, needs: u64) -> VolumeError {
        let size = grid.size.map(|n| n as u64);
        VolumeError::TooLarge { size, needs_mb: needs.div_ceil(1 << 20), limit_mb: self.most_bytes >> 20 }
    }

    /// Refuses images and tables that are none, and more pixels than can be summed.
    pub(super) fn check_images(&self, slices: &[Slice<'_>], grid: &Grid) -> Result<(), VolumeError> {
        if let Some(importance) = &self.importance {
            importance.check()?;
        }
        for (image, slice) in slices.iter().enumerate() {
            slice.check(image)?;
        }
        let weighted = self.importance.is_some() || slices.iter().any(|slice| slice.weights.is_some());
        exact(slices.iter().map(|slice| hits(slice, grid)).sum(), weighted).map(|_| ())
    }
}

/// Sums are exact up to this many pixels in one voxel (2^26 weights of 2^30 times 255 fit 64 bits).
const MOST_HITS: f64 = 67_108_864.0;
/// With weights of 8 bits on top.
const MOST_WEIGHTED_HITS: f64 = MOST_HITS / 256.0;

/// Refuses more pixels in a voxel than can be summed exactly.
pub(super) fn exact(hits: f64, weighted: bool) -> Result<f64, VolumeError> {
    let most = if weighted { MOST_WEIGHTED_HITS } else { MOST_HITS };
    if hits > most { Err(VolumeError::TooDense { hits }) } else { Ok(hits) }
}

/// How many pixels of an image a voxel could take at most: those that pass within a voxel's diagonal of its centre.
pub(super) fn hits(slice: &Slice<'_>, grid: &Grid) -> f64 {
    let reach = 2.0 * grid.spacing_m.iter().map(|s| s * s).sum::<f64>().sqrt();
    let (column, row) = (slice.map.column_step(), slice.map.row_step());
    let area = column.cross(&row).norm().max(f64::MIN_POSITIVE);
    let around = (reach * row.norm() / area + 2.0) * (reach * column.norm() / area + 2.0);
    around.min(slice.pixels.len() as f64)
}

impl Slice<'_> {
    pub(super) fn check(&self, image: usize) -> Result<(), VolumeError> {
        let finite = [self.map.at(0.0, 0.0).vector(), self.map.column_step(), self.map.row_step()];
        let finite = finite.iter().flat_map(|v| v.iter()).all(|x| x.is_finite());
        let (bytes, width) = (self.pixels.len(), self.width);
        if width == 0 || bytes == 0 || !bytes.is_multiple_of(width) || !finite {
            return Err(VolumeError::BadSlice { image, bytes, width });
        }
        match self.weights {
            Some(weights) if weights.len() != bytes => {
                Err(VolumeError::BadWeights { image, weights: weights.len(), pixels: bytes })
            }
            _ => Ok(()),
        }
    }
}
