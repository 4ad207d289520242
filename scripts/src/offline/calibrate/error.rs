//! Why a calibration was not made.

use std::path::{Path, PathBuf};

use probepath_us_capture::BadCalibration;
use probepath_us_capture::check::CheckError;
use probepath_us_capture::dots::BadDots;
use probepath_us_capture::lag::TemporalError;
use probepath_us_capture::phantom::BadPhantom;
use probepath_us_capture::plus::PlusError;
use probepath_us_capture::sequence::{NoChain, SequenceError};
use probepath_us_capture::shots::BadShots;
use probepath_us_capture::spatial::SpatialError;
use thiserror::Error;

/// What is wrong, where, and what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// A sequence that cannot be read.
    #[error("{}{source}{}", named(path, source), hint(source))]
    Sequence {
        /// The file.
        path: PathBuf,
        /// Why.
        source: SequenceError,
    },
    /// Images and poses that cannot be used together.
    #[error("{}: {source}", path.display())]
    Shots {
        /// The sequence.
        path: PathBuf,
        /// Why.
        source: BadShots,
    },
    /// A phantom that is none.
    #[error("{}: {source}", path.display())]
    Phantom {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: BadPhantom,
    },
    /// Neither a file nor a phantom.
    #[error(
        "--phantom {asked}: there is no such file, and no phantom of that name comes along; there are {}",
        list(shipped)
    )]
    NoPhantom {
        /// What was asked for.
        asked: String,
        /// The names that come along.
        shipped: Vec<String>,
    },
    /// Two signals that give no lag.
    #[error(transparent)]
    Temporal(#[from] TemporalError),
    /// No calibration came out.
    #[error("{}, taken for images of phantom {phantom}: {source}", path.display())]
    Spatial {
        /// The sequence.
        path: PathBuf,
        /// The phantom that was named.
        phantom: String,
        /// Why.
        source: SpatialError,
    },
    /// The image lies in the probe as a mirrored one would.
    #[error(
        "the image is mirrored against what is known of the probe: its {axis} axis points the other way ({angle_deg:.0} degrees \
         off), and so does its normal; correct the images' orientation ({hint}), or what is known"
    )]
    Mirrored {
        /// Which axis.
        axis: &'static str,
        /// How far off it is (degrees).
        angle_deg: f64,
        /// What the orientation probably is.
        hint: &'static str,
    },
    /// A check that could not be made.
    #[error("{}: {source}", path.display())]
    Check {
        /// The scan.
        path: PathBuf,
        /// Why.
        source: CheckError,
    },
    /// A region or a fan that is none.
    #[error(transparent)]
    Mask(#[from] BadDots),
    /// A PLUS configuration that cannot be read.
    #[error("{}: {source}", path.display())]
    Plus {
        /// The file.
        path: PathBuf,
        /// Why.
        source: PlusError,
    },
    /// A name that is no transform's.
    #[error(
        "--poses {asked}: a chain of poses is named FromToTo, as in ProbeToReference; the sequence tracks {}",
        list(there)
    )]
    PosesName {
        /// What was asked for.
        asked: String,
        /// What the sequence tracks.
        there: Vec<String>,
    },
    /// The chain that was asked for is not there.
    #[error("{}: {source}", path.display())]
    Chain {
        /// The file.
        path: PathBuf,
        /// What there is.
        source: NoChain,
    },
    /// No chain that could be the probe's.
    #[error(
        "{}: no pose of a probe: neither the configuration's chain, nor ProbeToReference, nor one transform of Probe; the \
         sequence tracks {}; name the chain with --poses", path.display(), list(there)
    )]
    NoPoses {
        /// The file.
        path: PathBuf,
        /// What the sequence tracks.
        there: Vec<String>,
    },
    /// A calibration file.
    #[error(transparent)]
    Calibration(#[from] BadCalibration),
    /// A folder or file that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The folder or file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A picture that cannot be made.
    #[error("the picture {}: {source}", path.display())]
    Picture {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: png::EncodingError,
    },
    /// A place for the phantom that is none.
    #[error(
        "the phantom's place in the reference system is no rigid pose: {why}; it takes points of the phantom to the reference, in mm"
    )]
    Place {
        /// What is wrong with it.
        why: String,
    },
    /// A place that is to be fixed, and is not given.
    #[error(
        "--place {wish} needs the phantom's place: give --phantom-to-reference, or a PLUS configuration that has it"
    )]
    NoPlace {
        /// What was asked for.
        wish: &'static str,
    },
    /// A size of pixels that is to be known, and is not given.
    #[error(
        "--scale {wish} needs the size of a pixel: give --pixel-mm, or a PLUS configuration with ApproximateSpacingMmPerPixel"
    )]
    NoSpacing {
        /// What was asked for.
        wish: &'static str,
    },
    /// A region outside the image.
    #[error("the region {x},{y},{width},{height} leaves the image of {columns} x {rows} pixels")]
    Region {
        /// First column.
        x: usize,
        /// First row.
        y: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The image's columns.
        columns: usize,
        /// The image's rows.
        rows: usize,
    },
}

fn list(there: &[String]) -> String {
    if there.is_empty() { "no transform at all".into() } else { there.join(", ") }
}

/// The file, unless the error names it itself.
fn named(path: &Path, error: &SequenceError) -> String {
    match error {
        SequenceError::Disk { .. } => String::new(),
        _ => format!("{}: ", path.display()),
    }
}

/// What to type where a file does not say something.
const fn hint(error: &SequenceError) -> &'static str {
    match error {
        SequenceError::NoOrientation => " (--orientation MF, UF, MN or UN)",
        _ => "",
    }
}
