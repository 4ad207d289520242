//! Why a step of the session failed.

use std::path::PathBuf;

use probepath_recon::ReconError;
use probepath_robot::drivers::ur::UrError;
use probepath_robot::{RunError, ToolError};
use probepath_sim::CellError;
use probepath_teach_replay::{GuideError, PathError, PlanError, ReplayError};
use probepath_us_capture::exam::ExamError;
use probepath_us_capture::plan::NoPlan;
use probepath_us_capture::pointer::PointerError;
use probepath_us_capture::shots::BadShots;
use probepath_us_capture::spatial::SpatialError;
use probepath_us_capture::{BadCalibration, CaptureError, SourceFault};
use thiserror::Error;

use crate::report::build::ReportError;

/// Why a step failed. The arm is at rest, and what was recorded is in the exam file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SessionError {
    /// A cell file that is none.
    #[error("{file}: {why}")]
    Cell {
        /// The file.
        file: String,
        /// What is wrong, with its line.
        why: String,
    },
    /// The simulated cell cannot be built.
    #[error("the simulated cell cannot be built: {0}")]
    Simulated(#[from] CellError),
    /// The arm on its wire.
    #[error(transparent)]
    Arm(#[from] UrError),
    /// The ultrasound machine on its wire.
    #[error(transparent)]
    Machine(#[from] SourceFault),
    /// A file that cannot be read or written.
    #[error("cannot {doing} {}: {source}", path.display())]
    File {
        /// What was being done.
        doing: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The exam file.
    #[error("the exam file: {0}")]
    Exam(#[from] ExamError),
    /// A wish outside what this cell allows.
    #[error("{what} is {value}: {wanted}")]
    Wish {
        /// Which.
        what: &'static str,
        /// What was asked for, with its unit.
        value: String,
        /// What would be allowed.
        wanted: String,
    },
    /// The taught path, or its file.
    #[error(transparent)]
    Path(#[from] PathError),
    /// The path cannot be replayed.
    #[error("nothing was moved: {0}")]
    Plan(#[from] PlanError),
    /// Hand guiding cannot begin.
    #[error(transparent)]
    Guide(#[from] GuideError),
    /// The replay cannot begin.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A calibration that cannot be written or used.
    #[error(transparent)]
    Calibration(#[from] BadCalibration),
    /// The stored calibration that a cell names.
    #[error(
        "{cell}: its calibration {}: {source}. `probepath scan calibrate` makes one of the cell's setting; without the line \
         `calibration = ...` in the cell's file the nominal one is used",
        path.display()
    )]
    CellCalibration {
        /// The cell's name.
        cell: String,
        /// The calibration's file.
        path: PathBuf,
        /// What is wrong with it, or what differs.
        source: BadCalibration,
    },
    /// A motion was stopped by a fault.
    #[error("{step}: {source}")]
    Motion {
        /// What was being done.
        step: &'static str,
        /// Why, with the last ticks.
        source: Box<RunError>,
    },
    /// A motion that its controller ended before it was done.
    #[error("{step} ended early: {why}")]
    Ended {
        /// What was being done.
        step: &'static str,
        /// Why.
        why: String,
    },
    /// The operator stopped.
    #[error("{step} was stopped by the operator; the arm is at rest")]
    Stopped {
        /// What was being done.
        step: &'static str,
    },
    /// B-scans that cannot be placed.
    #[error("B-scans: {0}")]
    Capture(#[from] CaptureError),
    /// No lumen.
    #[error("reconstruction: {0}")]
    Reconstruction(#[from] ReconError),
    /// The cell has no phantom to calibrate on.
    #[error(
        "the cell has no wire phantom: name one under [phantom] in the cell's file, of a simulated cell under \
         [simulated.subject.wire_phantom]"
    )]
    NoPhantom,
    /// The cell has no ultrasound machine.
    #[error(
        "the cell has no ultrasound machine: name one under [machine] in the cell's file, or scan without looking"
    )]
    NoMachine,
    /// The landmarks that were touched say no place.
    #[error("the phantom's landmarks: {0}")]
    Pointer(#[from] PointerError),
    /// What hangs on the force sensor cannot be told, or its zero not be taken.
    #[error("the tool: {0}")]
    Tool(#[from] ToolError),
    /// No plan for a calibration.
    #[error("nothing was moved: {0}")]
    NoPlan(#[from] NoPlan),
    /// Nothing was seen.
    #[error("no B-scan came: is the ultrasound machine on, and not frozen?")]
    NoImages,
    /// B-scans that cannot be calibrated from.
    #[error(transparent)]
    Shots(#[from] BadShots),
    /// The images gave no calibration.
    #[error("calibration: {0}")]
    Spatial(#[from] SpatialError),
    /// Nobody has said that the arm may move again.
    #[error("the arm stays where it is: {why}")]
    NotConfirmed {
        /// Why.
        why: String,
    },
    /// A step before the one it needs.
    #[error("{0}")]
    Order(&'static str),
    /// The report could not be made.
    #[error("the report: {0}")]
    Report(#[from] ReportError),
}

impl SessionError {
    /// Whether it says only that the operator wanted to stop.
    pub const fn is_stop(&self) -> bool {
        matches!(self, Self::Stopped { .. })
    }
}
