//! What cannot be reconstructed.

use std::path::PathBuf;

use probepath_recon::ReconError;
use probepath_recon::volume::VolumeError;
use probepath_us_capture::exam::ExamError;
use probepath_us_capture::plus::PlusError;
use probepath_us_capture::sequence::{NoChain, SequenceError};
use probepath_us_capture::{BadBScan, BadCalibration, BadPixelMap};
use thiserror::Error;

use super::FinderFault;
use crate::offline::in_file;
use crate::report::build::ReportError;

/// What cannot be reconstructed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReconstructError {
    /// The folder or a file.
    #[error("cannot write {}: {source}", path.display())]
    Folder {
        /// The folder or file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The exam.
    #[error(transparent)]
    Exam(#[from] ExamError),
    /// The sequence.
    #[error("{}", in_file(path, source))]
    Sequence {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: SequenceError,
    },
    /// The PLUS configuration.
    #[error(transparent)]
    Plus(#[from] PlusError),
    /// Our own calibration.
    #[error(transparent)]
    Calibration(#[from] BadCalibration),
    /// The file of a calibration.
    #[error("{}", in_file(path, source))]
    CalibrationFile {
        /// The file.
        path: PathBuf,
        /// Why.
        source: BadCalibration,
    },
    /// A seed that no picture has.
    #[error(
        "the seed at {x_mm}, {y_mm} mm lies outside of the pictures, which are {:.1} x {:.1} mm (--seed-mm, right of the \
         first column and below the first row)", size_mm.0, size_mm.1
    )]
    Seed {
        /// Right of the first column (mm).
        x_mm: f64,
        /// Below the first row (mm).
        y_mm: f64,
        /// Width and height of the pictures (mm).
        size_mm: (f64, f64),
    },
    /// A length that is none.
    #[error("{option} is {found} mm: it has to be {least}")]
    Length {
        /// What was asked for.
        option: &'static str,
        /// How much (mm).
        found: f64,
        /// What it may be.
        least: &'static str,
    },
    /// A calibration that places no pixels.
    #[error(transparent)]
    PixelMap(#[from] BadPixelMap),
    /// The transforms.
    #[error(transparent)]
    Chain(#[from] NoChain),
    /// The volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The volume's files would be larger than allowed.
    #[error(
        "a volume of {} x {} x {} voxels takes {needs_mb} MB on the disk, above the limit of {limit_mb} MB: take larger \
         voxels (--voxel-mm), or allow it (--disk-mb)", size[0], size[1], size[2]
    )]
    VolumeOnDisk {
        /// Voxels along x, y, z.
        size: [usize; 3],
        /// What its files would take (MB, 10^6 bytes).
        needs_mb: u64,
        /// What is allowed (MB).
        limit_mb: u64,
    },
    /// The table of what each part of an image counts.
    #[error("{}: no table of importance: {why}", path.display())]
    Importance {
        /// Its file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// The lumen.
    #[error("{}: {source}", path.display())]
    Lumen {
        /// The exam or sequence.
        path: PathBuf,
        /// Why.
        source: ReconError,
    },
    /// The program that finds lumens in the place of ours.
    #[error(transparent)]
    Finder(#[from] FinderFault),
    /// The report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A sequence without a calibration.
    #[error("{}: a sequence says where the probe was, not where its pixels are: give --calibration FILE (.toml or .xml)", path.display())]
    NoCalibration {
        /// The sequence.
        path: PathBuf,
    },
    /// An exam without B-scans.
    #[error("{}: the exam holds no B-scan", path.display())]
    NoImages {
        /// The exam.
        path: PathBuf,
    },
    /// A sequence in which no image has a place.
    #[error("{}: none of its {images} images has a place: {why}", path.display())]
    NonePlaced {
        /// The sequence.
        path: PathBuf,
        /// How many images there are.
        images: usize,
        /// Reason by reason.
        why: String,
    },
    /// A calibration of pictures of another size.
    #[error(
        "calibration {id} is of another setting: its pictures have {} x {} pixels, those of {} have {} x {}; \
         calibrate the setting that was scanned with", calibrated.0, calibrated.1, path.display(), there.0, there.1
    )]
    OtherSize {
        /// The sequence.
        path: PathBuf,
        /// The calibration.
        id: String,
        /// Columns and rows that it was made for.
        calibrated: (usize, usize),
        /// Columns and rows of the images.
        there: (usize, usize),
    },
    /// A clip region that is not in the picture.
    #[error(
        "the clip rectangle of the configuration begins at {origin:?} and has {size:?} pixels: it is not in pictures \
         of {} x {}", there.0, there.1
    )]
    Clip {
        /// First column and row.
        origin: [usize; 2],
        /// Columns and rows.
        size: [usize; 2],
        /// Columns and rows of the images.
        there: (usize, usize),
    },
    /// A part of a picture that is none.
    #[error(transparent)]
    Picture(#[from] BadBScan),
}
