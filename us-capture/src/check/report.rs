//! A check's answer as programs and people read it.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::Serialize;

use super::{Change, Check, Misfit, Verdict};
use crate::errors::Summary;

/// A check's answer in millimetres, degrees and milliseconds; axes are the probe's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckReport {
    /// Whether the calibration holds.
    pub verdict: Verdict,
    /// It holds where the phantom was seen; of the rest of the image the scan says nothing that can be relied on.
    pub seen_only: bool,
    /// What moved, or what is missing, in words, and what to do.
    pub words: String,
    /// Images of the scan.
    pub images: usize,
    /// Images whose dots were given wires.
    pub labelled: usize,
    /// Why the others were not: how often.
    pub refused: BTreeMap<&'static str, usize>,
    /// How far the image is from where it was calibrated; `None` when the scan says nothing of it.
    pub change: Option<ChangeReport>,
    /// How the stored calibration explains the dots; `None` when they could not be fitted.
    pub misfit: Option<MisfitReport>,
}

/// The errors of the scan's dots: root mean squares; `None` when there was no such dot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MisfitReport {
    /// Of middle wires, by the stored calibration.
    pub mid_rms_mm: Option<f64>,
    /// Distances from the wires, by the stored calibration.
    pub line_rms_mm: Option<f64>,
    /// Of middle wires, by the scan's own fit.
    pub own_mid_rms_mm: Option<f64>,
    /// Distances from the wires, by the scan's own fit.
    pub own_line_rms_mm: Option<f64>,
    /// How far the stored calibration is off where the phantom was seen.
    pub excess_mm: f64,
    /// How far the probe turned about its axes, the second largest of the three.
    pub turned_deg: f64,
}

/// How far the image is from where it was calibrated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangeReport {
    /// How far the worst pixel's point has moved.
    pub worst_mm: f64,
    /// Its standard error.
    pub worst_error_mm: f64,
    /// That pixel (column, row).
    pub worst_px: [f64; 2],
    /// Mean over the image.
    pub mean_mm: f64,
    /// How far the middle of the image has moved along x, y, z.
    pub shift_mm: [f64; 3],
    /// Standard errors of that.
    pub shift_error_mm: [f64; 3],
    /// How the image has turned about x, y, z.
    pub turn_deg: [f64; 3],
    /// Standard errors of that.
    pub turn_error_deg: [f64; 3],
    /// By how much the lag changed.
    pub lag_change_ms: Option<f64>,
    /// The standard error of that.
    pub lag_error_ms: Option<f64>,
    /// The chance of such a difference when nothing moved.
    pub chance: f64,
    /// The largest standard error of any point of the image.
    pub blur_mm: f64,
    /// Height of a row over the calibration's.
    pub row_scale: f64,
}

impl CheckReport {
    pub(super) fn of(check: &Check) -> Self {
        let mut refused = BTreeMap::new();
        for (_, why) in &check.refused {
            *refused.entry(why.code()).or_insert(0) += 1;
        }
        Self {
            verdict: check.verdict,
            seen_only: check.seen_only,
            words: check.words.clone(),
            images: check.images,
            labelled: check.labelled,
            refused,
            change: check.change.as_ref().map(ChangeReport::of),
            misfit: check.misfit.as_ref().map(MisfitReport::of),
        }
    }
}

impl MisfitReport {
    fn of(misfit: &Misfit) -> Self {
        let mm = |summary: &Summary| (summary.count > 0).then_some(summary.rms_m * 1e3);
        Self {
            mid_rms_mm: mm(&misfit.mid),
            line_rms_mm: mm(&misfit.line),
            own_mid_rms_mm: mm(&misfit.own_mid),
            own_line_rms_mm: mm(&misfit.own_line),
            excess_mm: misfit.excess_m() * 1e3,
            turned_deg: misfit.turned_rad.to_degrees(),
        }
    }
}

impl ChangeReport {
    fn of(change: &Change) -> Self {
        let mm = |v: &Vector3<f64>| [v.x * 1e3, v.y * 1e3, v.z * 1e3];
        let deg = |v: &Vector3<f64>| [v.x.to_degrees(), v.y.to_degrees(), v.z.to_degrees()];
        Self {
            worst_mm: change.worst_m * 1e3,
            worst_error_mm: change.worst_error_m * 1e3,
            worst_px: change.worst_px,
            mean_mm: change.mean_m * 1e3,
            shift_mm: mm(&change.shift_m),
            shift_error_mm: mm(&change.shift_error_m),
            turn_deg: deg(&change.turn_rad),
            turn_error_deg: deg(&change.turn_error_rad),
            lag_change_ms: change.lag_s.map(|(late, _)| late * 1e3),
            lag_error_ms: change.lag_s.map(|(_, error)| error * 1e3),
            chance: change.chance,
            blur_mm: change.blur_m * 1e3,
            row_scale: change.row_scale,
        }
    }
}
