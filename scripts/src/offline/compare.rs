//! `probepath compare`: a surface against a gold standard.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::{CompareError as Incomparable, DistanceStatistics, Fit, Mesh, MeshError};
use serde::Serialize;
use thiserror::Error;

/// A surface beside its gold standard; mm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The surface.
    pub surface: PathBuf,
    /// The gold standard.
    pub gold: PathBuf,
    /// Distances of the surface's points from the gold standard ([P1] eq. 6).
    pub error: DistanceStatistics,
    /// The way back, beside the surface.
    pub gold_error: DistanceStatistics,
    /// Hausdorff distance (mm).
    pub hausdorff_mm: f64,
    /// Mean relative difference of area (percent): negative when the surface is too small.
    pub area_error_percent: f64,
    /// Mean magnitude of these differences (percent).
    pub area_error_abs_percent: f64,
    /// What the fit moved the surface by (mm).
    pub moved_mm: [f64; 3],
    /// What it turned it by (degrees).
    pub turned_deg: f64,
}

/// Surfaces that cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A file that is no surface.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Surfaces without anything to compare.
    #[error(transparent)]
    Incomparable(#[from] Incomparable),
}

/// Compares two files; `fit` lays the surface on the gold standard first.
///
/// # Errors
/// When a file is no surface.
pub fn compare(surface: &Path, gold: &Path, fit: bool) -> Result<Comparison, CompareError> {
    let fit = if fit { Fit::Rigid } else { Fit::None };
    let found = probepath_recon::compare(&Mesh::read(surface)?, &Mesh::read(gold)?, fit)?;
    Ok(Comparison {
        surface: surface.into(),
        gold: gold.into(),
        error: found.error,
        gold_error: found.gold_error,
        hausdorff_mm: found.hausdorff_mm,
        area_error_percent: found.area_error_percent,
        area_error_abs_percent: found.area_error_abs_percent,
        moved_mm: (found.gold_from_surface.translation.vector * 1e3).into(),
        turned_deg: found.gold_from_surface.rotation.angle().to_degrees(),
    })
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (there, back) = (&self.error, &self.gold_error);
        writeln!(f, "{} against {}", self.surface.display(), self.gold.display())?;
        writeln!(
            f,
            "error      {:.3} ± {:.3} mm over {} points ([P1] eq. 6)",
            there.mean_mm, there.sd_mm, there.count
        )?;
        writeln!(f, "RMS        {:.3} mm, 95th percentile {:.3} mm", there.rms_mm, there.p95_mm)?;
        writeln!(
            f,
            "back       {:.3} ± {:.3} mm, Hausdorff {:.3} mm",
            back.mean_mm, back.sd_mm, self.hausdorff_mm
        )?;
        writeln!(
            f,
            "area       {:+.1} % on average, {:.1} % in magnitude",
            self.area_error_percent, self.area_error_abs_percent
        )?;
        write!(f, "fit        turned by {:.2} degrees", self.turned_deg)
    }
}
