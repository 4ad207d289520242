//! How far a surface is from a gold standard: the paper's rigid fit and error map ([P1] II.C.3, eq. 6).

mod closest;
mod fit;
mod gold;
mod sides;
mod slices;
mod unroll;

use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use closest::{Closest, Nearest};
pub use gold::CompareWarning;
pub use unroll::{Unrolled, unrolled};

use crate::Mesh;

/// Planes in which areas are compared.
const SLICES: usize = 100;

/// Whether the surface is laid on the gold standard first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Fit {
    /// Centre of gravity, then the rigid motion that minimises the distances ([P1] II.C.3).
    #[default]
    Rigid,
    /// From the same starts, iterated closest points to planes, robust: points that lie far off (a branch that the gold
    /// standard has not, an end beyond it) count little or nothing, so that they do not pull the rest.
    Icp,
    /// The rigid motion that minimises the distances, from where both lie: for surfaces already in one system.
    Near,
    /// Not at all: how far is it from where it should be.
    None,
}

/// A surface beside its gold standard. All distances are exact, from points to triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The rigid motion that laid the surface on the gold standard (m). It takes coordinates of the surface's file to the
    /// gold standard's: bare, because files' axes are whatever they are.
    pub gold_from_surface: Isometry3<f64>,
    /// Distance of every point of the surface from the gold standard (mm): the error map, [P1] eq. 6.
    pub error_mm: Vec<f64>,
    /// Statistics of the error map.
    pub error: DistanceStatistics,
    /// The same distances with their signs: negative inside the gold standard, where the surface is too small. Only where
    /// that is closed, which is what having an inside takes.
    pub signed_mm: Option<Vec<f64>>,
    /// Mean of the signed distances (mm).
    pub bias_mm: Option<f64>,
    /// What is the matter with the gold standard, or with how both lie.
    pub warnings: Vec<CompareWarning>,
    /// The way back: distance from the surface of the gold standard's points, those beside the surface (a scan of a part
    /// of the vessel is not blamed for the rest).
    pub gold_error: DistanceStatistics,
    /// The larger of both largest distances (mm).
    pub hausdorff_mm: f64,
    /// Areas in planes across, from one end to the other.
    pub areas: Vec<AreaPair>,
    /// Mean of the relative differences of area, with sign: negative when the surface is too small (%).
    pub area_error_percent: f64,
    /// Mean of their magnitudes (%).
    pub area_error_abs_percent: f64,
}

/// What a set of distances comes to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DistanceStatistics {
    /// How many.
    pub count: usize,
    /// Mean (mm).
    pub mean_mm: f64,
    /// Standard deviation (mm).
    pub sd_mm: f64,
    /// Root of the mean square (mm).
    pub rms_mm: f64,
    /// 95 of 100 are below (mm).
    pub p95_mm: f64,
    /// The largest: the one-sided Hausdorff distance (mm).
    pub max_mm: f64,
}

/// Both areas in one plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AreaPair {
    /// Place of the plane along the surface, from its first end (mm).
    pub at_mm: f64,
    /// The surface's area (mm2).
    pub surface_mm2: f64,
    /// The gold standard's (mm2).
    pub gold_mm2: f64,
}

/// Why two surfaces cannot be compared.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CompareError {
    /// One of them is no surface.
    #[error("the {which} has {points} points and {triangles} triangles: nothing to compare")]
    Empty {
        /// Which.
        which: &'static str,
        /// Points it has.
        points: usize,
        /// Triangles it has.
        triangles: usize,
    },
    /// A number that is not finite.
    #[error("the {which} has a point that is not finite, or a triangle of a point that is not there")]
    Broken {
        /// Which.
        which: &'static str,
    },
    /// Triangles that are lines or points.
    #[error("none of the {which}'s triangles has an area: it is no surface")]
    Flat {
        /// Which.
        which: &'static str,
    },
    /// One is a thousand times the size of the other.
    #[error(
        "the surface is {surface_mm:.3} mm long and the gold standard {gold_mm:.3} mm: the {which} seems to be in metres; surface files \
         are read as millimetres, so scale it by 1000 first, or say its unit"
    )]
    Metres {
        /// The one in metres.
        which: &'static str,
        /// Diagonal of the surface's box (mm).
        surface_mm: f64,
        /// Diagonal of the gold standard's (mm).
        gold_mm: f64,
    },
    /// They cannot be of the same vessel.
    #[error(
        "the surface is {surface_mm:.3} mm long and the gold standard {gold_mm:.3} mm: they are of different things, or one is in another \
         unit; both are read as millimetres"
    )]
    Sizes {
        /// Diagonal of the surface's box (mm).
        surface_mm: f64,
        /// Diagonal of the gold standard's (mm).
        gold_mm: f64,
    },
}

