//! The session: one façade over arm, machine, exam file and reconstruction.
//!
//! Connect, teach, replay, reconstruct, report; stop at any instant. Everything that moves goes through the one loop,
//! and every tick of it is recorded. Protocols, the command line and (later) the console speak to this and to nothing
//! below it.

mod arm_alone;
mod bedside;
mod calibrate;
mod cell;
mod error;
mod figures;
mod live;
mod locate;
mod looking;
mod measure;
mod motion;
mod recorded;
mod recorder;
mod report;
mod resume;
mod scan;
mod teach;
mod tool;
mod true_contact;
mod truth;
mod visit;

use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use probepath_frames::{Base, Pose, Stamp, World};
use probepath_robot::{Guard, MotionLimits, Operator, State, Tool, Trip, ZeroWatch};
use probepath_sim::{SimulatedCell, Truth};
use probepath_us_capture::exam::{Attachment, Event, ExamHeader, ExamWriter, Level, Pace, Written};

pub use arm_alone::{ArmRequest, Recovered};
pub use calibrate::{CalibrateWish, Calibrated, Checked, StandardError};
pub use cell::{
    ArmFile, BoxFile, CellFile, ControllerTime, ForceFile, IGTL_PORT, LimitsFile, MachineAddress,
    MachineClock, MachineFile, PhantomFile, PlaneFile, PoseFile, StoredCalibration, WorkspaceFile,
};
pub use error::SessionError;
pub use locate::Located;
pub(crate) use looking::{cell_of, lumen_settings};
pub use measure::{MeasureRequest, Measured, Ratio};
pub use recorded::protocol_of;
pub(crate) use recorded::row as recorded_row;
pub(crate) use report::SEGMENTS;
pub use report::{ReportWish, Segment};
pub(crate) use scan::SCAN_FIGURES;
pub use scan::{Lumen, Scan, ScanWish};
pub use teach::{GuideBy, TeachWish};
pub use tool::IdentifiedTool;
pub use true_contact::TrueContact;
pub use truth::{CalibrationTruth, SectionError, StenosisError};
pub use visit::{CalibrationPlan, PhantomImages, VisitWish, Visits};

use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::report::build::ReportError;
use crate::report::{Report, SurfaceError};
use cell::Cell;
use motion::Punctual;
use recorder::{Stand, Taped};

/// This software, as exams and reports name it.
pub const SOFTWARE: &str = concat!("probepath ", env!("CARGO_PKG_VERSION"));

/// Name of the attachment that says how punctual the ticks of an arm on its wire were: lateness, step time, round trip.
pub const PUNCTUAL: &str = "realtime.json";

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
    /// The force sensor's zero, and where something was felt last.
    zero: ZeroWatch,
    opening: Opening,
    exam: Option<ExamWriter>,
    /// When this session began, and what time it is, by the arm's clock.
    began: Stamp,
    now: Stamp,
    warnings: Vec<String>,
    /// How far smoothing moved the taught path (m), once one was taught.
    smoothed_m: Option<f64>,
    report: Option<Report>,
    /// Whether nothing was moved since the arm was recovered: what comes first is slow.
    resuming: bool,
    /// How punctual its motions were, where the arm keeps the wall's time.
    punctual: Option<Punctual>,
    /// A scan that was stopped on its way.
    stopped: Option<resume::Underway>,
}

impl Session {
    /// Connects to the cell. Nothing moves yet.
    ///
    /// # Errors
    /// When the cell cannot be connected or built, or the folder cannot be made.
    pub fn open(opening: Opening) -> Result<Self, SessionError> {
        Self::make_folder(&opening.out)?;
        let cell = Cell::connect(&opening.cell, opening.seed)?;
        Self::beside(cell, opening)
    }

    fn make_folder(out: &FilePath) -> Result<(), SessionError> {
        let wrong = |source| SessionError::File { doing: "make the folder", path: out.into(), source };
        std::fs::create_dir_all(out).map_err(wrong)
    }

