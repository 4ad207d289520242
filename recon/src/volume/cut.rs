//! Images cut out of a volume, at any place and of any size.

use nalgebra::Vector3;
use probepath_frames::{Image, Pose, World};
use probepath_us_capture::{PixelMap, PixelSpacing};
use rayon::prelude::*;

use super::{Mark, Slice, Volume, VolumeError};

/// How a pixel of a cut comes out of the voxels around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The nearest voxel.
    Nearest,
    /// The eight around it, each by its nearness (trilinear).
    Linear,
}

/// A picture cut out of a volume, and for each pixel what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Where its plane is; its first pixel's centre is the origin, as of a B-scan.
    pub world_from_image: Pose<World, Image>,
    /// Size of a pixel.
    pub spacing: PixelSpacing,
    width: usize,
    pixels: Vec<u8>,
    marks: Vec<Mark>,
}

/// No cut has more pixels than this.
const MOST_PIXELS: usize = 1 << 28;

impl Volume {
    /// Cuts an image of `(width, height)` pixels. A pixel is as good as the worst voxel it was made of: unseen (grey 0)
    /// when one of them was, or outside of the grid by more than half a voxel; else filled when one of them was.
    ///
    /// # Errors
    /// When the image has no pixel or more than 2^28, or a place or pixel size is not finite.
    pub fn cut(
        &self,
        world_from_image: &Pose<World, Image>,
        spacing: PixelSpacing,
        (width, height): (usize, usize),
        interpolation: Interpolation,
    ) -> Result<Cut, VolumeError> {
        let map = PixelMap::of(world_from_image, spacing);
        let ends = [map.at(0.0, 0.0), map.at(width as f64, height as f64)];
        let finite = ends.iter().all(|end| end.vector().iter().all(|x| x.is_finite()));
        let count = width.checked_mul(height).filter(|count| (1..=MOST_PIXELS).contains(count) && finite);
        let Some(count) = count else { return Err(VolumeError::BadCut { width, height }) };
        let (mut pixels, mut marks) = (vec![0; count], vec![Mark::Unseen; count]);
        let rows = pixels.par_chunks_mut(width).zip(marks.par_chunks_mut(width)).enumerate();
        rows.for_each(|(row, (pixels, marks))| {
            for (column, (pixel, mark)) in pixels.iter_mut().zip(marks).enumerate() {
                let at = map.at(column as f64, row as f64).vector() - self.grid.origin.vector();
                (*pixel, *mark) = self.sample(&self.grid.in_voxels(at), interpolation);
            }
        });
        Ok(Cut { world_from_image: *world_from_image, spacing, width, pixels, marks })
    }

    /// The grey level at a place in voxels.
    fn sample(&self, at: &Vector3<f64>, interpolation: Interpolation) -> (u8, Mark) {
        let unseen = (0, Mark::Unseen);
        let axes = [0, 1, 2].map(|axis| stretch(at[axis], self.grid.size[axis]));
        let [Some(x), Some(y), Some(z)] = axes else { return unseen };
        if interpolation == Interpolation::Nearest {
            return self.voxel([x, y, z].map(|(low, high, part)| if part < 0.5 { low } else { high }));
        }
        let (mut sum, mut worst) = (0.0, Mark::Seen);
        for corner in 0..8_usize {
            let (voxel, weight) = corner_of([x, y, z], corner);
            if weight > 0.0 {
                let (grey, mark) = self.voxel(voxel);
                sum += weight * f64::from(grey);
                worst = worse(worst, mark);
            }
        }
        if worst == Mark::Unseen { unseen } else { (sum.round() as u8, worst) }
    }

    fn voxel(&self, voxel: [usize; 3]) -> (u8, Mark) {
        let index = self.grid.index(voxel);
        let known = index.and_then(|i| Some((*self.grey.get(i)?, *self.marks.get(i)?)));
        known.unwrap_or((0, Mark::Unseen))
    }
}

/// The voxels before and behind a place along an axis, and how far it is between them; at the rim both are the last.
fn stretch(at: f64, size: usize) -> Option<(usize, usize, f64)> {
    let last = size.checked_sub(1)?;
    if !(at >= -0.5 && at < last as f64 + 0.5) {
        return None;
    }
    let at = at.clamp(0.0, last as f64);
    let low = at.floor();
    Some((low as usize, (low as usize + 1).min(last), at - low))
}

fn corner_of(axes: [(usize, usize, f64); 3], corner: usize) -> ([usize; 3], f64) {
    let mut weight = 1.0;
    let voxel = std::array::from_fn(|axis| {
        let (low, high, part) = axes[axis];
        let far = corner >> axis & 1 == 1;
        weight *= if far { part } else { 1.0 - part };
        if far { high } else { low }
    });
    (voxel, weight)
}

const fn worse(one: Mark, other: Mark) -> Mark {
    match (one, other) {
        (Mark::Unseen, _) | (_, Mark::Unseen) => Mark::Unseen,
        (Mark::Filled, _) | (_, Mark::Filled) => Mark::Filled,
        (Mark::Seen, Mark::Seen) => Mark::Seen,
    }
}

impl Cut {
    /// Columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> usize {
        match self.pixels.len().checked_div(self.width) {
            Some(rows) => rows,
            None => 0,
        }
    }

    /// Grey levels, row after row.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// What is known of each pixel, in the same order.
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }
}

impl<'a> From<&'a Cut> for Slice<'a> {
    fn from(cut: &'a Cut) -> Self {
        Self::new(&cut.pixels, cut.width, PixelMap::of(&cut.world_from_image, cut.spacing))
    }
}
