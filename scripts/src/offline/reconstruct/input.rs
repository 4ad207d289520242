//! What is reconstructed: the images of an exam or of a tracked sequence, each with its place.

use std::collections::BTreeMap;
use std::path::Path;

use probepath_frames::World;
use probepath_recon::LumenSettings;
use probepath_recon::volume::{Slice, VolumeSettings};
use probepath_teach_replay::Path as TaughtPath;
use probepath_us_capture::exam::{Attachment, Ending, Exam};
use probepath_us_capture::plus::PlusConfig;
use probepath_us_capture::sequence::{PlacedSequence, Placing, ReadOptions, Sequence};
use probepath_us_capture::{Calibration, PixelMap, PlacedBScan};

use super::ReconstructError;
use super::clip::clipped;
use super::volume::VOXEL_MM;
use crate::report::Heading;
use crate::report::build::{ScanFigures, Segment};
use crate::session::{CellFile, SCAN_FIGURES, SEGMENTS, SOFTWARE, cell_of, lumen_settings};

/// A calibration whose rigid part is further off than this (m) is worth a note.
const SHEAR_M: f64 = 0.0005;
/// Lags that differ by less than this (s) move no image by more than its error.
const SAME_LAG_S: f64 = 0.5e-3;

/// Images with their places, and what is known about them.
pub(super) struct Input {
    /// What the lumen is looked for in.
    pub(super) images: Vec<PlacedBScan>,
    /// What a volume is built from.
    sweep: Sweep,
    /// Images in all.
    pub(super) total: usize,
    /// Images without a place, by reason.
    pub(super) refused: BTreeMap<String, usize>,
    pub(super) notes: Vec<String>,
    pub(super) heading: Heading,
    pub(super) figures: ScanFigures,
    pub(super) segments: Vec<Segment>,
    pub(super) lumen: LumenSettings,
    pub(super) volume: VolumeSettings,
}

/// What a volume is built from.
enum Sweep {
    /// The very images.
    Itself,
    /// Whole pictures, and where their pixels are by a calibration that need not be rigid.
    Mapped(Vec<(PlacedBScan, PixelMap<World>)>),
}

impl Input {
    /// The images as a volume takes them.
    pub(super) fn slices(&self) -> Vec<Slice<'_>> {
        match &self.sweep {
            Sweep::Itself => self.images.iter().map(Slice::from).collect(),
            Sweep::Mapped(mapped) => mapped
                .iter()
                .map(|(image, map)| Slice::new(image.bscan.pixels(), image.bscan.width(), *map))
                .collect(),
        }
    }

    /// The images of an exam, with the exam's own calibration or another of the same setting.
    pub(super) fn of_exam(input: &Path, calibration: Option<&Path>) -> Result<Self, ReconstructError> {
        let mut exam = Exam::without_ticks(input)?;
        if exam.bscans.is_empty() {
            return Err(ReconstructError::NoImages { path: input.into() });
        }
        let mut notes = notes_of(&exam);
        let cell = told_cell(&exam, &mut notes);
        let own = exam.attachment(Attachment::CALIBRATION).and_then(|a| a.text().ok());
        let own = own.and_then(|text| Calibration::from_toml(text).ok());
        let other = calibration.map(read_own).transpose()?;
        let mut images = std::mem::take(&mut exam.bscans);
        if let Some(other) = &other {
            placed_by(&mut images, other, own.as_ref(), &mut notes)?;
        }
        let used = other.as_ref().or(own.as_ref());
        let figures: ScanFigures = json(&exam, SCAN_FIGURES).unwrap_or_default();
        Ok(Self {
            total: images.len(),
            images,
            sweep: Sweep::Itself,
            refused: BTreeMap::new(),
            notes,
            heading: heading(&exam, used, &figures),
            segments: json(&exam, SEGMENTS).unwrap_or_default(),
            figures,
            lumen: lumen_settings(used, cell.as_ref()),
            volume: VolumeSettings::every_mm(VOXEL_MM),
        })
    }

    /// The images of a sequence that have a place by the calibration.
    pub(super) fn of_sequence(input: &Path, calibration: Option<&Path>) -> Result<Self, ReconstructError> {
        let calibration =
            calibration.ok_or_else(|| ReconstructError::NoCalibration { path: input.into() })?;
        let sequence = Sequence::read(input, &ReadOptions::default())
            .map_err(|source| ReconstructError::Sequence { path: input.into(), source })?;
        let chain = Chain::of(calibration, input, &sequence)?;
        let total = sequence.images().len();
        let mut notes: Vec<String> = sequence.notes().iter().map(ToString::to_string).collect();
        let placed = sequence.place(&chain.placing)?;
        drop(sequence);
        notes.extend(notes_of_placed(&placed));
        let refused: BTreeMap<String, usize> =
            placed.skipped.iter().map(|(why, count)| (why.to_string(), *count)).collect();
        if placed.images.is_empty() {
            let why: Vec<String> = refused.iter().map(|(why, count)| format!("{count} {why}")).collect();
            let (path, why) = (input.into(), why.join(", "));
            return Err(ReconstructError::NonePlaced { path, images: total, why });
        }
        let (mut images, mut mapped) = (Vec::new(), Vec::new());
        for image in placed.images {
            images.push(clipped(&image.bscan, chain.volume.region.rectangle.as_ref())?);
            mapped.push((image.bscan, image.world_from_pixel));
        }
        Ok(Self {
            images,
            sweep: Sweep::Mapped(mapped),
            total,
            refused,
            notes,
            heading: chain.heading,
            figures: ScanFigures::default(),
            segments: Vec::new(),
            lumen: chain.lumen,
            volume: chain.volume,
        })
    }
}

