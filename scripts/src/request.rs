//! `probepath scan`: a protocol, a cell, a folder; what comes back is the report.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use probepath_robot::Operator;
use thiserror::Error;

use crate::progress::Progress;
use crate::protocol::{self, Protocol, ProtocolError};
use crate::report::Report;
use crate::session::{CellFile, Opening, Session, SessionError};

/// What was asked for.
#[derive(Clone, Debug)]
pub struct ScanRequest {
    /// The protocol's file, or the name of one that comes along (`calibrate`); the femoral artery when none.
    pub protocol: Option<PathBuf>,
    /// The cell's file; the simulated cell when none.
    pub cell: Option<PathBuf>,
    /// Seed of the simulated cell.
    pub seed: u64,
    /// Folder for everything that is made.
    pub out: PathBuf,
    /// The day, for exams of cells on their wire; a cell that is simulated in this process knows none.
    pub date: Option<String>,
}

/// Why a scan gave no report. What was recorded is in the exam file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The protocol's file.
    #[error("cannot read the protocol {}: {source}", path.display())]
    Protocol {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The protocol did not run to its end.
    #[error("{source}\nThe arm is at rest. {kept}")]
    Ended {
        /// Why.
        source: Box<ProtocolError>,
        /// What is left of it.
        kept: String,
    },
}

impl ScanRequest {
    /// Connects, runs the protocol, closes the exam.
    ///
    /// # Errors
    /// When a file cannot be read, the cell cannot be connected, or the protocol does not run to its end.
    pub fn run(&self, operator: &Operator, progress: Arc<dyn Progress>) -> Result<Report, ScanError> {
        let protocol = self.protocol()?;
        let cell = match self.cell.as_deref() {
            Some(file) => CellFile::read(file)?,
            None if protocol.is_calibration() => CellFile::wire_phantom(),
            None => CellFile::default(),
        };
        let date = self.date.clone().filter(|_| !cell.is_simulated());
        let session = Session::open(Opening {
            cell,
            seed: self.seed,
            out: self.out.clone(),
            protocol: protocol.clone(),
            date,
            operator: operator.clone(),
            progress,
        })?;
        let session = Arc::new(Mutex::new(session));
        let ran = protocol::run(&protocol, &session);
        let mut session = session.lock().unwrap_or_else(PoisonError::into_inner);
        let closed = session.close();
        let exam = session.exam_path();
        if let Err(source) = ran {
            let kept = match &closed {
                Ok(Some(written)) => {
                    format!(
                        "{} ticks and {} B-scans are kept in {}.",
                        written.ticks,
                        written.bscans,
                        exam.display()
                    )
                }
                Ok(None) => "Nothing was recorded.".to_owned(),
                Err(error) => {
                    format!("The exam is readable as far as it was written ({error}): {}.", exam.display())
                }
            };
            return Err(ScanError::Ended { source: Box::new(source), kept });
        }
        closed?;
        let nothing = || Report { exam: exam.display().to_string(), ..Report::default() };
        Ok(session.last_report().cloned().unwrap_or_else(nothing))
    }

    fn protocol(&self) -> Result<Protocol, ScanError> {
        let Some(path) = &self.protocol else { return Ok(Protocol::femoral()) };
        if let Some(known) = path.to_str().and_then(Protocol::of_library).filter(|_| !path.exists()) {
            return Ok(known);
        }
        let text = std::fs::read_to_string(path)
            .map_err(|source| ScanError::Protocol { path: path.clone(), source })?;
        let name =
            path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
        Ok(Protocol { name, text })
    }
}
