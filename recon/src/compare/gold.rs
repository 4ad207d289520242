//! What may be wrong with a gold standard, and is said rather than guessed.

use serde::Serialize;
use thiserror::Error;

use super::sides::Closure;
use super::{CompareError, Fit};
use crate::Mesh;

/// A gold standard this many times smaller or larger than the surface is of something else.
const OTHER_SIZE: f64 = 30.0;
/// Within this factor of a thousand it is in metres.
const ABOUT: f64 = 5.0;

/// What is the matter with one of two surfaces that can be compared all the same.
#[derive(Clone, Debug, Error, PartialEq, Serialize)]
#[non_exhaustive]
pub enum CompareWarning {
    /// It has an edge.
    #[error(
        "the gold standard is open: {edges} of its edges have a triangle on one side only. It has no inside, so the distances \
         have no sign; close its ends to know whether the surface is too large or too small"
    )]
    Open {
        /// How many.
        edges: usize,
    },
    /// Its triangles do not agree which side is outside.
    #[error(
        "the gold standard's triangles face different ways, or more than two share an edge, at {edges} edges: the distances \
         have no sign"
    )]
    Folded {
        /// How many.
        edges: usize,
    },
    /// Its triangles face inward.
    #[error(
        "the gold standard is inside out: its triangles face inward. It was turned for this comparison; a mirrored file looks \
         the same, so check its axes (LPS)"
    )]
    InsideOut,
    /// The surface's triangles face inward.
    #[error(
        "the surface is inside out: its triangles face inward; a mirrored file looks the same, so check its axes (LPS)"
    )]
    SurfaceInsideOut,
    /// They lie far from one another, and no fit brought them together.
    #[error(
        "the surface's centre lies {apart_mm:.0} mm from the gold standard's, and {size_mm:.0} mm is how large that is: they are in \
         different systems, or one of them in RAS; fit the surface, or bring both to LPS"
    )]
    Apart {
        /// Distance of the centres (mm).
        apart_mm: f64,
        /// Diagonal of the gold standard's box (mm).
        size_mm: f64,
    },
}

/// A gold standard that is fit to be compared with, and what was wrong with it.
pub(super) struct Gold {
    pub(super) mesh: Mesh,
    pub(super) closed: bool,
    pub(super) warnings: Vec<CompareWarning>,
}

impl Gold {
    pub(super) fn of(surface: &Mesh, gold: &Mesh, fit: Fit) -> Result<Self, CompareError> {
        same_unit(surface, gold)?;
        let (closure, mut mesh) = (Closure::of(gold), gold.clone());
        let mut warnings = Vec::new();
        if closure.open_edges > 0 {
            warnings.push(CompareWarning::Open { edges: closure.open_edges });
        }
        if closure.folded_edges > 0 {
            warnings.push(CompareWarning::Folded { edges: closure.folded_edges });
        }
        if closure.is_closed() && mesh.volume_m3() < 0.0 {
            mesh.triangles.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
            warnings.push(CompareWarning::InsideOut);
        }
        if Closure::of(surface).is_closed() && surface.volume_m3() < 0.0 {
            warnings.push(CompareWarning::SurfaceInsideOut);
        }
        warnings.extend(apart(surface, gold, fit));
        Ok(Self { mesh, closed: closure.is_closed(), warnings })
    }
}

/// Low and high corner of the box round a mesh, and its diagonal (m).
fn span(mesh: &Mesh) -> (nalgebra::Vector3<f64>, f64) {
    let first = mesh.points.first().copied().unwrap_or_default();
    let (low, high) = mesh.points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    ((low + high) / 2.0, (high - low).norm())
}

/// Refuses a gold standard of another unit.
fn same_unit(surface: &Mesh, gold: &Mesh) -> Result<(), CompareError> {
    let (surface_m, gold_m) = (span(surface).1, span(gold).1);
    let (surface_mm, gold_mm) = (surface_m * 1e3, gold_m * 1e3);
    let ratio = surface_m / gold_m;
    let about = |times: f64| (1.0 / ABOUT..ABOUT).contains(&(ratio / times));
    if about(1e3) {
        return Err(CompareError::Metres { which: "gold standard", surface_mm, gold_mm });
    }
    if about(1e-3) {
        return Err(CompareError::Metres { which: "surface", surface_mm, gold_mm });
    }
    if !(1.0 / OTHER_SIZE..OTHER_SIZE).contains(&ratio) {
        return Err(CompareError::Sizes { surface_mm, gold_mm });
    }
    Ok(())
}

/// Surfaces that lie apart although nothing is going to bring them together.
fn apart(surface: &Mesh, gold: &Mesh, fit: Fit) -> Option<CompareWarning> {
    let ((a, reach), (b, size)) = (span(surface), span(gold));
    let apart = (a - b).norm();
    let moved = matches!(fit, Fit::Rigid | Fit::Icp);
    (!moved && apart > (reach + size) / 2.0)
        .then_some(CompareWarning::Apart { apart_mm: apart * 1e3, size_mm: size * 1e3 })
}
