//! [`identify`]: weight, centre of gravity and bias from poses in the air.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};
use probepath_frames::{Base, Direction, Pose, Probe, Wrench};

use super::{Tool, ToolError};

/// Poses that are needed at least.
const LEAST_POSES: usize = 6;
/// How much gravity has to turn in the probe's axes, in two directions (degrees, one standard deviation): the weight's
/// error is the sensor's over its sine.
const LEAST_TURN_DEG: f64 = 8.0;
/// A pose so many times further off than the others, and by so much (N), was disturbed.
const OUTLIER: f64 = 4.0;
const OUTLIER_N: f64 = 0.3;

/// What was read in one pose, held still in the air: the mean over a second or so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolReading {
    /// How the probe was held.
    pub base_from_probe: Pose<Base, Probe>,
    /// What the sensor read, nothing taken off.
    pub wrench: Wrench<Probe>,
}

/// A tool with its standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolFit {
    /// The tool.
    pub tool: Tool,
    /// Standard error of the weight (N).
    pub weight_error_n: f64,
    /// Standard errors of the centre of gravity (m).
    pub centre_error_m: Vector3<f64>,
    /// Standard errors of the bias.
    pub bias_error: Wrench<Probe>,
    /// Root mean square of what the poses are off: force (N) and torque (N m) a coordinate.
    pub left: (f64, f64),
    /// How many poses it is from.
    pub poses: usize,
}

/// Unknowns, their covariance and the residuals of one least-squares problem.
struct Solved {
    x: DVector<f64>,
    errors: DVector<f64>,
    left: DVector<f64>,
}

/// The tool that explains what was read in `readings`; `down` is where things fall to.
///
/// # Errors
/// When there are too few poses or they are too alike, a reading is no number, or one does not fit the others.
pub fn identify(readings: &[ToolReading], down: &Direction<Base>) -> Result<ToolFit, ToolError> {
    if readings.len() < LEAST_POSES {
        return Err(ToolError::TooFew { given: readings.len(), wanted: LEAST_POSES });
    }
    if let Some(pose) = readings.iter().position(|r| !(r.wrench.is_finite() && r.base_from_probe.is_finite()))
    {
        return Err(ToolError::NotFinite { pose });
    }
    let falls: Vec<_> = readings.iter().map(|r| (r.base_from_probe.inverse() * *down).vector()).collect();
    turned_enough(&falls)?;
    let (forces, torques) = (rows(readings, |r| r.wrench.force), rows(readings, |r| r.wrench.torque));
    let (Some(force), Some(torque)) = (
        solve(&matrix(&falls, 4, |u| DMatrix::from_column_slice(3, 1, u.as_slice())), &forces),
        solve(&matrix(&falls, 6, moments), &torques),
    ) else {
        let axis = "x and y";
        return Err(ToolError::Alike { axis, found_deg: 0.0, wanted_deg: LEAST_TURN_DEG });
    };
    no_outlier(&force.left)?;
    Ok(fit(&force, &torque, readings.len()))
}

/// The unknowns by name.
fn fit(force: &Solved, torque: &Solved, poses: usize) -> ToolFit {
    let three = |of: &DVector<f64>, from: usize| Vector3::new(of[from], of[from + 1], of[from + 2]);
    let weight_n = force.x[0];
    let (moment, moment_error) = (three(&torque.x, 0), three(&torque.errors, 0));
    let centre_m = moment / weight_n;
    // The centre is a quotient: both errors come together.
    let centre_error_m = moment_error
        .zip_map(&centre_m, |m, c| (m.powi(2) + (c * force.errors[0]).powi(2)).sqrt())
        / weight_n.abs();
    let rms = |left: &DVector<f64>| (left.norm_squared() / left.len() as f64).sqrt();
    ToolFit {
        tool: Tool { weight_n, centre_m, bias: Wrench::new(three(&force.x, 1), three(&torque.x, 3)) },
        weight_error_n: force.errors[0],
        centre_error_m,
        bias_error: Wrench::new(three(&force.errors, 1), three(&torque.errors, 3)),
        left: (rms(&force.left), rms(&torque.left)),
        poses,
    }
}

