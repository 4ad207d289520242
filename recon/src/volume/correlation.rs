//! How alike two volumes are.

use thiserror::Error;

use super::{Mark, Volume};

/// Agreement of two volumes on the voxels that the first one has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correlation {
    /// Pearson's correlation of the grey levels; `None` when one of them is constant.
    pub pearson: Option<f64>,
    /// Mean of this volume's grey level less the other's.
    pub bias: f64,
    /// Voxels compared.
    pub voxels: usize,
}

/// Volumes on different grids.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{ours:?} voxels against {theirs:?}: or the grids' origins are {apart_mm:.3} mm apart")]
pub struct NotComparable {
    /// Voxels of the first.
    pub ours: [usize; 3],
    /// Voxels of the second.
    pub theirs: [usize; 3],
    /// Between their first voxels (mm).
    pub apart_mm: f64,
}

impl Volume {
    /// Compares with a volume on the same grid, on the voxels that were seen or filled here.
    ///
    /// # Errors
    /// When the grids differ in size, or in place by more than a tenth of a voxel.
    pub fn correlation(&self, other: &Self) -> Result<Correlation, NotComparable> {
        let apart = self.grid.origin.distance(&other.grid.origin);
        let tenth = 0.1 * self.grid.spacing_m.iter().copied().fold(f64::INFINITY, f64::min);
        if self.grid.size != other.grid.size || apart > tenth {
            return Err(NotComparable {
                ours: self.grid.size,
                theirs: other.grid.size,
                apart_mm: apart * 1e3,
            });
        }
        let pairs = self.marks.iter().zip(self.grey.iter().zip(&other.grey));
        let pairs = pairs.filter(|(mark, _)| **mark != Mark::Unseen).map(|(_, (a, b))| (*a, *b));
        Ok(correlate(pairs))
    }
}

/// Exact sums of integers, then one division.
fn correlate(pairs: impl Iterator<Item = (u8, u8)>) -> Correlation {
    let [mut n, mut a, mut b, mut aa, mut bb, mut ab] = [0_i128; 6];
    for (x, y) in pairs.map(|(x, y)| (i128::from(x), i128::from(y))) {
        n += 1;
        a += x;
        b += y;
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    let (va, vb, cov) = (n * aa - a * a, n * bb - b * b, n * ab - a * b);
    let pearson = (va > 0 && vb > 0).then(|| cov as f64 / ((va as f64).sqrt() * (vb as f64).sqrt()));
    Correlation { pearson, bias: (a - b) as f64 / n.max(1) as f64, voxels: n as usize }
}
