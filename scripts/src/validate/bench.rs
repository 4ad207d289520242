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

#[cfg(test)]
mod tests {
    use probepath_sim::{CellConfig, Window};
    use probepath_us_capture::point_spread::PointSpread;

    use super::*;

    /// What `factors` (axial, lateral, elevational) times the usual point spread reads as, on the bench, zoomed or not.
    fn off(seed: u64, factors: [f64; 3], window: Window) -> [f64; 3] {
        let mut simulated = CellConfig::wire_phantom();
        simulated.machine.window = window;
        let imaging = &mut simulated.machine.imaging;
        imaging.axial_fwhm_m *= factors[0];
        (imaging.lateral_factor, imaging.elevational_factor) = (factors[1], factors[2]);
        let folder = Folder::new(&format!("spread-{seed}")).unwrap();
        let cell = CellFile { simulated, ..CellFile::wire_phantom() };
        let mut session = open(&cell, seed, folder.path(), (Operator::new(), Arc::new(()))).unwrap();
        let calibrated = calibrated_on_the_bench(&mut session).unwrap();
        session.close().unwrap();
        let stored = calibrated.stored(None);
        let read = stored.quality.unwrap().point_spread.unwrap();
        let (ours, model) = (read.metres(&stored.setting), PointSpread::default());
        // Where the vessel of the phantom and of a thigh lies.
        let depth_m = 34e-3;
        let lateral = ours.lateral_m(depth_m, &stored.setting) / model.lateral_m(depth_m, &stored.setting);
        let axial = ours.axial_fwhm_m / model.axial_fwhm_m;
        let elevational = ours.elevational_m(depth_m) / model.elevational_m(depth_m);
        let off =
            [axial / factors[0], lateral / factors[1], elevational / factors[2]].map(|ratio| ratio - 1.0);
        eprintln!("seed {seed}, {factors:?}: off by {off:.3?}; {read}");
        off
    }

    #[test]
    fn beams_of_other_widths_than_the_models_are_read_from_the_wires() {
        let zoom = Window::Zoom { top_mm: 19.0, height_mm: 30.0 };
        let cases = [(1, [1.43, 1.4, 1.0], zoom), (2, [0.8, 0.8, 1.25], Window::Whole)];
        for (seed, factors, window) in cases {
            let [axial, lateral, elevational] = off(seed, factors, window);
            assert!(axial.abs() < 0.04 && lateral.abs() < 0.04, "seed {seed}: {axial} {lateral}");
            assert!(elevational.abs() < 0.12, "seed {seed}: {elevational}");
        }
    }
}
