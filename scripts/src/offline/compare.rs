//! `probepath compare`: a surface against a gold standard.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::{CompareError as Incomparable, DistanceStatistics, Mesh, MeshError};
use serde::Serialize;
use thiserror::Error;

pub use probepath_recon::Fit;

use crate::report::error_map::ErrorMap;
use crate::report::picture::Picture;

/// What is to be compared, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareWish {
    /// The surface.
    pub surface: PathBuf,
    /// The gold standard.
    pub gold: PathBuf,
    /// How the surface is laid on the gold standard first.
    pub fit: Fit,
    /// What one unit of the gold standard's file is (mm): surface files do not say theirs.
    pub gold_unit_mm: f64,
    /// Folder for the error map as pictures and as a coloured mesh, when it is wanted.
    pub out: Option<PathBuf>,
}

/// A surface beside its gold standard; mm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The surface.
    pub surface: PathBuf,
    /// The gold standard.
    pub gold: PathBuf,
    /// Distances of the surface's points from the gold standard ([P1] eq. 6).
    pub error: DistanceStatistics,
    /// Mean of the same with their signs, negative where the surface is too small; none where the gold standard has no
    /// inside (mm).
    pub bias_mm: Option<f64>,
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
    /// What is the matter with the gold standard, or with how both lie.
    pub warnings: Vec<String>,
    /// The error map: pictures and coloured meshes.
    pub files: Vec<PathBuf>,
}

/// Surfaces that cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A file that is no surface, or cannot be written.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Surfaces without anything to compare.
    #[error("{} against {}: {source}{}", surface.display(), gold.display(), hint(source))]
    Incomparable {
        /// The surface.
        surface: PathBuf,
        /// The gold standard.
        gold: PathBuf,
        /// Why.
        source: Incomparable,
    },
    /// A unit that is no size.
    #[error("a gold standard's unit of {found} mm is none: it has to be positive")]
    Unit {
        /// What was given.
        found: f64,
    },
    /// A picture cannot be drawn.
    #[error("a picture cannot be drawn: {0}")]
    Picture(#[from] png::EncodingError),
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// What to type when the unit is the matter.
fn hint(source: &Incomparable) -> &'static str {
    match source {
        Incomparable::Metres { which: "gold standard", .. } => " (--gold-unit m)",
        _ => "",
    }
}

/// Compares two files.
///
/// # Errors
/// When a file is no surface, the two are no pair, or a file cannot be written.
pub fn compare(wish: &CompareWish) -> Result<Comparison, CompareError> {
    let unit = wish.gold_unit_mm;
    if !(unit.is_finite() && unit > 0.0) {
        return Err(CompareError::Unit { found: unit });
    }
    let (surface, mut gold) = (Mesh::read(&wish.surface)?, Mesh::read(&wish.gold)?);
    gold.points.iter_mut().for_each(|p| *p *= unit);
    let refused = |source| {
        let (surface, gold) = (wish.surface.clone(), wish.gold.clone());
        CompareError::Incomparable { surface, gold, source }
    };
    let found = probepath_recon::compare(&surface, &gold, wish.fit).map_err(refused)?;
    let laid = surface.moved(&found.gold_from_surface);
    let distance_mm = found.signed_mm.as_ref().unwrap_or(&found.error_mm);
    let map = ErrorMap { mesh: &laid, distance_mm, signed: found.signed_mm.is_some() };
    let files = wish.out.as_deref().map(|folder| save(&map, folder)).transpose()?;
    Ok(Comparison {
        surface: wish.surface.clone(),
        gold: wish.gold.clone(),
        error: found.error,
        bias_mm: found.bias_mm,
        gold_error: found.gold_error,
        hausdorff_mm: found.hausdorff_mm,
        area_error_percent: found.area_error_percent,
        area_error_abs_percent: found.area_error_abs_percent,
        moved_mm: (found.gold_from_surface.translation.vector * 1e3).into(),
        turned_deg: found.gold_from_surface.rotation.angle().to_degrees(),
        warnings: found.warnings.iter().map(ToString::to_string).collect(),
        files: files.unwrap_or_default(),
    })
}

/// Leaves the error map as two pictures and two coloured meshes; gives their names.
fn save(map: &ErrorMap<'_>, folder: &Path) -> Result<Vec<PathBuf>, CompareError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| CompareError::File { path, source }
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let mut files = Vec::new();
    let pictures: [(&str, Option<Picture>); 2] =
        [("error-map.png", map.laid_flat()), ("error-surface.png", map.on_surface())];
    for (name, picture) in pictures {
        let Some(picture) = picture else { continue };
        let path = folder.join(name);
        std::fs::write(&path, picture.png()?).map_err(failed(&path))?;
        files.push(path);
    }
    let coloured = map.coloured();
    for name in ["error-map.ply", "error-map.vtp"] {
        let path = folder.join(name);
        coloured.write(&path)?;
        files.push(path);
    }
    Ok(files)
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
        if let Some(bias) = self.bias_mm {
            writeln!(f, "with sign  {bias:+.3} mm on average (negative: the surface is too small)")?;
        }
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
        let moved = self.moved_mm.iter().map(|x| x * x).sum::<f64>().sqrt();
        write!(f, "fit        moved by {moved:.2} mm, turned by {:.2} degrees", self.turned_deg)?;
        for warning in &self.warnings {
            write!(f, "\nnote: {warning}")?;
        }
        for file in &self.files {
            write!(f, "\n  {}", file.display())?;
        }
        Ok(())
    }
}
