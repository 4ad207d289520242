//! Volumes from B-scans that know where they were.
//!
//! ```
//! use probepath_recon::volume::{Slice, Volume, VolumeSettings};
//! use probepath_us_capture::PixelMap;
//! use probepath_frames::{Point, World, nalgebra::Vector3};
//!
//! // Two B-scans of 4 x 3 pixels of half a millimetre, half a millimetre apart.
//! let pixels = [[10_u8; 12], [30; 12]];
//! let at = |z| PixelMap::<World>::new(Point::new(0.0, 0.0, z), Vector3::x() * 5e-4, Vector3::y() * 5e-4);
//! let slices = [0.0, 5e-4].map(at).into_iter().zip(&pixels).map(|(map, pixels)| Slice::new(pixels, 4, map));
//! let volume = Volume::build(&slices.collect::<Vec<_>>(), &VolumeSettings::every_mm(0.5))?;
//! // The far edges count as one more column and row, as in PLUS.
//! assert_eq!(volume.grid().size, [5, 4, 2]);
//! assert_eq!(volume.at([3, 2, 1]), Some(30));
//! # Ok::<(), probepath_recon::volume::VolumeError>(())
//! ```
//!
//! The nouns: a [`Slice`] is an image with the places of its pixels; a [`Grid`] says where the voxels are;
//! [`VolumeSettings`] say how pixels become voxels; a [`Volume`] holds grey levels, and for every voxel whether it was
//! [`seen`](Mark::Seen), [`filled`](Mark::Filled) or neither. What does not fit into memory is built and written as
//! [`Tiles`]; a [`LiveVolume`] grows while the sweep goes on; a [`Cut`] is an image out of a volume; a [`SpeckleVolume`]
//! is made of several sweeps over the same tissue.
//!
//! Sums are of integers, so the result depends neither on the order of the images (but for `Latest`, which is about
//! order, and holes between neighbours) nor on the number of threads, nor on being built in parts. What it does not do:
//! deform, register, or show.

mod clip;
mod compound;
mod correlation;
mod cut;
mod error;
mod files;
mod grid;
mod holes;
mod importance;
mod live;
mod memory;
mod rows;
mod settings;
mod slab;
mod slice;
mod speckle;
mod splat;
mod strip;
mod swept;
mod tiles;

pub use correlation::{Correlation, NotComparable};
pub use cut::{Cut, Interpolation};
pub use error::VolumeError;
pub use files::{Layer, Written};
pub use grid::Grid;
pub use importance::Importance;
pub use live::LiveVolume;
pub use settings::{Compounding, Holes, Region, Sticks, Swept, VolumeSettings, Weights};
pub use slice::Slice;
pub use speckle::{SpeckleSettings, SpeckleVolume};
pub use tiles::Tiles;

/// What is known of a voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Mark {
    /// No pixel came near it; its grey level is 0 and means nothing.
    #[default]
    Unseen = 0,
    /// Pixels were put into it.
    Seen = 1,
    /// A hole that was filled.
    Filled = 2,
}

impl Mark {
    /// A grey level and a mark: what a voxel takes when it is done.
    const BYTES: u64 = 2;
}

/// Grey levels on a grid in World (LPS, metres inside, millimetres in files), and what each is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    grid: Grid,
    grey: Vec<u8>,
    marks: Vec<Mark>,
}

impl Volume {
    /// Puts every pixel of the region of every slice into the voxels, then fills holes when asked to.
    ///
    /// # Errors
    /// When there is no slice, the grid needs more memory than allowed, a slice is too far from the grid to count in
    /// voxels, or a voxel could take more pixels than can be summed exactly.
    pub fn build(slices: &[Slice<'_>], settings: &VolumeSettings) -> Result<Self, VolumeError> {
        let grid = settings.grid_for(slices)?;
        let needs = settings.check(slices, &grid)?;
        let layers = grid.size[2];
        Ok(Tiles::of(slices, settings, grid, layers, needs)?.part(0..layers))
    }

    /// Nothing seen.
    fn unseen(grid: Grid) -> Self {
        let voxels = grid.voxels().unwrap_or(0);
        Self { grid, grey: vec![0; voxels], marks: vec![Mark::Unseen; voxels] }
    }

    /// The layers of `grid`, which begins so many layers after this one.
    fn only(&self, skip: usize, grid: Grid) -> Self {
        let layer = grid.size[0] * grid.size[1];
        let part = skip * layer..(skip + grid.size[2]) * layer;
        let grey = self.grey.get(part.clone()).unwrap_or_default().to_vec();
        Self { grid, grey, marks: self.marks.get(part).unwrap_or_default().to_vec() }
    }

    /// Where the voxels are.
    pub const fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Grey levels, x fastest, then y, then z.
    pub fn grey(&self) -> &[u8] {
        &self.grey
    }

    /// What each voxel is worth, in the same order.
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// The grey level of a voxel that was seen or filled.
    pub fn at(&self, voxel: [usize; 3]) -> Option<u8> {
        let index = self.grid.index(voxel)?;
        (*self.marks.get(index)? != Mark::Unseen).then(|| self.grey.get(index).copied())?
    }

    /// How many voxels carry that mark.
    pub fn count(&self, mark: Mark) -> usize {
        self.marks.iter().filter(|m| **m == mark).count()
    }
}
