//! Where the voxels are.

use std::ops::Range;

use nalgebra::Vector3;
use probepath_frames::{Point, World};

use super::clip::Clip;
use super::{Region, Slice, VolumeError, VolumeSettings};

/// A grid of voxels along World's axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Centre of the first voxel.
    pub origin: Point<World>,
    /// From centre to centre along x, y, z (m).
    pub spacing_m: [f64; 3],
    /// Voxels along x, y, z.
    pub size: [usize; 3],
}

impl Grid {
    /// Refuses a grid that is none.
    pub(super) fn check(&self) -> Result<(), VolumeError> {
        let positive = self.spacing_m.iter().all(|s| s.is_finite() && *s > 0.0);
        if !positive || self.size.contains(&0) || self.origin.vector().iter().any(|x| !x.is_finite()) {
            let spacing_mm = self.spacing_m.map(|s| s * 1e3);
            return Err(VolumeError::BadGrid { size: self.size, spacing_mm });
        }
        Ok(())
    }

    /// How many voxels; `None` when they cannot be counted.
    pub fn voxels(&self) -> Option<usize> {
        let [x, y, z] = self.size;
        x.checked_mul(y)?.checked_mul(z)
    }

    /// A voxel's index in the volume's data.
    pub fn index(&self, [x, y, z]: [usize; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.size;
        (x < nx && y < ny && z < nz).then(|| (z * ny + y) * nx + x)
    }

    /// The centre of a voxel.
    pub fn centre(&self, voxel: [usize; 3]) -> Point<World> {
        let [x, y, z] = voxel.map(|v| v as f64);
        let step = Vector3::from(self.spacing_m).component_mul(&Vector3::new(x, y, z));
        Point::from_vector(self.origin.vector() + step)
    }

    /// The part of the grid that these layers are.
    pub(super) fn layers(&self, layers: &Range<usize>) -> Self {
        let [nx, ny, _] = self.size;
        Self { origin: self.centre([0, 0, layers.start]), size: [nx, ny, layers.len()], ..self.clone() }
    }

    /// A place counted in voxels from the first one's centre.
    pub(super) fn in_voxels(&self, vector: Vector3<f64>) -> Vector3<f64> {
        vector.component_div(&Vector3::from(self.spacing_m))
    }

    /// The grid that holds the region of every slice: it begins at the least coordinates of the region's corners, as
    /// PLUS's does (vtkIGSIOVolumeReconstructor, SetOutputExtentFromFrameList).
    ///
    /// # Errors
    /// When there is no slice, a slice has no pixel in the region, or the spacing is none.
    pub fn around(slices: &[Slice<'_>], settings: &VolumeSettings) -> Result<Self, VolumeError> {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for (image, slice) in slices.iter().enumerate() {
            for corner in corners(image, slice, settings)? {
                low = low.inf(&corner);
                high = high.sup(&corner);
            }
        }
        if slices.is_empty() {
            return Err(VolumeError::NoImages);
        }
        let spacing = Vector3::from(settings.spacing_m);
        let steps = (high - low).component_div(&spacing).map(f64::round);
        let size = [steps.x, steps.y, steps.z].map(|s| s as usize).map(|s| s.saturating_add(1));
        Ok(Self { origin: Point::from_vector(low), spacing_m: settings.spacing_m, size })
    }
}

/// The corners of the region's rectangle, its far edges counted as one more column and row.
pub(super) fn corners(
    image: usize,
    slice: &Slice<'_>,
    settings: &VolumeSettings,
) -> Result<[Vector3<f64>; 4], VolumeError> {
    let (width, height) = (slice.width, slice.height());
    let rectangle = Region { fan: None, ..settings.region };
    let clip = Clip::of(&rectangle, width, height);
    let (columns, rows) = clip.bounds().ok_or(VolumeError::NothingLeft { image, width, height })?;
    let (left, right) = (columns.start as f64, columns.end as f64);
    let (top, bottom) = (rows.start as f64, rows.end as f64);
    Ok([(left, top), (right, top), (left, bottom), (right, bottom)].map(|(u, v)| slice.map.at(u, v).vector()))
}
