//! One seed of one line: the setting is calibrated on the bench, then the phantom is taught, scanned and reconstructed
//! with that calibration. Only what came out is held against the truth.

use std::path::Path;
use std::sync::Arc;

use probepath_robot::Operator;
use probepath_sim::CellConfig;
use serde::{Deserialize, Serialize};

use super::super::bench::{calibrated_on_the_bench, open};
use super::settings::Row;
use crate::report::SurfaceError;
use crate::session::{CellFile, ScanWish, SectionError, SessionError, StenosisError, TeachWish};

/// What one seed gave.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Outcome {
    /// Why there is no reconstruction.
    pub(super) failed: Option<String>,
    /// True error of the calibration over the image, mean (mm).
    pub(super) calibration_mm: Option<f64>,
    /// Distance of the surface from the true lumen: mean and 95th percentile (mm).
    pub(super) surface_mm: Option<(f64, f64)>,
    /// The same where the surface stands, without a fit.
    #[serde(default)]
    pub(super) in_place_mm: Option<(f64, f64)>,
    /// The same of the branches that were found.
    #[serde(default)]
    pub(super) branches_mm: Option<(f64, f64)>,
    /// Every true stenosis that was scanned whole.
    pub(super) stenoses: Vec<StenosisError>,
    /// Every measured section.
    pub(super) sections: Vec<SectionError>,
    /// Images, and those without a lumen.
    pub(super) images: (usize, usize),
}

impl Outcome {
    /// Of one seed; whatever goes wrong on the way is part of it.
    pub(super) fn of(row: &Row, seed: u64, out: &Path) -> Self {
        // The machine stamps its images up to 40 ms early or late, and nobody has told.
        let row = row.clone().late_by((seed.wrapping_mul(37) % 81) as f64 - 40.0).walled_for(seed);
        let mut outcome = Self::default();
        if let Err(error) = outcome.fill(&row, seed, out) {
            outcome.failed = Some(error.to_string());
        }
        outcome
    }

    fn fill(&mut self, row: &Row, seed: u64, out: &Path) -> Result<(), SessionError> {
        let calibration = self.calibrate(row, seed, out)?;
        let file = CellFile { calibration: Some(calibration), ..cell(&row.cell, &row.name) };
        let quiet = || (Operator::new(), Arc::new(()) as _);
        let mut session = open(&file, seed, &out.join("scan"), quiet())?;
        let path = session.teach(&TeachWish { study: "TABLE2".into(), ..TeachWish::default() })?;
        let scan = session.scan(&path, &ScanWish::default())?;
        session.close()?;
        let lumen = session.reconstruct(&scan, None)?;
        self.images = (lumen.recon.counts.images, lumen.recon.counts.without_lumen);
        self.surface_mm = session.surface_error(&lumen).map(|error| (error.mean, error.p95));
        let pair = |error: SurfaceError| (error.mean, error.p95);
        [self.in_place_mm, self.branches_mm] = session.errors_in_place(&lumen).map(|error| error.map(pair));
        self.stenoses = session.stenosis_errors(&lumen);
        self.sections = session.section_errors(&lumen);
        Ok(())
    }

    /// The setting's calibration as probepath finds it, in a file.
    fn calibrate(&mut self, row: &Row, seed: u64, out: &Path) -> Result<std::path::PathBuf, SessionError> {
        const NAME: &str = "calibration.toml";
        let folder = out.join("bench");
        let mut session = open(&cell(&row.bench, &row.name), seed, &folder, (Operator::new(), Arc::new(())))?;
        let calibrated = calibrated_on_the_bench(&mut session)?;
        self.calibration_mm = session.calibration_error(&calibrated).map(|error| error.in_tissue_mean_mm);
        session.save_calibration(&calibrated, NAME)?;
        session.close()?;
        Ok(folder.join(NAME))
    }
}

fn cell(simulated: &CellConfig, name: &str) -> CellFile {
    CellFile { name: name.into(), simulated: simulated.clone(), ..CellFile::default() }
}
