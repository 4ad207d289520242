//! What is weakly determined, in words that say what to do about it.

use std::fmt;

use nalgebra::Vector3;

use super::parameters::{COLUMN_SCALE, COUNT, LAG, PLACE_SHIFT, PLACE_TURN, Parameter, ROW_SCALE, SHIFT};
use super::problem::Problem;
use super::spread::Spread;
use super::{Fit, FitError};

/// An error over the image below this (m) is nothing to speak of.
const WORTH_M: f64 = 0.1e-3;
/// A lag's standard error below this (s) is nothing to speak of.
const WORTH_S: f64 = 5e-3;
/// A probe that turned by less than this (rad) about an axis leaves the phantom's place and the image's mixed.
const TURNED_ENOUGH_RAD: f64 = 0.35;

/// Something weakly determined.
#[derive(Clone, Debug, PartialEq)]
pub struct Weakness {
    /// What, and how uncertain.
    pub what: String,
    /// What to do about it.
    pub advice: String,
    /// Its standard error over the image (m); for the lag, at the speed the probe had.
    pub error_m: f64,
}

impl fmt::Display for Weakness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.what, self.advice)
    }
}

/// Weakest first.
pub(super) fn directions(fit: &Fit, problem: &Problem<'_>, spread: &Spread) -> Vec<Weakness> {
    let mut found: Vec<Weakness> = in_the_image(fit, problem, spread).into_iter().collect();
    found.extend(of_the_lag(fit, spread));
    found.sort_by(|a, b| b.error_m.total_cmp(&a.error_m));
    found
}

/// The way in which the whole image is most uncertain: the dominant direction of the errors of all dots' places.
fn in_the_image(fit: &Fit, problem: &Problem<'_>, spread: &Spread) -> Option<Weakness> {
    let places: Vec<[f64; 2]> = problem.images.iter().flat_map(|i| i.dots.iter().map(|d| d.at_px)).collect();
    let every = places.len().div_ceil(50).max(1);
    let bys: Vec<_> = places.iter().step_by(every).map(|at| fit.uncertainty.point_by(at[0], at[1])).collect();
    let root = fit.uncertainty.covariance.clone().symmetric_eigen();
    let values = root.eigenvalues.map(|v| v.max(0.0).sqrt());
    let half = &root.eigenvectors * nalgebra::DMatrix::from_diagonal(&values);
    let mut square = nalgebra::DMatrix::zeros(half.ncols(), half.ncols());
    for by in &bys {
        let moved = by * &half;
        square += moved.transpose() * moved / bys.len() as f64;
    }
    let eigen = square.symmetric_eigen();
    let largest = eigen.eigenvalues.imax();
    let error_m = eigen.eigenvalues.get(largest)?.max(0.0).sqrt();
    let step = &half * eigen.eigenvectors.column(largest);
    let moves: Vec<Vector3<f64>> = bys.iter().map(|by| by * &step).collect();
    (error_m > WORTH_M).then(|| described(fit, &moves, error_m, spread))
}

/// A common shift along one of the image's axes, or a turn or stretch about the middle.
fn described(fit: &Fit, moves: &[Vector3<f64>], error_m: f64, spread: &Spread) -> Weakness {
    let mean = moves.iter().sum::<Vector3<f64>>() / moves.len().max(1) as f64;
    let in_image = fit.probe_from_image.isometry().rotation.inverse() * mean;
    let way = ["across the image (columns)", "in depth (rows)", "out of the image's plane"];
    let shifted = mean.norm() > 0.7 * error_m;
    let what = match (shifted, way.get(in_image.iamax())) {
        (true, Some(way)) => format!("the image's place {way} is known to {:.2} mm only", error_m * 1e3),
        _ => format!("the image's tilt and size are known to {:.2} mm over the image only", error_m * 1e3),
    };
    Weakness { what, advice: turn_advice(spread, shifted.then_some(mean)), error_m }
}

/// Which way to turn: a shift along a direction of the probe shows only when the probe turns about an axis across it.
fn turn_advice(spread: &Spread, shift: Option<Vector3<f64>>) -> String {
    let along = shift.map_or(3, |s| s.iamax());
    let across = (0..3).filter(|k| *k != along);
    let least = across.min_by(|a, b| spread.turned_rad[*a].total_cmp(&spread.turned_rad[*b])).unwrap_or(0);
    let axis = ["x", "y", "z"].get(least).unwrap_or(&"x");
    let turned = spread.turned_rad[least];
    if turned > TURNED_ENOUGH_RAD {
        return format!(
            "the probe turned {:.0} degrees about its {axis} axis, which is enough: capture more images",
            turned.to_degrees()
        );
    }
    format!(
        "the probe turned only {:.1} degrees about its {axis} axis: tilt it by 15 degrees to either side",
        turned.to_degrees()
    )
}

fn of_the_lag(fit: &Fit, spread: &Spread) -> Option<Weakness> {
    let error_s = fit.uncertainty.standard_error_of(Parameter::LAG)?;
    (error_s > WORTH_S).then(|| Weakness {
        what: format!("the lag is known to {:.0} ms only", error_s * 1e3),
        advice: format!(
            "the probe moved at {:.0} mm/s: move it to and fro across the wires, faster, or set the lag from a \
             temporal calibration",
            spread.speed_m_s * 1e3
        ),
        error_m: error_s * spread.speed_m_s,
    })
}

/// What to do about a parameter that nothing determines.
pub(super) fn undetermined(parameter: usize) -> FitError {
    let advice = match parameter {
        LAG => {
            "the poses do not move while images are taken: move the probe across the wires, or give the lag"
        }
        COLUMN_SCALE | ROW_SCALE => {
            "the dots do not spread over the image: see more wires, or give the pixel spacing"
        }
        PLACE_TURN..PLACE_SHIFT | PLACE_SHIFT..COUNT => {
            "the probe did not turn: tilt it about two axes, or give the phantom's place"
        }
        SHIFT..COLUMN_SCALE => {
            "all wires run the same way, or the probe did not turn: see the Zs' middle wires, and tilt the probe"
        }
        _ => "too few wires are seen in too few ways: see more wires, and tilt the probe about two axes",
    };
    let name = Parameter::ALL.get(parameter).map_or("a parameter", |p| p.name);
    FitError::Undetermined { parameter: name, advice: advice.into() }
}
