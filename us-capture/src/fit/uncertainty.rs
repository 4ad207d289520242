//! How sure the answer is: the covariance of the parameters, and of the points they reconstruct.

use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix3xX, SMatrix};
use probepath_frames::{Image, Phantom, Pose, Probe, Span, World};

use super::parameters::{COLUMN_SCALE, COUNT, Parameter, ROW_SCALE, SHEAR, SHIFT, Step, TURN, Values};
use super::problem::{Normal, Problem, Square};
use super::solve::{scaled, units};
use super::{Fit, FitError, FitOptions, spread, weak};
use crate::PixelSpacing;

/// A direction with less than this part of the information that its parameters have alone is open.
const OPEN: f64 = 1e-11;
/// A probe that moved and turned by less than this from one image to the next stands still (m, rad): ten times what
/// an arm shakes, a tenth of what makes another view.
const ONE_PLACE: (f64, f64) = (0.2e-3, 2e-3);
/// Points of the standard error's map on each side.
const GRID: usize = 17;

/// How sure the parameters are, and with them every reconstructed point.
#[derive(Clone, Debug)]
pub struct Uncertainty {
    /// What was fitted, in the order of the covariance.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters, in their units.
    pub covariance: DMatrix<f64>,
    geometry: Geometry,
}

/// Where the image is that the parameters move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Geometry {
    probe_from_image: Isometry3<f64>,
    spacing: PixelSpacing,
    /// What the factors multiply.
    nominal: PixelSpacing,
}

impl Geometry {
    pub(super) fn of(values: &Values, nominal: PixelSpacing) -> Self {
        Self { probe_from_image: values.probe_from_image, spacing: values.spacing(nominal), nominal }
    }

    /// Derivatives of a pixel's point in the probe by all parameters.
    fn point_by(&self, column: f64, row: f64) -> SMatrix<f64, 3, COUNT> {
        let turn = self.probe_from_image.rotation.to_rotation_matrix().into_inner();
        let at = self.spacing.point(column, row).vector();
        let mut by = SMatrix::<f64, 3, COUNT>::zeros();
        by.fixed_view_mut::<3, 3>(0, TURN).copy_from(&(-turn * at.cross_matrix()));
        by.fixed_view_mut::<3, 3>(0, SHIFT).fill_with_identity();
        by.set_column(COLUMN_SCALE, &(turn.column(0) * (column * self.nominal.x_m)));
        by.set_column(ROW_SCALE, &(turn.column(1) * (row * self.nominal.y_m)));
        by
    }
}

impl Uncertainty {
    pub(super) fn of(covariance: &Square, active: &[bool; COUNT], geometry: Geometry) -> Self {
        Self { parameters: fitted(active), covariance: kept(covariance, active), geometry }
    }

    /// From what a file kept: the calibration, the spacing that the factors multiply, names and covariance. `None` when
    /// they do not belong together: sizes that differ, a name twice, a number that is none, a negative variance.
    pub fn restored(
        probe_from_image: &Pose<Probe, Image>,
        (spacing, nominal): (PixelSpacing, PixelSpacing),
        parameters: Vec<Parameter>,
        covariance: DMatrix<f64>,
    ) -> Option<Self> {
        let count = parameters.len();
        let twice = (1..count).any(|k| parameters[..k].contains(&parameters[k]));
        let sized = covariance.shape() == (count, count) && !twice;
        let finite =
            covariance.iter().all(|x| x.is_finite()) && covariance.diagonal().iter().all(|x| *x >= 0.0);
        let probe_from_image = *probe_from_image.isometry();
        let geometry = Geometry { probe_from_image, spacing, nominal };
        (sized && finite).then_some(Self { parameters, covariance, geometry })
    }

    /// The spacing that the factors of columns and rows multiply.
    pub const fn nominal(&self) -> PixelSpacing {
        self.geometry.nominal
    }

    /// The standard error of a parameter, in its unit; `None` when it was not fitted.
    pub fn standard_error_of(&self, parameter: Parameter) -> Option<f64> {
        let index = self.parameters.iter().position(|p| *p == parameter)?;
        Some(self.covariance.get((index, index))?.max(0.0).sqrt())
    }

    /// Derivatives of a pixel's point in the probe by the fitted parameters.
    pub(super) fn point_by(&self, column: f64, row: f64) -> Matrix3xX<f64> {
        let by = self.geometry.point_by(column, row);
        let kept = self.parameters.iter().filter_map(|p| p.index());
        Matrix3xX::from_columns(&kept.map(|k| by.column(k).into_owned()).collect::<Vec<_>>())
    }

    /// Covariance of the reconstructed point of a pixel, in the probe's axes (m²).
    pub fn point_covariance(&self, column: f64, row: f64) -> Matrix3<f64> {
        let by = self.point_by(column, row);
        let covariance = &by * &self.covariance * by.transpose();
        Matrix3::from_fn(|i, k| covariance[(i, k)])
    }

    /// The standard error of the reconstructed point of a pixel, in the probe (m): the root of the trace of its
    /// covariance.
    pub fn standard_error(&self, column: f64, row: f64) -> f64 {
        self.point_covariance(column, row).trace().max(0.0).sqrt()
    }