/// Lays `surface` on `gold` as `fit` says and measures every distance.
///
/// # Errors
/// When one of them is empty, has numbers that are not finite, or is in another unit than the other.
pub fn compare(surface: &Mesh, gold: &Mesh, fit: Fit) -> Result<Comparison, CompareError> {
    check(surface, "surface")?;
    check(gold, "gold standard")?;
    let gold = gold::Gold::of(surface, gold, fit)?;
    let on_gold = Nearest::new(&gold.mesh);
    let gold_from_surface = fit::rigid(surface, &gold.mesh, &on_gold, fit);
    let laid = surface.moved(&gold_from_surface);
    let closest = on_gold.to_each(&laid.points);
    let error_mm: Vec<f64> = closest.iter().map(|closest| closest.distance * 1e3).collect();
    let signed_mm = gold.closed.then(|| signed_mm(&on_gold, &laid.points, &closest));
    let axis = fit::Axis::of(&laid);
    let beside: Vec<Vector3<f64>> = gold.mesh.points.iter().copied().filter(|p| axis.is_beside(p)).collect();
    let back = Nearest::new(&laid).to_each(&beside);
    let gold_error = statistics(&back.iter().map(|closest| closest.distance * 1e3).collect::<Vec<_>>());
    let error = statistics(&error_mm);
    let areas = slices::areas(&laid, &gold.mesh, &axis, SLICES);
    let relative = areas.iter().map(|pair| 100.0 * (pair.surface_mm2 / pair.gold_mm2 - 1.0));
    let count = areas.len().max(1) as f64;
    Ok(Comparison {
        gold_from_surface,
        hausdorff_mm: error.max_mm.max(gold_error.max_mm),
        area_error_percent: relative.clone().sum::<f64>() / count,
        area_error_abs_percent: relative.map(f64::abs).sum::<f64>() / count,
        bias_mm: signed_mm.as_ref().map(|signed| signed.iter().sum::<f64>() / signed.len().max(1) as f64),
        signed_mm,
        warnings: gold.warnings,
        error_mm,
        error,
        gold_error,
        areas,
    })
}

fn has_area(mesh: &Mesh, triangle: &[u32; 3]) -> bool {
    let [a, b, c] = mesh.corners(triangle);
    (b - a).cross(&(c - a)).norm() > 0.0
}

fn signed_mm(gold: &Nearest<'_>, places: &[Vector3<f64>], closest: &[Closest]) -> Vec<f64> {
    let sides = sides::Sides::of(gold.mesh());
    places.iter().zip(closest).map(|(place, closest)| sides.signed(gold, place, closest) * 1e3).collect()
}

fn check(mesh: &Mesh, which: &'static str) -> Result<(), CompareError> {
    let (points, triangles) = (mesh.points.len(), mesh.triangles.len());
    if points == 0 || triangles == 0 {
        return Err(CompareError::Empty { which, points, triangles });
    }
    let finite = mesh.points.iter().all(|p| p.iter().all(|x| x.is_finite()));
    let named = mesh.triangles.iter().flatten().all(|&k| (k as usize) < points);
    if finite && named && !mesh.triangles.iter().any(|triangle| has_area(mesh, triangle)) {
        return Err(CompareError::Flat { which });
    }
    if finite && named { Ok(()) } else { Err(CompareError::Broken { which }) }
}

fn statistics(distances: &[f64]) -> DistanceStatistics {
    let mut sorted = distances.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(&max_mm) = sorted.last() else { return DistanceStatistics::default() };
    let n = sorted.len() as f64;
    let mean_mm = sorted.iter().sum::<f64>() / n;
    let square = sorted.iter().map(|d| d * d).sum::<f64>() / n;
    // The nearest rank: the smallest distance that 95 of 100 do not exceed.
    let rank = (0.95 * n).ceil() as usize;
    DistanceStatistics {
        count: sorted.len(),
        mean_mm,
        sd_mm: (square - mean_mm * mean_mm).max(0.0).sqrt(),
        rms_mm: square.sqrt(),
        p95_mm: sorted.get(rank.saturating_sub(1)).copied().unwrap_or(max_mm),
        max_mm,
    }
}

#[cfg(test)]
mod tests;