    /// A session of a connected cell.
    fn beside(cell: Cell, opening: Opening) -> Result<Self, SessionError> {
        let guard = cell.guard(&opening.operator)?;
        let punctual = (cell.pace == Pace::RealTime).then(Punctual::default);
        let zero = cell.zero_watch(Tool::none());
        Ok(Self {
            zero,
            resuming: false,
            punctual,
            cell,
            guard,
            opening,
            exam: None,
            began: Stamp::ZERO,
            now: Stamp::ZERO,
            warnings: Vec::new(),
            smoothed_m: None,
            report: None,
            stopped: None,
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

    /// Where the room is from the arm's base.
    pub(crate) fn base_from_world(&self) -> Pose<Base, World> {
        self.cell.facts.world_from_base.inverse()
    }

    /// The stamp of the last tick.
    pub(crate) const fn now(&self) -> Stamp {
        self.now
    }

    /// The limits of every command.
    pub const fn motion_limits(&self) -> &MotionLimits {
        &self.cell.limits
    }

    /// How far a reconstruction is from the lumen that is truly there; only a simulated cell can say.
    pub fn surface_error(&self, lumen: &Lumen) -> Option<SurfaceError> {
        truth::surface_error(self.truth()?, &lumen.recon)
    }

    /// The same where the surface stands, without a fit; and the branches that were found.
    pub fn errors_in_place(&self, lumen: &Lumen) -> [Option<SurfaceError>; 2] {
        let truth = self.truth();
        type Error = fn(&Truth, &probepath_recon::LumenReconstruction) -> Option<SurfaceError>;
        let of = |error: Error| error(truth?, &lumen.recon);
        [of(truth::error_in_place), of(truth::branch_error)]
    }

    /// Every true stenosis inside a reconstruction, beside what was found; only a simulated cell can say.
    pub fn stenosis_errors(&self, lumen: &Lumen) -> Vec<StenosisError> {
        self.truth().map(|truth| truth::stenoses(truth, &lumen.recon)).unwrap_or_default()
    }

    /// Every measured section of a reconstruction beside the true one; only a simulated cell can say.
    pub fn section_errors(&self, lumen: &Lumen) -> Vec<SectionError> {
        self.truth().map(|truth| truth::sections(truth, &lumen.recon)).unwrap_or_default()
    }

    /// How far a calibration is from where the image truly is; only a simulated cell can say.
    pub fn calibration_error(&self, calibrated: &Calibrated) -> Option<CalibrationTruth> {
        Some(truth::calibration_error(self.cell.simulated.as_ref()?, calibrated))
    }

    fn truth(&self) -> Option<&Truth> {
        self.cell.simulated.as_ref().map(SimulatedCell::truth)
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

    /// After the arm stopped by itself or was stopped: asks a person whether the cause was found; on a yes the arm is made
    /// ready to move again, asked where it is, and the guard is told. Nothing moves, and what comes first is slow.
    ///
    /// # Errors
    /// When nobody says yes, the arm cannot be made ready, does not answer, or is not fit to move: the error says what
    /// to do first.
    pub fn recover(&mut self) -> Result<(), SessionError> {
        const STEP: &str = "recovering";
        let question =
            "Look at the arm. Was the cause of the stop found, and may it move again, slowly at first?";
        if !self.opening.progress.confirm(question) {
            return Err(SessionError::NotConfirmed { why: "nobody said yes".into() });
        }
        let done = self.cell.arm.recover()?;
        // Only now: what begins the exam asks the arm.
        self.begin_exam("RECOVERY")?;
        self.say(&done);
        let state = self.ask_where(STEP, "recover")?;
        let refused = |trip: Trip| SessionError::Ended { step: STEP, why: trip.to_string() };
        self.guard.confirm(&state).map_err(refused)?;
        self.resuming = true;
        self.say("The arm may move again.");
        Ok(())
    }

    /// Where the arm says that it is; asking is an exchange like any other, and is kept like one.
    fn ask_where(&mut self, step: &'static str, phase: &'static str) -> Result<State, SessionError> {
        let exam = self.exam.as_ref().ok_or(SessionError::Order("the exam was not begun"))?;
        let stand = || Stand { phase, along_m: None, look: false, fraction: 0.0 };
        let mut taped = Taped { arm: &mut *self.cell.arm, exam, facts: &self.cell.facts, stand: &stand };
        let state = motion::ask(step, &mut taped)?;
        self.now = state.stamp;
        Ok(state)
    }

    /// Ends the exam: everything is written when this returns. Dropping a session leaves a readable exam too, without
    /// its summary.
    ///
    /// # Errors
    /// The first that writing met.
    pub fn close(&mut self) -> Result<Option<Written>, SessionError> {
        if let Some(unseen) = self.punctual.as_ref().map(Punctual::unseen).filter(|unseen| *unseen > 0) {
            self.warn(&format!(
                "{unseen} ticks are not in the exam: this computer was too slow to record them."
            ));
        }
        let punctual = self.punctual.as_ref().and_then(Punctual::text).transpose();
        if let (Some(exam), Some(text)) = (&self.exam, punctual.map_err(ReportError::from)?) {
            exam.attach(Attachment::new(PUNCTUAL, "application/json", text));
        }
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
        let (protocol, calibration) = (&self.opening.protocol, self.cell.calibration.as_ref());
        let header = ExamHeader {
            software: SOFTWARE.into(),
            study_code: study.into(),
            protocol: protocol.name.clone(),
            protocol_sha256: ExamHeader::sha256(&protocol.text),
            calibration_id: calibration.map(|known| known.id.clone()).unwrap_or_default(),
            // A cell on its wire has none, whatever simulates it.
            seed: self.cell.file.is_simulated().then_some(self.opening.seed),
            joint_names: self.cell.facts.model.joint_names().to_vec(),
            period: self.cell.arm.period(),
        };
        let exam = ExamWriter::create(&self.exam_path(), &header, self.cell.pace)?;
        exam.attach(Attachment::urdf(self.cell.urdf.as_str()));
        exam.attach(Attachment::cell(self.cell.file.text()?));
        if let Some(calibration) = calibration {
            exam.attach(Attachment::calibration(calibration.to_toml()?));
        }
        exam.attach(Attachment::protocol(protocol.text.as_str()));
        self.exam = Some(exam);
        let zeroed = self.zero_sensor();
        if zeroed.is_err() {
            // Not begun: the next step begins it again, and zeroes again.
            self.exam = None;
        }
        zeroed
    }

    /// On a wire the force sensor has a bias until somebody takes it off, and a clock of its own.
    fn zero_sensor(&mut self) -> Result<(), SessionError> {
        if self.cell.file.is_simulated() {
            return Ok(());
        }
        self.began = self.ask_where("connecting", "connect")?.stamp;
        self.say("The force sensor is zeroed: the probe has to hang in the air, untouched.");
        self.cell.arm.zero_sensor()
    }

    /// A file of this session.
    fn file(&self, name: impl AsRef<FilePath>) -> PathBuf {
        self.opening.out.join(name)
    }
}
