//! `probepath reconstruct`: an exam's lumen once more, or a tracked sequence's volume.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::volume::{Layer, Mark, Slice, Volume, VolumeError, VolumeSettings};
use probepath_recon::{LumenSettings, ReconError, reconstruct_lumen};
use probepath_teach_replay::Path as TaughtPath;
use probepath_us_capture::exam::{Attachment, Ending, Exam, ExamError};
use probepath_us_capture::plus::{PlusConfig, PlusError};
use probepath_us_capture::sequence::{
    NoChain, PlacedSequence, Placing, ReadOptions, Sequence, SequenceError,
};
use probepath_us_capture::{BadCalibration, BadPixelMap, Calibration, PixelMap, PlacedBScan};
use serde::Serialize;
use thiserror::Error;

use crate::progress::Progress;
use crate::report::build::{Ingredients, ReportError, ScanFigures, Segment, make};
use crate::report::{Heading, Report};
use crate::session::{SCAN_FIGURES, SEGMENTS, SOFTWARE};

/// Voxel size when nothing says another (mm).
const VOXEL_MM: f64 = 0.5;

/// A calibration whose rigid part is further off than this (m) is worth a note.
const SHEAR_M: f64 = 0.0005;

/// What was reconstructed.
#[derive(Clone, Debug, Serialize)]
pub struct Reconstructed {
    /// The exam or sequence.
    pub input: PathBuf,
    /// Images that have a place.
    pub images: usize,
    /// Those left out, reason by reason.
    pub left_out: Vec<String>,
    /// What the reader must know.
    pub notes: Vec<String>,
    /// The report, of an exam.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub report: Option<Report>,
    /// The volume, when one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<VolumeMade>,
}

/// A volume that was written.
#[derive(Clone, Debug, Serialize)]
pub struct VolumeMade {
    /// Its file, MHA.
    pub file: PathBuf,
    /// Which voxels were seen (1) or filled (2).
    pub marks: PathBuf,
    /// Voxels along x, y, z.
    pub size: [usize; 3],
    /// Their size (mm).
    pub spacing_mm: [f64; 3],
    /// Voxels that pixels were put into.
    pub seen: usize,
    /// Voxels that were filled.
    pub filled: usize,
    /// Memory it was built in (MB).
    pub memory_mb: f64,
}

