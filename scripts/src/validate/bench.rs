//! What every validation does: a session of one seed, taught and scanned.

use std::path::Path;
use std::sync::Arc;

use probepath_robot::Operator;
use probepath_teach_replay::Path as Taught;
use probepath_us_capture::plan::VisitOptions;

use super::ValidateError;
use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::session::{Calibrated, CellFile, Opening, Session, SessionError, TeachWish, VisitWish};

/// Teaches one seed in a folder of its own; with an operator, and who hears of the progress.
pub(super) fn taught(
    cell: &CellFile,
    seed: u64,
    out: &Path,
    (operator, progress): (Operator, Arc<dyn Progress>),
) -> Result<(Session, Taught), ValidateError> {
    let wrong = |source: SessionError| ValidateError::Session { seed, source };
    let mut session = open(cell, seed, out, (operator, progress)).map_err(wrong)?;
    let path =
        session.teach(&TeachWish { study: "VALIDATE".into(), ..TeachWish::default() }).map_err(wrong)?;
    Ok((session, path))
}

/// A session of one seed in a folder of its own.
pub(super) fn open(
    cell: &CellFile,
    seed: u64,
    out: &Path,
    (operator, progress): (Operator, Arc<dyn Progress>),
) -> Result<Session, SessionError> {
    let protocol = Protocol { name: "validate".into(), text: String::new() };
    let (cell, out) = (cell.clone(), out.to_owned());
    Session::open(Opening { cell, seed, out, protocol, date: None, operator, progress })
}

/// What `library/calibrate.rhai` does.
pub(super) fn calibrated_on_the_bench(session: &mut Session) -> Result<Calibrated, SessionError> {
    let located = session.phantom_as_measured()?;
    let options = VisitOptions { clearance_m: 12e-3, ..VisitOptions::default() };
    let plan = session.plan_calibration(&located, &options)?;
    let images = session.visit(&plan.stops, &VisitWish::default())?;
    let others = session.visit(&plan.others, &VisitWish::default())?;
    let calibrated = session.calibrate(&images, &Default::default())?;
    session.check_calibration(&calibrated, &others)
}

/// A folder for the exams of a validation, gone when it is done.
pub(super) struct Folder(std::path::PathBuf);

impl Folder {
    /// A new folder of this process.
    pub(super) fn new(name: &str) -> Result<Self, std::io::Error> {
        let path = std::env::temp_dir().join(format!("probepath-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path)?;
        Ok(Self(path))
    }

    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed stays in the system's folder for such things.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Tells how far a validation is.
pub(super) fn tell(progress: &dyn Progress, what: &str, done: u64, of: u64) {
    progress.at(what, done as f64 / of.max(1) as f64);
}
