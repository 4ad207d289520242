//! `probepath convert`: between the formats of sequences, volumes and surfaces; an exam's B-scans to DICOM.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::volume::{Layer, Volume};
use probepath_recon::{Mesh, MeshError};
use probepath_teach_replay::Path as TaughtPath;
use probepath_us_capture::exam::{Attachment, Exam, ExamError};
use probepath_us_capture::sequence::{ReadOptions, Sequence, SequenceError};
use serde::Serialize;
use thiserror::Error;

use super::in_file;
use crate::dicom::{Date, DicomError, Study, multi_frame};

/// What was converted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Converted {
    /// What was read.
    pub input: PathBuf,
    /// What was written.
    pub output: PathBuf,
    /// What it is, in words.
    pub what: String,
    /// What was assumed or changed on the way.
    pub notes: Vec<String>,
}

/// What cannot be converted.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ConvertError {
    /// A pair of formats with no way between them.
    #[error(
        "no way from {} to {}: sequences are .igs.mha, .igs.mhd, .igs.nrrd; volumes .mha, .nrrd; surfaces .stl, .ply, .vtp; an exam \
         (.mcap) becomes DICOM (.dcm)",
        input.display(), output.display()
    )]
    NoWay {
        /// What would be read.
        input: PathBuf,
        /// What would be written.
        output: PathBuf,
    },
    /// A sequence or a volume.
    #[error("{}", in_file(path, source))]
    Sequence {
        /// Its file.
        path: PathBuf,
        /// Why.
        source: SequenceError,
    },
    /// A surface.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// An exam.
    #[error(transparent)]
    Exam(#[from] ExamError),
    /// DICOM.
    #[error("{}", in_file(path, source))]
    Dicom {
        /// The exam.
        path: PathBuf,
        /// Why.
        source: DicomError,
    },
}

/// What an ending says a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Sequence,
    Volume,
    Surface,
    Exam,
    Dicom,
}

/// Most bytes that are unpacked.
const MOST_BYTES: u64 = 4 << 30;

/// Converts one file. `no_burned_in` is somebody's word that nothing is written into an exam's pictures.
///
/// # Errors
/// When there is no way between the two, or one cannot be read or written.
pub fn convert(input: &Path, output: &Path, no_burned_in: bool) -> Result<Converted, ConvertError> {
    let mut notes = Vec::new();
    let what = match (kind(input), kind(output)) {
        (Some(Kind::Sequence), Some(Kind::Sequence)) => {
            let sequence = Sequence::read(input, &ReadOptions::default()).map_err(at(input))?;
            notes.extend(sequence.notes().iter().map(ToString::to_string));
            sequence.write(output).map_err(at(output))?;
            format!("{} images of {} x {}", sequence.images().len(), sequence.width(), sequence.height())
        }
        (Some(Kind::Volume), Some(Kind::Volume)) => {
            let volume = Volume::read(input, MOST_BYTES).map_err(at(input))?;
            volume.write(output, Layer::Grey).map_err(at(output))?;
            let [x, y, z] = volume.grid().size;
            format!("a volume of {x} x {y} x {z}")
        }
        (Some(Kind::Surface), Some(Kind::Surface)) => {
            let mesh = Mesh::read(input)?;
            mesh.write(output)?;
            format!("a surface of {} points and {} triangles", mesh.points.len(), mesh.triangles.len())
        }
        (Some(Kind::Exam), Some(Kind::Dicom)) => dicom(input, output, no_burned_in, &mut notes)?,
        _ => return Err(ConvertError::NoWay { input: input.into(), output: output.into() }),
    };
    Ok(Converted { input: input.into(), output: output.into(), what, notes })
}

fn at(path: &Path) -> impl FnOnce(SequenceError) -> ConvertError {
    let path = path.to_owned();
    |source| ConvertError::Sequence { path, source }
}

/// The B-scans of an exam as a multi-frame image.
fn dicom(
    input: &Path,
    output: &Path,
    no_burned_in: bool,
    notes: &mut Vec<String>,
) -> Result<String, ConvertError> {
    let exam = Exam::open(input)?;
    notes.extend(
        exam.damaged.iter().map(|(at, why)| format!("damaged at byte {at}: {why}; the rest was read")),
    );
    let path = exam.attachment(Attachment::PATH).and_then(|a| a.text().ok());
    let path = path.and_then(|text| TaughtPath::from_text(text, Path::new(Attachment::PATH)).ok());
    let side = path.map_or_else(String::new, |path| format!("{:?}", path.label().side).to_lowercase());
    let study = Study::of(&exam.header.study_code, &side, Date::of_file(input), &exam.bscans);
    // A simulated machine writes nothing into its pictures.
    let burned_in = (no_burned_in || exam.header.seed.is_some()).then_some(false);
    let frames = multi_frame(&exam.bscans, &study, burned_in, output)
        .map_err(|source| ConvertError::Dicom { path: input.into(), source })?;
    notes.extend(frames.notes);
    Ok(format!("{} B-scans of {} x {}", frames.count, frames.size.0, frames.size.1))
}

fn kind(path: &Path) -> Option<Kind> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    if ends(&[".igs.mha", ".igs.mhd", ".igs.nrrd"]) {
        Some(Kind::Sequence)
    } else if ends(&[".mha", ".nrrd"]) {
        Some(Kind::Volume)
    } else if ends(&[".stl", ".ply", ".vtp"]) {
        Some(Kind::Surface)
    } else if ends(&[".mcap"]) {
        Some(Kind::Exam)
    } else if ends(&[".dcm"]) {
        Some(Kind::Dicom)
    } else {
        None
    }
}

impl fmt::Display for Converted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        write!(f, "{}: {}, written to {}", self.input.display(), self.what, self.output.display())
    }
}