/// What cannot be reconstructed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReconstructError {
    /// The folder or a file.
    #[error("cannot write into {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The exam.
    #[error(transparent)]
    Exam(#[from] ExamError),
    /// The sequence.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// The PLUS configuration.
    #[error(transparent)]
    Plus(#[from] PlusError),
    /// Our own calibration.
    #[error(transparent)]
    Calibration(#[from] BadCalibration),
    /// A calibration that places no pixels.
    #[error(transparent)]
    PixelMap(#[from] BadPixelMap),
    /// The transforms.
    #[error(transparent)]
    Chain(#[from] NoChain),
    /// The volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The lumen.
    #[error(transparent)]
    Lumen(#[from] ReconError),
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
}

/// Reconstructs an exam (`.mcap`) or a sequence.
///
/// # Errors
/// When a file cannot be read, nothing says where the pixels are, or nothing can be made of it.
pub fn reconstruct(
    input: &Path,
    calibration: Option<&Path>,
    volume: bool,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Reconstructed, ReconstructError> {
    std::fs::create_dir_all(out).map_err(|source| ReconstructError::Folder { path: out.into(), source })?;
    if input.extension().is_some_and(|ending| ending == "mcap") {
        exam(input, volume, out, progress)
    } else {
        let calibration =
            calibration.ok_or_else(|| ReconstructError::NoCalibration { path: input.into() })?;
        sequence(input, calibration, volume, out, progress)
    }
}

fn exam(
    input: &Path,
    volume: bool,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Reconstructed, ReconstructError> {
    progress.at("reading", 0.0);
    let exam = Exam::open(input)?;
    if exam.bscans.is_empty() {
        return Err(ReconstructError::NoImages { path: input.into() });
    }
    let mut notes: Vec<String> = exam
        .damaged
        .iter()
        .map(|(at, why)| format!("damaged at byte {at}: {why}; the rest was read"))
        .collect();
    if exam.ending != Ending::Complete {
        notes.push(format!(
            "the recording does not end as it should ({:?}); what is there was used",
            exam.ending
        ));
    }
    progress.at("reconstructing", 0.2);
    let recon = reconstruct_lumen(&exam.bscans, &LumenSettings::default())?;
    progress.at("reporting", 0.9);
    let mut figures: ScanFigures = json(&exam, SCAN_FIGURES).unwrap_or_default();
    figures.warnings.extend(notes.iter().cloned());
    let segments: Vec<Segment> = json(&exam, SEGMENTS).unwrap_or_default();
    let from = Ingredients {
        heading: heading(&exam, &figures),
        figures: &figures,
        recon: &recon,
        images: &exam.bscans,
        segments: &segments,
        surface_error: None,
        exam: input,
    };
    let report = make(&from, out)?;
    let volume = volume.then(|| of_images(&exam.bscans, out)).transpose()?;
    let images = exam.bscans.len();
    Ok(Reconstructed {
        input: input.into(),
        images,
        left_out: Vec::new(),
        notes,
        report: Some(report),
        volume,
    })
}

/// An attachment of our own that was kept as JSON.
fn json<T: serde::de::DeserializeOwned>(exam: &Exam, name: &str) -> Option<T> {
    serde_json::from_slice(&exam.attachment(name)?.bytes).ok()
}

fn heading(exam: &Exam, figures: &ScanFigures) -> Heading {
    let calibration = exam.attachment(Attachment::CALIBRATION).and_then(|a| a.text().ok());
    let calibration = calibration.and_then(|text| Calibration::from_toml(text).ok());
    let path = exam.attachment(Attachment::PATH).and_then(|a| a.text().ok());
    let path = path.and_then(|text| TaughtPath::from_text(text, Path::new(Attachment::PATH)).ok());
    let side = path.map_or_else(String::new, |path| format!("{:?}", path.label().side).to_lowercase());
    Heading {
        study: exam.header.study_code.clone(),
        side,
        cell: "recorded".into(),
        protocol: exam.header.protocol.clone(),
        protocol_sha256: exam.header.protocol_sha256.clone(),
        software: format!("{SOFTWARE}, recorded with {}", exam.header.software),
        speed_mm_s: figures.speed_mm_s,
        ..calibration.as_ref().map(Heading::of_calibration).unwrap_or_default()
    }
}

fn of_images(images: &[PlacedBScan], out: &Path) -> Result<VolumeMade, ReconstructError> {
    let slices: Vec<Slice<'_>> = images.iter().map(Slice::from).collect();
    build(&slices, &VolumeSettings::every_mm(VOXEL_MM), out)
}

fn sequence(
    input: &Path,
    calibration: &Path,
    volume: bool,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Reconstructed, ReconstructError> {
    progress.at("reading", 0.0);
    let sequence = Sequence::read(input, &ReadOptions::default())?;
    let (placing, settings) = chain(calibration)?;
    let placed: PlacedSequence = sequence.place(&placing)?;
    progress.at("building", 0.3);
    let slices: Vec<Slice<'_>> = placed.images.iter().map(Slice::from).collect();
    let made = volume.then(|| build(&slices, &settings, out)).transpose()?;
    let mut notes: Vec<String> = sequence.notes().iter().map(ToString::to_string).collect();
    if placed.unstamped > 0 {
        notes.push(format!("{} images carry no stamp", placed.unstamped));
    }
    if placed.off_rigid_m > SHEAR_M {
        notes.push(format!(
            "the calibration is no rigid pose and a pixel size: a rigid one is up to {:.2} mm off; the volume was built \
             with it as it stands",
            placed.off_rigid_m * 1e3
        ));
    }
    if !volume {
        notes.push("nothing was built: ask for --volume".into());
    }
    Ok(Reconstructed {
        input: input.into(),
        images: placed.images.len(),
        left_out: placed
            .skipped
            .iter()
            .map(|(why, count)| format!("{count} images left out: {why}"))
            .collect(),
        notes,
        report: None,
        volume: made,
    })
}

/// Where the pixels are, and how a volume is built, as a calibration or a PLUS configuration says.
fn chain(calibration: &Path) -> Result<(Placing, VolumeSettings), ReconstructError> {
    if calibration.extension().is_some_and(|ending| ending == "xml") {
        let config = PlusConfig::read(calibration)?;
        let settings =
            config.volume.as_ref().map_or_else(|| VolumeSettings::every_mm(VOXEL_MM), VolumeSettings::from);
        return Ok((Placing::from_plus(&config)?, settings));
    }
    let calibration = Calibration::read(calibration)?;
    let map = PixelMap::of(&calibration.probe_from_image, calibration.setting.spacing);
    Ok((Placing { lag: calibration.image_lag, ..Placing::new(map) }, VolumeSettings::every_mm(VOXEL_MM)))
}

fn build(
    slices: &[Slice<'_>],
    settings: &VolumeSettings,
    out: &Path,
) -> Result<VolumeMade, ReconstructError> {
    let volume = Volume::build(slices, settings)?;
    let (file, marks) = (out.join("volume.mha"), out.join("volume-marks.mha"));
    volume.write(&file, Layer::Grey)?;
    volume.write(&marks, Layer::Marks)?;
    Ok(VolumeMade {
        file,
        marks,
        size: volume.grid().size,
        spacing_mm: volume.grid().spacing_m.map(|s| s * 1e3),
        seen: volume.count(Mark::Seen),
        filled: volume.count(Mark::Filled),
        memory_mb: settings.memory_bytes(volume.grid()) as f64 / 1e6,
    })
}

impl fmt::Display for Reconstructed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} images with a place", self.input.display(), self.images)?;
        for line in self.left_out.iter().chain(&self.notes) {
            writeln!(f, "note: {line}")?;
        }
        if let Some(report) = &self.report {
            write!(f, "{report}")?;
        }
        if let Some(volume) = &self.volume {
            let ([x, y, z], [sx, sy, sz]) = (volume.size, volume.spacing_mm);
            writeln!(
                f,
                "volume {x} x {y} x {z} of {sx:.3} x {sy:.3} x {sz:.3} mm, {} voxels seen, {} filled, {:.0} MB to build",
                volume.seen, volume.filled, volume.memory_mb
            )?;
            writeln!(
                f,
                "  {} (which voxels were seen or filled: {})",
                volume.file.display(),
                volume.marks.display()
            )?;
        }
        Ok(())
    }
}