fn rows(readings: &[ToolReading], pick: fn(&ToolReading) -> Vector3<f64>) -> DVector<f64> {
    DVector::from_iterator(3 * readings.len(), readings.iter().flat_map(|r| <[f64; 3]>::from(pick(r))))
}

/// `m × u` is linear in `m`.
fn moments(u: &Vector3<f64>) -> DMatrix<f64> {
    let turned = -u.cross_matrix();
    DMatrix::from_column_slice(3, 3, turned.as_slice())
}

/// Three rows for each pose: what depends on gravity, and the bias.
fn matrix(
    falls: &[Vector3<f64>],
    unknowns: usize,
    part: impl Fn(&Vector3<f64>) -> DMatrix<f64>,
) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(3 * falls.len(), unknowns);
    for (i, u) in falls.iter().enumerate() {
        let gravity = part(u);
        all.view_mut((3 * i, 0), (3, gravity.ncols())).copy_from(&gravity);
        all.view_mut((3 * i, unknowns - 3), (3, 3)).fill_with_identity();
    }
    all
}

fn solve(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<Solved> {
    let inverse = (a.transpose() * a).try_inverse()?;
    let x = &inverse * a.transpose() * b;
    let left = b - a * &x;
    let free = (a.nrows() - a.ncols()) as f64;
    let variance = left.norm_squared() / free;
    let errors = inverse.diagonal().map(|v| (v * variance).sqrt());
    Some(Solved { x, errors, left })
}

/// Gravity has to have turned in two directions: else weight and bias, or the centre's place along one axis, cannot be
/// told apart.
fn turned_enough(falls: &[Vector3<f64>]) -> Result<(), ToolError> {
    let n = falls.len() as f64;
    let mean = falls.iter().sum::<Vector3<f64>>() / n;
    let scatter: Matrix3<f64> =
        falls.iter().map(|u| (u - mean) * (u - mean).transpose()).sum::<Matrix3<f64>>() / n;
    let eigen = SymmetricEigen::new(scatter);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let [first, second, _] = order;
    // The second direction is the scarce one; when even the first is, that is the one to name.
    let turn = |i: usize| eigen.eigenvalues[i].max(0.0).sqrt().to_degrees();
    let scarce = if turn(first) < LEAST_TURN_DEG { first } else { second };
    let found_deg = turn(scarce);
    if found_deg >= LEAST_TURN_DEG {
        return Ok(());
    }
    // Which way gravity did not turn, at right angles to it; without any turn, any way will do.
    let missing = across(&mean, &Vector3::from(eigen.eigenvectors.column(scarce)), &|| {
        Vector3::from(eigen.eigenvectors.column(first))
    });
    let axis = dominant(&mean.cross(&missing));
    Err(ToolError::Alike { axis, found_deg, wanted_deg: LEAST_TURN_DEG })
}

/// The scarce direction, unless it lies along gravity: then the one at right angles to gravity and to what there is.
fn across(mean: &Vector3<f64>, scarce: &Vector3<f64>, first: &dyn Fn() -> Vector3<f64>) -> Vector3<f64> {
    let off = scarce - mean * (scarce.dot(mean) / mean.norm_squared().max(1e-12));
    if off.norm() > 0.5 { off } else { mean.cross(&first()) }
}

/// The probe's axis that a direction is nearest to.
fn dominant(direction: &Vector3<f64>) -> &'static str {
    ["x", "y", "z"].get(direction.iamax()).copied().unwrap_or("x")
}

/// No pose may be off by far more than the others are.
fn no_outlier(left: &DVector<f64>) -> Result<(), ToolError> {
    let off: Vec<f64> =
        left.as_slice().chunks(3).map(|of| of.iter().map(|r| r * r).sum::<f64>().sqrt()).collect();
    let Some((pose, off_n)) = off.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(());
    };
    let others = off.iter().map(|r| r * r).sum::<f64>() - off_n * off_n;
    let usual_n = (others / (off.len() - 1).max(1) as f64).sqrt();
    // A disturbed pose pulls the others with it: it stands out less than it is off.
    if off_n > OUTLIER_N && off_n > 0.5 * OUTLIER * usual_n {
        return Err(ToolError::Outlier { pose, off_n, usual_n });
    }
    Ok(())
}
