//! The shift along the vessel, and the rigid motion, that lay a later exam on an earlier one.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::profile::Profile;
use super::{FollowUpError, LEAST_MM};
use crate::uncertainty::ALONE_MM;

/// Steps of the search and of its refinement (mm).
const STEP_MM: f64 = 0.5;
const FINE_MM: f64 = 0.05;
/// What radii differ by beside their stated errors, because nothing stays quite as it was (mm).
const RADIUS_FLOOR_MM: f64 = 0.05;
/// What a leg that lies otherwise bends its artery by (mm), and what centrelines that far apart count beside radii.
const BENT_MM: f64 = 1.0;
const BENT_COUNTS: f64 = 0.1;
/// A difference of more standard deviations than this is a change, and says nothing about the shift (Tukey).
const CUT: f64 = 4.0;
/// Radii that differ by more than this many times what is usual are of another vessel.
const UNLIKE: f64 = 6.0;

/// Where the later exam lies on the earlier one.
pub(super) struct Registered {
    pub(super) shift: f64,
    pub(super) shift_sd: f64,
    pub(super) pose: Isometry3<f64>,
    pub(super) apart_mm: f64,
}

pub(super) fn register(before: &Profile, after: &Profile) -> Result<Registered, FollowUpError> {
    let ([a, b], [c, d]) = (before.span(), after.span());
    let overlap = LEAST_MM.max(0.5 * (b - a).min(d - c));
    let (low, high) = (a + overlap - d, b - overlap - c);
    let best = |shifts: &[f64]| {
        let costs = shifts.iter().map(|shift| (*shift, cost(before, after, *shift)));
        costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(shift, _)| shift)
    };
    let coarse = best(&range(low, high, STEP_MM));
    let shift = best(&range((coarse - STEP_MM).max(low), (coarse + STEP_MM).min(high), FINE_MM));
    let pairs = pairs(before, after, shift, 1);
    unlike(&pairs)?;
    let places: Vec<(Vector3<f64>, Vector3<f64>)> = pairs.iter().map(|p| (p.0.centre, p.1.centre)).collect();
    let pose = rigid(&places);
    Ok(Registered {
        shift,
        shift_sd: shift_sd(before, after, shift),
        apart_mm: apart_mm(&places, &pose),
        pose,
    })
}

fn range(low: f64, high: f64, step: f64) -> Vec<f64> {
    let count = ((high - low).max(0.0) / step).ceil() as usize;
    (0..=count).map(|i| (low + i as f64 * step).min(high.max(low))).collect()
}

type Pair = (super::profile::Row, super::profile::Row);

/// Every `every`th place that both measured: the earlier exam's row and the later one's.
fn pairs(before: &Profile, after: &Profile, shift: f64, every: usize) -> Vec<Pair> {
    let rows = before.rows().iter().step_by(every);
    rows.filter_map(|row| Some((*row, after.at(row.at - shift)?))).collect()
}

/// How badly the exams fit with a shift: less for every place that they explain together, by how well the radii agree
/// there; more for centrelines that lie apart. Places that only one measured explain nothing: of two shifts that fit as
/// well the one with more vessel in common is the better.
fn cost(before: &Profile, after: &Profile, shift: f64) -> f64 {
    let pairs = pairs(before, after, shift, 2);
    if pairs.len() < 10 {
        return f64::INFINITY;
    }
    let shorter = 0.5 * before.rows().len().min(after.rows().len()) as f64;
    let (offset, differences) = differences(&pairs);
    let explained = |(off, sd): &(f64, f64)| 1.0 - 3.0 / (CUT * CUT) * tukey((off - offset) / sd);
    let radii = differences.iter().map(explained).sum::<f64>() / shorter;
    let places: Vec<(Vector3<f64>, Vector3<f64>)> = pairs.iter().map(|p| (p.0.centre, p.1.centre)).collect();
    let bent = apart_mm(&places, &rigid(&places)) / BENT_MM;
    BENT_COUNTS * bent * bent - radii
}

/// The common difference of the radii, and each difference with its standard deviation (mm).
fn differences(pairs: &[Pair]) -> (f64, Vec<(f64, f64)>) {
    let each: Vec<(f64, f64)> = pairs
        .iter()
        .map(|(a, b)| {
            let variance = a.radius_variance() + b.radius_variance() + RADIUS_FLOOR_MM * RADIUS_FLOOR_MM;
            (b.radius() - a.radius(), variance.sqrt())
        })
        .collect();
    (median(each.iter().map(|(off, _)| *off).collect()), each)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A square that flattens: what is far off counts no more than `CUT` standard deviations.
fn tukey(off: f64) -> f64 {
    let rest = (1.0 - (off / CUT).powi(2)).max(0.0);
    CUT * CUT / 3.0 * (1.0 - rest.powi(3))
}

/// The shift's standard deviation, from how fast the radii come apart: as many independent places as the overlap has.
fn shift_sd(before: &Profile, after: &Profile, shift: f64) -> f64 {
    let alone = 0.5 / ALONE_MM;
    let pairs = pairs(before, after, shift, 1);
    let steepness = pairs.iter().map(|(a, b)| {
        let slope = before.slope(a.at) / (std::f64::consts::TAU * a.radius());
        let variance = a.radius_variance() + b.radius_variance() + RADIUS_FLOOR_MM * RADIUS_FLOOR_MM;
        alone * slope * slope / variance
    });
    let sum: f64 = steepness.sum();
    (1.0 / sum.max(1e-6)).sqrt()
}

/// The rigid motion that brings each second point nearest to its first, in the mean square (W. Kabsch, Acta Cryst. A32,
/// 922, 1976).
fn rigid(places: &[(Vector3<f64>, Vector3<f64>)]) -> Isometry3<f64> {
    let count = places.len().max(1) as f64;
    let mean = places
        .iter()
        .fold((Vector3::zeros(), Vector3::zeros()), |(a, b), p| (a + p.0 / count, b + p.1 / count));
    let scatter: Matrix3<f64> = places.iter().map(|p| (p.0 - mean.0) * (p.1 - mean.1).transpose()).sum();
    let svd = scatter.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Isometry3::identity() };
    let mut flip = Matrix3::identity();
    flip[(2, 2)] = (u * v_t).determinant().signum();
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * flip * v_t));
    Isometry3::from_parts(Translation3::from(mean.0 - turn * mean.1), turn)
}

/// Root mean square distance after a motion (mm).
fn apart_mm(places: &[(Vector3<f64>, Vector3<f64>)], pose: &Isometry3<f64>) -> f64 {
    let off = |p: &(Vector3<f64>, Vector3<f64>)| {
        (pose * nalgebra::Point3::from(p.1) - nalgebra::Point3::from(p.0)).norm_squared()
    };
    1e3 * (places.iter().map(off).sum::<f64>() / places.len().max(1) as f64).sqrt()
}

/// Whether the radii differ by more than a change here and there explains.
fn unlike(pairs: &[Pair]) -> Result<(), FollowUpError> {
    let (offset, each) = differences(pairs);
    let apart_mm = median(each.iter().map(|(off, _)| (off - offset).abs()).collect());
    let expected_mm = median(each.iter().map(|(_, sd)| *sd).collect());
    if apart_mm > UNLIKE * expected_mm {
        return Err(FollowUpError::Unlike { apart_mm, expected_mm });
    }
    Ok(())
}
