//! How pixels become voxels.

use probepath_us_capture::plus::{Fan, PlusCompounding, PlusVolume, Rectangle};

use super::{Grid, Slice, VolumeError};

/// Which voxels a pixel goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// The one whose centre is nearest.
    Nearest,
    /// The eight around it, each by its nearness (trilinear).
    Linear,
}

/// What many pixels in one voxel become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compounding {
    /// Their weighted mean, of exact sums, rounded once.
    Mean,
    /// The brightest.
    Maximum,
    /// The last: of the last image, the last row, the last column.
    Latest,
}

/// The part of every image that is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region {
    /// A rectangle; the whole image without it.
    pub rectangle: Option<Rectangle>,
    /// A fan; nothing outside it is used.
    pub fan: Option<Fan>,
}

/// Hole filling: a straight stick of voxels through the hole has to end in a seen voxel on both sides, so nothing is
/// filled that does not lie between two seen voxels. The value is interpolated along the shortest sticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sticks {
    /// Most voxels of a stick, its ends included.
    pub longest: usize,
    /// How many of the shortest are averaged (all of the last one's length).
    pub at_least: usize,
}

/// How a volume is built.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeSettings {
    /// Voxel size along x, y, z (m), for a grid found from the images.
    pub spacing_m: [f64; 3],
    /// The grid, when it is not to be found from the images.
    pub grid: Option<Grid>,
    /// Which voxels a pixel goes to.
    pub weights: Weights,
    /// What many pixels in one voxel become.
    pub compounding: Compounding,
    /// The part of the images that is used.
    pub region: Region,
    /// Hole filling, when wanted.
    pub holes: Option<Sticks>,
    /// More memory than this is refused before any is taken.
    pub most_bytes: u64,
}

impl VolumeSettings {
    /// Cubic voxels; linear weights, mean, the whole image, no filling, at most 2 GiB.
    pub const fn every_mm(spacing_mm: f64) -> Self {
        let spacing_m = [spacing_mm * 1e-3; 3];
        let region = Region { rectangle: None, fan: None };
        Self {
            spacing_m,
            grid: None,
            weights: Weights::Linear,
            compounding: Compounding::Mean,
            region,
            holes: None,
            most_bytes: 2 << 30,
        }
    }

    /// The memory that a grid needs while it is built (bytes): sums, grey levels, marks, and a copy while filling.
    pub fn memory_bytes(&self, grid: &Grid) -> u64 {
        let sums: u64 = match (self.compounding, self.weights) {
            (Compounding::Mean, Weights::Nearest) => 8,
            (Compounding::Mean, Weights::Linear) => 16,
            _ => 2,
        };
        let bytes = sums + 2 + 2 * u64::from(self.holes.is_some());
        grid.size.iter().fold(bytes, |product, n| product.saturating_mul(*n as u64))
    }

    /// Refuses what cannot be built, before anything is allocated.
    pub(super) fn check(&self, slices: &[Slice<'_>], grid: &Grid) -> Result<(), VolumeError> {
        let positive = grid.spacing_m.iter().all(|s| s.is_finite() && *s > 0.0);
        if !positive || grid.size.contains(&0) || grid.origin.vector().iter().any(|x| !x.is_finite()) {
            return Err(VolumeError::BadGrid {
                size: grid.size,
                spacing_mm: grid.spacing_m.map(|s| s * 1e3),
            });
        }
        let needs = self.memory_bytes(grid);
        if needs > self.most_bytes || grid.voxels().is_none() {
            let size = grid.size.map(|n| n as u64);
            return Err(VolumeError::TooLarge {
                size,
                needs_mb: needs >> 20,
                limit_mb: self.most_bytes >> 20,
            });
        }
        for (image, slice) in slices.iter().enumerate() {
            slice.check(image)?;
        }
        densest(slices, grid)
    }
}

/// Sums are exact up to this many pixels in one voxel (2^26 weights of 2^30 times 255 fit 64 bits).
const MOST_HITS: f64 = 67_108_864.0;

/// How many pixels a voxel could take at most: those of a plane that pass within a voxel's diagonal of its centre.
fn densest(slices: &[Slice<'_>], grid: &Grid) -> Result<(), VolumeError> {
    let reach = 2.0 * grid.spacing_m.iter().map(|s| s * s).sum::<f64>().sqrt();
    let hits = |slice: &Slice<'_>| {
        let (column, row) = (slice.map.column_step(), slice.map.row_step());
        let area = column.cross(&row).norm().max(f64::MIN_POSITIVE);
        let around = (reach * row.norm() / area + 2.0) * (reach * column.norm() / area + 2.0);
        around.min(slice.pixels.len() as f64)
    };
    let hits: f64 = slices.iter().map(hits).sum();
    if hits > MOST_HITS { Err(VolumeError::TooDense { hits }) } else { Ok(()) }
}

impl Slice<'_> {
    fn check(&self, image: usize) -> Result<(), VolumeError> {
        let finite = [self.map.at(0.0, 0.0).vector(), self.map.column_step(), self.map.row_step()];
        let finite = finite.iter().flat_map(|v| v.iter()).all(|x| x.is_finite());
        if self.width == 0
            || self.pixels.is_empty()
            || !self.pixels.len().is_multiple_of(self.width)
            || !finite
        {
            return Err(VolumeError::BadSlice { image, bytes: self.pixels.len(), width: self.width });
        }
        Ok(())
    }
}

/// As PLUS would build it: spacing, region, weights, compounding and hole filling of its configuration.
impl From<&PlusVolume> for VolumeSettings {
    fn from(plus: &PlusVolume) -> Self {
        Self {
            spacing_m: plus.spacing_mm.map(|s| s * 1e-3),
            weights: if plus.linear { Weights::Linear } else { Weights::Nearest },
            compounding: match plus.compounding {
                PlusCompounding::Mean => Compounding::Mean,
                PlusCompounding::Maximum => Compounding::Maximum,
                PlusCompounding::Latest => Compounding::Latest,
            },
            region: Region { rectangle: plus.clip, fan: plus.fan },
            holes: plus.holes.map(|h| Sticks { longest: h.longest, at_least: h.sticks }),
            ..Self::every_mm(1.0)
        }
    }
}