/// Where the pixels of a sequence are, as a calibration or a PLUS configuration says, and what follows from it.
struct Chain {
    placing: Placing,
    volume: VolumeSettings,
    lumen: LumenSettings,
    heading: Heading,
}

impl Chain {
    fn of(file: &Path, input: &Path, sequence: &Sequence) -> Result<Self, ReconstructError> {
        let heading =
            Heading { cell: input.display().to_string(), software: SOFTWARE.into(), ..Heading::default() };
        if file.extension().is_some_and(|ending| ending == "xml") {
            let config = PlusConfig::read(file)?;
            let usual = || VolumeSettings::every_mm(VOXEL_MM);
            return Ok(Self {
                volume: config.volume.as_ref().map_or_else(usual, VolumeSettings::from),
                placing: Placing::from_plus(&config)?,
                lumen: lumen_settings(None, None),
                heading: Heading { calibration: file.display().to_string(), ..heading },
            });
        }
        let calibration = Calibration::read(file)?;
        of_that_size(&calibration, input, sequence)?;
        let map = PixelMap::of(&calibration.probe_from_image, calibration.setting.spacing);
        let setting = Some(calibration.setting);
        Ok(Self {
            placing: Placing { lag: calibration.image_lag, setting, ..Placing::new(map) },
            volume: VolumeSettings::every_mm(VOXEL_MM),
            lumen: lumen_settings(Some(&calibration), None),
            heading: Heading {
                cell: heading.cell,
                software: heading.software,
                ..Heading::of_calibration(&calibration)
            },
        })
    }
}

/// A file says no depth and no zoom, but how many pixels its pictures have: those of the calibration's.
fn of_that_size(
    calibration: &Calibration,
    input: &Path,
    sequence: &Sequence,
) -> Result<(), ReconstructError> {
    let setting = &calibration.setting;
    let count = |length: f64, step: f64| (length / step).round() as usize;
    let calibrated = (
        count(setting.window_width_m, setting.spacing.x_m),
        count(setting.window_height_m, setting.spacing.y_m),
    );
    let there = (sequence.width(), sequence.height());
    if there == calibrated || there == (0, 0) {
        return Ok(());
    }
    let (path, id) = (input.into(), calibration.id.clone());
    Err(ReconstructError::OtherSize { path, id, calibrated, there })
}

fn read_own(path: &Path) -> Result<Calibration, ReconstructError> {
    Calibration::read(path).map_err(|source| ReconstructError::CalibrationFile { path: path.into(), source })
}

/// Gives the images of an exam their place by another calibration of their setting.
fn placed_by(
    images: &mut [PlacedBScan],
    other: &Calibration,
    own: Option<&Calibration>,
    notes: &mut Vec<String>,
) -> Result<(), ReconstructError> {
    for image in images {
        other.check_setting(&image.bscan.setting)?;
        image.world_from_image = image.world_from_probe * other.probe_from_image;
    }
    notes.push(format!("placed by {}, not by the exam's own calibration", other.id));
    let off_s = own.map_or(0.0, |own| own.image_lag.seconds() - other.image_lag.seconds());
    if off_s.abs() > SAME_LAG_S {
        notes.push(format!(
            "its lag differs by {:.1} ms from the one that the exam was recorded with, and the images keep their poses",
            off_s * 1e3
        ));
    }
    Ok(())
}

fn notes_of(exam: &Exam) -> Vec<String> {
    let damaged = exam.damaged.iter();
    let mut notes: Vec<String> =
        damaged.map(|(at, why)| format!("damaged at byte {at}: {why}; the rest was read")).collect();
    if exam.ending != Ending::Complete {
        let ending = &exam.ending;
        notes.push(format!("the recording does not end as it should ({ending:?}); what is there was used"));
    }
    notes
}

/// The exam's cell; where its file cannot be read, what it says of arm and machine is not known, and a note says so.
fn told_cell(exam: &Exam, notes: &mut Vec<String>) -> Option<CellFile> {
    cell_of(exam).unwrap_or_else(|why| {
        notes.push(format!(
            "{why}; how good its arm is and how its machine shows echoes is taken to be the usual"
        ));
        None
    })
}

fn notes_of_placed(placed: &PlacedSequence) -> Vec<String> {
    let mut notes = Vec::new();
    if placed.unstamped > 0 {
        notes.push(format!("{} images carry no stamp", placed.unstamped));
    }
    if placed.off_rigid_m > SHEAR_M {
        notes.push(format!(
            "the calibration is no rigid pose and a pixel size: a rigid one is up to {:.2} mm off; a volume is built \
             with it as it stands, the lumen with the rigid one",
            placed.off_rigid_m * 1e3
        ));
    }
    notes
}

/// An attachment of our own that was kept as JSON.
fn json<T: serde::de::DeserializeOwned>(exam: &Exam, name: &str) -> Option<T> {
    serde_json::from_slice(&exam.attachment(name)?.bytes).ok()
}

fn heading(exam: &Exam, calibration: Option<&Calibration>, figures: &ScanFigures) -> Heading {
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
        ..calibration.map(Heading::of_calibration).unwrap_or_default()
    }
}
