//! What only a simulation knows: how far a reconstruction is from the lumen that was truly there. Asked after the
//! reconstruction has given its answer; nothing here flows back into it.

mod gold;
mod sections;

use probepath_recon::{Fit, LumenReconstruction, LumenSurface, compare};
use probepath_sim::{SimulatedCell, Truth, Vessel};
use serde::{Deserialize, Serialize};

use super::Calibrated;
use super::calibrate::apart;
use crate::report::SurfaceError;
pub use sections::SectionError;

/// How much true surface lies beyond the reconstructed one at both ends (m), so that no end is compared with an edge.
const BEYOND_M: f64 = 0.015;
/// A true stenosis beside the one that was found there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StenosisError {
    /// Lost area in truth (percent).
    pub true_percent_area: f64,
    /// Lost area as found (percent); none when nothing was found within a centimetre.
    pub found_percent_area: Option<f64>,
}

/// Distance of the reconstructed grid's measured points from the true lumen after a rigid fit ([P1] eq. 6).
pub(super) fn surface_error(truth: &Truth, recon: &LumenReconstruction) -> Option<SurfaceError> {
    mean_and_p95(error_map(truth, recon, &recon.surface, Fit::Near)?)
}

/// The same where the surface stands, without a fit: what calibration and arm have moved is in it.
pub(super) fn error_in_place(truth: &Truth, recon: &LumenReconstruction) -> Option<SurfaceError> {
    mean_and_p95(error_map(truth, recon, &recon.surface, Fit::None)?)
}

/// The branches that were found, where they stand, beside the joined lumen; none where none was found.
pub(super) fn branch_error(truth: &Truth, recon: &LumenReconstruction) -> Option<SurfaceError> {
    let branches = recon.vessels.iter().skip(1);
    let each = branches.filter_map(|branch| error_map(truth, recon, &branch.surface, Fit::None));
    mean_and_p95(each.flatten().collect())
}

fn mean_and_p95(mut distances: Vec<f64>) -> Option<SurfaceError> {
    distances.sort_by(f64::total_cmp);
    let p95 = *distances.get(distances.len() * 95 / 100)?;
    Some(SurfaceError { mean: distances.iter().sum::<f64>() / distances.len() as f64, p95 })
}

/// Distances of a grid's points (mm), but for rows that no image shows: those only bridge a gap.
fn error_map(
    truth: &Truth,
    recon: &LumenReconstruction,
    surface: &LumenSurface,
    fit: Fit,
) -> Option<Vec<f64>> {
    let vessel = truth.subject().main()?;
    let (from, until) = reach(vessel, recon)?;
    let gold = gold::gold(truth.subject().vessels(), from..until);
    let compared = compare(&surface.mesh(), &gold, fit).ok()?;
    let rows = compared.error_mm.chunks(surface.around).zip(&surface.measured);
    let seen = rows.filter(|(_, measured)| **measured).flat_map(|(row, _)| row.iter().copied());
    Some(seen.collect())
}

/// The arc lengths of the true vessel that the reconstruction covers, and a little beyond.
fn reach(vessel: &Vessel, recon: &LumenReconstruction) -> Option<(f64, f64)> {
    let ends = [recon.centreline.at(0.0)?, recon.centreline.at(recon.centreline.length_m())?];
    let [a, b] = ends.map(|end| vessel.nearest(end.point));
    Some(((a.min(b) - BEYOND_M).max(0.0), (a.max(b) + BEYOND_M).min(vessel.length_m())))
}

/// Every measured section beside the true one.
pub(super) fn sections(truth: &Truth, recon: &LumenReconstruction) -> Vec<SectionError> {
    sections::sections(truth.subject().vessels(), recon)
}

/// Every true stenosis that lies whole inside the reconstruction, beside what was found.
pub(super) fn stenoses(truth: &Truth, recon: &LumenReconstruction) -> Vec<StenosisError> {
    let Some(vessel) = truth.subject().main() else { return Vec::new() };
    let Some((from, until)) = reach(vessel, recon) else { return Vec::new() };
    let covered = (from + BEYOND_M, until - BEYOND_M);
    let inside = |s: &&probepath_sim::Stenosis| {
        s.at_m - s.length_m / 2.0 > covered.0 && s.at_m + s.length_m / 2.0 < covered.1
    };
    vessel
        .stenoses()
        .iter()
        .filter(inside)
        .map(|stenosis| StenosisError {
            true_percent_area: 100.0 * stenosis.area_fraction,
            found_percent_area: found_near(vessel, stenosis.at_m, recon),
        })
        .collect()
}

fn found_near(vessel: &Vessel, at_m: f64, recon: &LumenReconstruction) -> Option<f64> {
    recon
        .stenoses
        .iter()
        .filter_map(|found| {
            let place = recon.centreline.at(found.at_mm * 1e-3)?.point;
            Some(((vessel.nearest(place) - at_m).abs(), found.percent_area))
        })
        .filter(|(away, _)| *away < 0.010)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, percent)| percent)
}

/// How far a calibration is from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CalibrationTruth {
    /// Distance of a pixel's place in the probe from where it truly was in the water: mean over the image (mm).
    pub mean_mm: f64,
    /// Its 95th percentile over the image (mm).
    pub p95_mm: f64,
    /// Its root mean square over the image (mm).
    pub rms_mm: f64,
    /// The mean for scanning tissue, as the calibration is stored: mean over the image (mm).
    pub in_tissue_mean_mm: f64,
    /// Error of the lag (ms).
    pub lag_ms: f64,
}

/// How far a calibration is from where the image truly is.
pub(super) fn calibration_error(cell: &SimulatedCell, calibrated: &Calibrated) -> CalibrationTruth {
    let (truth, fit, size) = (cell.truth(), &calibrated.spatial.fit, calibrated.size);
    let (seen, spacing) = truth.seen_from_image(&calibrated.setting);
    let [mean, p95, rms] = apart((&fit.probe_from_image, fit.spacing), (&seen, spacing), size);
    let machines = calibrated.setting.spacing;
    let in_tissue = truth.probe_from_image(&calibrated.setting);
    let tissue = apart((&calibrated.in_tissue(), machines), (&in_tissue, machines), size);
    // The machine stamps by the latency in the cell's file: what that is short of the truth is what images are late.
    let late = truth.image_latency().seconds() - cell.nominal().image_latency.seconds();
    CalibrationTruth {
        mean_mm: mean * 1e3,
        p95_mm: p95 * 1e3,
        rms_mm: rms * 1e3,
        in_tissue_mean_mm: tissue[0] * 1e3,
        lag_ms: (fit.lag.seconds() + late) * 1e3,
    }
}
