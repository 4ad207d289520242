//! Why a volume cannot be built.

use thiserror::Error;

/// What is wrong with the images or settings of a volume.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum VolumeError {
    /// Nothing to build from.
    #[error("no image has a place: nothing to build a volume from")]
    NoImages,
    /// The region leaves no pixel.
    #[error("the clip region leaves no pixel of image {image} ({width} x {height})")]
    NothingLeft {
        /// Which slice.
        image: usize,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
    },
    /// A voxel size or origin that is none.
    #[error("a grid of {size:?} voxels of {spacing_mm:?} mm is none: sizes are positive and finite")]
    BadGrid {
        /// Voxels along x, y, z.
        size: [usize; 3],
        /// Their size (mm).
        spacing_mm: [f64; 3],
    },
    /// More memory than allowed.
    #[error(
        "{size:?} voxels need {needs_mb} MB, the limit is {limit_mb} MB: \
         take larger voxels or a smaller region, or raise the limit"
    )]
    TooLarge {
        /// Voxels along x, y, z.
        size: [u64; 3],
        /// Megabytes needed.
        needs_mb: u64,
        /// Megabytes allowed.
        limit_mb: u64,
    },
    /// Pixels that do not fill their slice, or a place that is not finite.
    #[error("image {image} has {bytes} bytes at {width} columns, or a place that is not finite")]
    BadSlice {
        /// Which slice.
        image: usize,
        /// Its bytes.
        bytes: usize,
        /// Its columns.
        width: usize,
    },
    /// Weights that do not fill their slice.
    #[error("image {image} has {weights} weights for {pixels} pixels: it needs one for each")]
    BadWeights {
        /// Which slice.
        image: usize,
        /// Its weights.
        weights: usize,
        /// Its pixels.
        pixels: usize,
    },
    /// A table of importance that is none.
    #[error(
        "an importance of {columns} x {rows} cells has {weights} weights: it needs one for each, not all zero"
    )]
    BadImportance {
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
        /// Its weights.
        weights: usize,
    },
    /// Too far away to count in voxels.
    #[error("image {image} lies more than 2^29 voxels from the grid: its pose or the voxel size is wrong")]
    OffGrid {
        /// Which slice.
        image: usize,
    },
    /// Sums would overflow.
    #[error("a voxel could take {hits:.1e} pixels, more than can be summed exactly: take smaller voxels")]
    TooDense {
        /// Pixels a voxel could take.
        hits: f64,
    },
    /// An image that cannot be cut.
    #[error(
        "a cut of {width} x {height} pixels is none: 1 to 2^28 of them, at a finite place, of a finite size"
    )]
    BadCut {
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
    },
    /// A live volume of medians.
    #[error("the median looks at all images four times: build it when they are all there, or take the mean")]
    NotLive,
    /// Sweeps whose grey levels cannot be turned into amplitudes.
    #[error("a dynamic range of {dynamic_range_db} dB is none: 20 to 120 dB are")]
    BadRange {
        /// The range that was given.
        dynamic_range_db: f64,
    },
}