    /// The standard error over an image of `width` x `height` pixels.
    pub fn standard_error_map(&self, width: usize, height: usize) -> StandardErrorMap {
        StandardErrorMap::of(self, width, height)
    }
}

/// The standard error of reconstructed points over an image.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardErrorMap {
    /// Columns and rows of the map; its corners are the image's.
    pub size: (usize, usize),
    /// From point to point (pixels).
    pub step_px: (f64, f64),
    /// Row after row (m).
    pub errors_m: Vec<f64>,
}

impl StandardErrorMap {
    fn of(uncertainty: &Uncertainty, width: usize, height: usize) -> Self {
        let step = |pixels: usize| pixels.saturating_sub(1) as f64 / (GRID - 1) as f64;
        let step_px = (step(width), step(height));
        let at = |k: usize| {
            uncertainty.standard_error((k % GRID) as f64 * step_px.0, (k / GRID) as f64 * step_px.1)
        };
        Self { size: (GRID, GRID), step_px, errors_m: (0..GRID * GRID).map(at).collect() }
    }

    /// Mean over the image (m).
    pub fn mean_m(&self) -> f64 {
        self.errors_m.iter().sum::<f64>() / self.errors_m.len().max(1) as f64
    }

    /// What 95 % of the image stays below (m).
    pub fn p95_m(&self) -> f64 {
        let mut errors = self.errors_m.clone();
        errors.sort_unstable_by(f64::total_cmp);
        errors.get((errors.len() * 95 / 100).min(errors.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
    }
}

/// The parameters that are fitted.
pub(super) fn fitted(active: &[bool; COUNT]) -> Vec<Parameter> {
    Parameter::ALL.into_iter().zip(active).filter(|(_, active)| **active).map(|(p, _)| p).collect()
}

/// The part of a matrix that is about them.
pub(super) fn kept(square: &Square, active: &[bool; COUNT]) -> DMatrix<f64> {
    let kept: Vec<usize> = (0..COUNT).filter(|k| active[*k]).collect();
    DMatrix::from_fn(kept.len(), kept.len(), |i, k| square[(kept[i], kept[k])])
}

/// Closes the fit: covariance, shear, and what is weak.
pub(super) fn conclude(
    problem: &Problem<'_>,
    values: &Values,
    options: &FitOptions,
) -> Result<Fit, FitError> {
    if values.column_scale <= 0.0 || values.row_scale <= 0.0 {
        return Err(FitError::Mirrored { column: values.column_scale, row: values.row_scale });
    }
    let told = Told::of(problem, values);
    let covariance = told.covariance(&problem.active, problem)?;
    let errors = problem.errors(values);
    let squared: f64 = errors.iter().map(|(off, _)| off.norm_squared()).sum();
    let mut fit = Fit {
        // FRAMES: the solver's values, turned and shifted from a pose of the Image in the Probe.
        probe_from_image: Pose::assume(values.probe_from_image),
        spacing: values.spacing(options.spacing),
        lag: Span::from_seconds(values.lag_s),
        world_from_phantom: refined(problem, values, options.place.pose()),
        uncertainty: Uncertainty::of(&covariance, &problem.active, Geometry::of(values, options.spacing)),
        images: problem.images.iter().filter(|i| i.inside).count(),
        dots: errors.len(),
        outside: problem.images.iter().filter(|i| !i.inside && !i.dots.is_empty()).count(),
        line_rms_m: (squared / errors.len().max(1) as f64).sqrt(),
        variance_factor: problem.sigma * problem.sigma,
        design_effect: told.effect(&problem.active, problem) / told.scatter,
        shear_rad: told.shear(problem),
        weak: Vec::new(),
    };
    fit.weak = weak::directions(&fit, problem, &spread::of(problem));
    Ok(fit)
}

/// The nominal place with its correction, which turns about the middle of the wires.
fn refined(problem: &Problem<'_>, values: &Values, nominal: Pose<World, Phantom>) -> Pose<World, Phantom> {
    let middle = problem.stand.middle;
    let about = Isometry3::translation(middle.x, middle.y, middle.z);
    // FRAMES: the correction stays in the Phantom's own axes.
    nominal * Pose::assume(about * values.place() * about.inverse())
}

/// What every stop of the probe says at the end.
struct Told {
    all: Normal,
    /// Images taken at one place share the error of its pose, and count as one; of a probe that moves, every image is
    /// one by itself.
    stops: Vec<Normal>,
    /// What of the weights errors really feel: the cost is less curved where dots lie far out.
    curvature: f64,
    /// What the dots' own errors scatter, over what the weights say.
    scatter: f64,
}

/// What each stop says: images in a row whose poses are the same within [`ONE_PLACE`].
fn stops(problem: &Problem<'_>, values: &Values) -> Vec<Normal> {
    let mut stops: Vec<(Pose<World, Probe>, Normal)> = Vec::new();
    for image in problem.images.iter().filter(|i| i.inside) {
        let (pose, says) = (image.moment.world_from_probe, problem.image_normal(image, values));
        match stops.last_mut().map(|(place, stop)| (place.distance(&pose), stop)) {
            Some(((moved, turned), stop)) if moved < ONE_PLACE.0 && turned < ONE_PLACE.1 => stop.add(&says),
            _ => stops.push((pose, says)),
        }
    }
    stops.into_iter().map(|(_, stop)| stop).collect()
}

impl Told {
    fn of(problem: &Problem<'_>, values: &Values) -> Self {
        let stops = stops(problem, values);
        let mut all = Normal::zero();
        stops.iter().for_each(|stop| all.add(stop));
        let (mut curved, mut weights, mut scattered) = (0.0, 0.0, 0.0);
        for (_, squared) in problem.errors(values) {
            let weight = problem.robust.cost(squared).1;
            curved += problem.robust.curvature(squared);
            weights += weight;
            // A dot has two errors.
            scattered += weight * weight * squared / 2.0;
        }
        Self { all, stops, curvature: (curved / weights).clamp(0.2, 1.0), scatter: scattered / weights }
    }

    /// The covariance: inverse curvature, around the scatter of what the images say.
    ///
    /// Dots of one stop share errors (its pose, its stamp), so that counting dots promises too much. What each stop
    /// says as a whole scatters as it really does (the sandwich of Liang and Zeger, Biometrika 73 (1986) 13, by
    /// stop), each against the fit of all others so that the fit's leaning to it is taken back. With few stops
    /// that scatter is itself uncertain, and leans on the dots' own, scaled as a whole.
    fn covariance(&self, active: &[bool; COUNT], problem: &Problem<'_>) -> Result<Square, FitError> {
        let prior = Square::from_diagonal(&problem.prior);
        let inverse = invert(&(self.all.square * self.curvature + prior), active)?;
        let scatter = self.scatter(active, problem);
        let parameters = active.iter().filter(|a| **a).count() as f64;
        let stops = self.stops.len() as f64;
        let trust = stops / (stops + 3.0 * parameters);
        let effect = self.effect(active, problem);
        let middle = scatter * trust + self.all.square * (effect * (1.0 - trust)) + prior;
        Ok(inverse * middle * inverse)
    }

    /// Sum of squares of what the stops say.
    fn scatter(&self, active: &[bool; COUNT], problem: &Problem<'_>) -> Square {
        let prior = Square::from_diagonal(&problem.prior);
        let whole = self.all.square + prior;
        let mut scatter = Square::zeros();
        for stop in &self.stops {
            let others = invert(&(whole - stop.square), active);
            let alone = others.map_or(stop.slope, |inverse| whole * (inverse * stop.slope));
            let product = alone * stop.slope.transpose();
            scatter += (product + product.transpose()) / 2.0;
        }
        scatter
    }

    /// How much more the stops scatter than their weights say, as a mean over all directions.
    fn effect(&self, active: &[bool; COUNT], problem: &Problem<'_>) -> f64 {
        let Ok(inverse) = invert(&(self.all.square + Square::from_diagonal(&problem.prior)), active) else {
            return 1.0;
        };
        let (mut scatter, mut expected) = (0.0, 0.0);
        for stop in &self.stops {
            let part = inverse * stop.square;
            scatter += stop.slope.dot(&(inverse * stop.slope));
            // The fit leans to every stop a little, and leaves less of its errors than there was.
            expected += part.trace() - part.component_mul(&part.transpose()).sum();
        }
        if expected > 0.0 { scatter / expected } else { 1.0 }
    }

    /// One step of the shear, were it free, and its standard error.
    fn shear(&self, problem: &Problem<'_>) -> (f64, f64) {
        let mut active = problem.active;
        active[SHEAR] = true;
        let (Ok(inverse), Ok(covariance)) = (
            invert(&(self.all.square + Square::from_diagonal(&problem.prior)), &active),
            self.covariance(&active, problem),
        ) else {
            return (f64::NAN, f64::NAN);
        };
        // The slope of everything fitted is zero here but for the prior's, which balances it.
        let mut slope = Step::zeros();
        slope[SHEAR] = self.all.slope[SHEAR];
        (-(inverse * slope)[SHEAR], covariance[(SHEAR, SHEAR)].max(0.0).sqrt())
    }
}

/// The inverse over what is fitted; zero elsewhere.
pub(super) fn invert(square: &Square, active: &[bool; COUNT]) -> Result<Square, FitError> {
    let unit = units(square, active);
    let mut unity = scaled(square, &unit);
    for k in 0..COUNT {
        unity[(k, k)] = 1.0;
        if active[k] && unit[k] == 0.0 {
            return Err(weak::undetermined(k));
        }
    }
    let inverse = unity.cholesky().map(|root| root.inverse());
    match inverse.filter(|i| i.diagonal().iter().all(|x| x.is_finite() && *x < 1.0 / OPEN)) {
        Some(inverse) => Ok(scaled(&inverse, &unit)),
        None => Err(weak::undetermined(open_direction(&unity))),
    }
}

/// The parameter that dominates the direction nothing speaks about.
fn open_direction(unity: &Square) -> usize {
    let eigen = unity.symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imin()).iamax()
}
