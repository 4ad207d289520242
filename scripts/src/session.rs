//! The session: one façade over arm, machine, exam file and reconstruction.
//!
//! Connect, teach, replay, reconstruct, report; stop at any instant. Everything that moves goes through the one loop,
//! and every tick of it is recorded. Protocols, the command line and (later) the console speak to this and to nothing
//! below it.

mod calibrate;
mod cell;
mod error;
mod figures;
mod locate;
mod motion;
mod recorded;
mod recorder;
mod report;
mod scan;
mod teach;
mod truth;
mod visit;

use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use probepath_frames::Stamp;
use probepath_robot::{Guard, MotionLimits, Operator};
use probepath_us_capture::exam::{Attachment, Event, ExamHeader, ExamWriter, Level, Pace, Written};

pub use calibrate::{CalibrateWish, Calibrated, Checked, StandardError};
pub use cell::{CellFile, ForceFile, LimitsFile, StoredCalibration};
pub use error::SessionError;
pub use locate::Located;
pub use recorded::protocol_of;
pub(crate) use recorded::row as recorded_row;
pub(crate) use report::SEGMENTS;
pub use report::{ReportWish, Segment};
pub(crate) use scan::SCAN_FIGURES;
pub use scan::{Lumen, Scan, ScanWish};
pub use teach::TeachWish;
pub use truth::{CalibrationTruth, StenosisError};
pub use visit::{CalibrationPlan, PhantomImages, VisitWish, Visits};

use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::report::{Report, SurfaceError};
use cell::Cell;

/// This software, as exams and reports name it.
pub const SOFTWARE: &str = concat!("probepath ", env!("CARGO_PKG_VERSION"));

/// What a session begins with.
pub struct Opening {
    /// The cell.
    pub cell: CellFile,
    /// Seed of the simulated cell.
    pub seed: u64,
    /// Folder for everything that is made.
    pub out: PathBuf,
    /// The protocol that will be run; kept in the exam.
    pub protocol: Protocol,
    /// The day, for paths and the report; never in a simulated exam, whose bytes depend on the seed alone.
    pub date: Option<String>,
    /// Pause, resume, stop.
    pub operator: Operator,
    /// Who hears how far it is.
    pub progress: Arc<dyn Progress>,
}

/// A connected cell with an exam that is being recorded.
pub struct Session {
    cell: Cell,
    guard: Guard,
    opening: Opening,
    exam: Option<ExamWriter>,
    now: Stamp,
    warnings: Vec<String>,
    /// How far smoothing moved the taught path (m), once one was taught.
    smoothed_m: Option<f64>,
    report: Option<Report>,
}

impl Session {
    /// Connects to the cell. Nothing moves yet.
    ///
    /// # Errors
    /// When the cell cannot be connected or built, or the folder cannot be made.
    pub fn open(opening: Opening) -> Result<Self, SessionError> {
        std::fs::create_dir_all(&opening.out).map_err(|source| SessionError::File {
            doing: "make the folder",
            path: opening.out.clone(),
            source,
        })?;
        let cell = Cell::connect(&opening.cell, opening.seed)?;
        let guard = cell.guard(&opening.operator)?;
        Ok(Self {
            cell,
            guard,
            opening,
            exam: None,
            now: Stamp::ZERO,
            warnings: Vec::new(),
            smoothed_m: None,
            report: None,
        })
    }

    /// Pause, resume, stop: a handle for any thread.
    pub const fn operator(&self) -> &Operator {
        &self.opening.operator
    }

    /// Where the exam is recorded.
    pub fn exam_path(&self) -> PathBuf {
        self.opening.out.join("exam.mcap")
    }

    /// The report, once one was made.
    pub const fn last_report(&self) -> Option<&Report> {
        self.report.as_ref()
    }

    /// The limits of every command.
    pub const fn motion_limits(&self) -> &MotionLimits {
        &self.cell.limits
    }

    /// How far a reconstruction is from the lumen that is truly there; only a simulated cell can say.
    pub fn surface_error(&self, lumen: &Lumen) -> Option<SurfaceError> {
        truth::surface_error(self.cell.simulated.truth(), &lumen.recon)
    }

    /// Every true stenosis inside a reconstruction, beside what was found; only a simulated cell can say.
    pub fn stenosis_errors(&self, lumen: &Lumen) -> Vec<StenosisError> {
        truth::stenoses(self.cell.simulated.truth(), &lumen.recon)
    }

    /// How far a calibration is from where the image truly is; only a simulated cell can say.
    pub fn calibration_error(&self, calibrated: &Calibrated) -> CalibrationTruth {
        truth::calibration_error(&self.cell.simulated, calibrated)
    }

    /// RMS error of the force that the skin truly felt along the path (N); only a simulated cell can say.
    pub fn true_force_rms(&self, scan: &Scan) -> Option<f64> {
        truth::force_rms(self.cell.simulated.truth(), scan)
    }

    /// What a reader must know before believing a number; goes into the report.
    pub fn warn(&mut self, text: &str) {
        self.event(Level::Warning, text);
        self.warnings.push(text.to_owned());
    }

    /// A line for whoever watches, kept in the exam.
    pub fn say(&mut self, text: &str) {
        self.opening.progress.say(text);
        self.event(Level::Info, text);
    }

    /// Ends the exam: everything is written when this returns. Dropping a session leaves a readable exam too, without
    /// its summary.
    ///
    /// # Errors
    /// The first that writing met.
    pub fn close(&mut self) -> Result<Option<Written>, SessionError> {
        Ok(self.exam.take().map(ExamWriter::finish).transpose()?)
    }

    fn event(&mut self, level: Level, text: &str) {
        let event = Event { stamp: self.now, level, source: "session".into(), text: text.to_owned() };
        if let Some(exam) = &self.exam {
            exam.event(event);
        }
    }

    /// Begins the exam file with the first step that knows the study's code.
    fn begin_exam(&mut self, study: &str) -> Result<(), SessionError> {
        if self.exam.is_some() {
            return Ok(());
        }
        let protocol = &self.opening.protocol;
        let header = ExamHeader {
            software: SOFTWARE.into(),
            study_code: study.into(),
            protocol: protocol.name.clone(),
            protocol_sha256: ExamHeader::sha256(&protocol.text),
            calibration_id: self.cell.calibration.id.clone(),
            seed: Some(self.opening.seed),
            joint_names: self.cell.facts.model.joint_names().to_vec(),
            period: self.cell.arm.period(),
        };
        let exam = ExamWriter::create(&self.exam_path(), &header, Pace::Simulated)?;
        exam.attach(Attachment::urdf(self.cell.urdf.as_str()));
        exam.attach(Attachment::cell(self.cell.file.text()?));
        exam.attach(Attachment::calibration(self.cell.calibration.to_toml()?));
        exam.attach(Attachment::protocol(protocol.text.as_str()));
        self.exam = Some(exam);
        Ok(())
    }

    /// A file of this session.
    fn file(&self, name: impl AsRef<FilePath>) -> PathBuf {
        self.opening.out.join(name)
    }
}
