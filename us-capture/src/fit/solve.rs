//! Levenberg-Marquardt on normal equations of a fixed size: no heap in its loop.

use super::FitError;
use super::parameters::{LAG, Step, Values};
use super::problem::{Normal, Problem, Square};

/// Rounds of weighing and solving.
const ROUNDS: usize = 12;
/// Steps within a round.
const STEPS: usize = 30;
/// Less information than this says nothing: a standard error of a kilometre, a thousand turns, a quarter of an hour.
const SILENT: f64 = 1e-6;
/// Done when a step changes the cost by less than this part.
const COST_WITHIN: f64 = 1e-10;
/// Done when a round moves each parameter by less than this part of its standard error.
const SETTLED: f64 = 1e-3;

/// Weighs and solves in turn until neither changes the other.
pub(super) fn settle(problem: &mut Problem<'_>, start: Values) -> Result<Values, FitError> {
    let mut values = start;
    for round in 0..ROUNDS {
        problem.weigh(&values)?;
        let before = values;
        values = descend(problem, &values, STEPS)?;
        if round >= 2 && moved(problem, &before, &values) < SETTLED {
            break;
        }
    }
    // The last word on weights and images, at the place that was found.
    problem.weigh(&values)?;
    descend(problem, &values, STEPS)
}

/// Descends with the weights as they are.
pub(super) fn descend(problem: &Problem<'_>, start: &Values, steps: usize) -> Result<Values, FitError> {
    let (mut values, mut damping) = (*start, 1e-4);
    let mut normal = normal(problem, &values).ok_or(FitError::Diverged)?;
    for _ in 0..steps {
        let Some((next, cost)) = downhill(problem, &values, &normal, &mut damping) else { break };
        let gain = normal.cost - cost;
        values = next;
        normal = self::normal(problem, &values).ok_or(FitError::Diverged)?;
        if gain <= COST_WITHIN * (normal.cost + f64::MIN_POSITIVE) {
            break;
        }
    }
    Ok(values)
}

/// The first step, of growing damping, that goes down; `None` at the bottom.
fn downhill(
    problem: &Problem<'_>,
    values: &Values,
    normal: &Normal,
    damping: &mut f64,
) -> Option<(Values, f64)> {
    while *damping < 1e9 {
        if let Some(step) = step(normal, &problem.active, *damping) {
            let next = values.moved(&step);
            if let Some(cost) = problem.cost(&next).filter(|cost| *cost < normal.cost) {
                *damping = (*damping / 10.0).max(1e-9);
                return Some((next, cost));
            }
        }
        *damping *= 10.0;
    }
    None
}

/// All that images and priors say.
pub(super) fn normal(problem: &Problem<'_>, values: &Values) -> Option<Normal> {
    let mut sum = problem.prior_normal(values);
    for image in problem.images.iter().filter(|i| i.inside) {
        sum.add(&problem.image_normal(image, values));
    }
    (sum.cost.is_finite() && sum.slope.iter().all(|x| x.is_finite())).then_some(sum)
}

/// The damped Newton step, in units that give every parameter a second derivative of one.
fn step(normal: &Normal, active: &[bool], damping: f64) -> Option<Step> {
    let unit = units(&normal.square, active);
    let mut square = scaled(&normal.square, &unit);
    for k in 0..square.nrows() {
        square[(k, k)] = 1.0 + damping;
    }
    let slope = normal.slope.component_mul(&unit);
    Some(-square.cholesky()?.solve(&slope).component_mul(&unit))
}

/// One over the root of each second derivative; zero for what is not fitted, or what nothing speaks about.
pub(super) fn units(square: &Square, active: &[bool]) -> Step {
    Step::from_fn(|k, _| {
        let on = active.get(k).copied().unwrap_or(false) && square[(k, k)] > SILENT;
        if on { square[(k, k)].sqrt().recip() } else { 0.0 }
    })
}

/// The second derivatives in those units: ones on the diagonal of what is fitted, nothing elsewhere.
pub(super) fn scaled(square: &Square, unit: &Step) -> Square {
    Square::from_fn(|i, k| square[(i, k)] * unit[i] * unit[k])
}

/// How far values moved, in standard errors of the parameter that moved most.
fn moved(problem: &Problem<'_>, before: &Values, after: &Values) -> f64 {
    let Some(normal) = normal(problem, after) else { return f64::INFINITY };
    let unit = units(&normal.square, &problem.active);
    let turn = before.probe_from_image.rotation.inverse() * after.probe_from_image.rotation;
    let mut step = after.off_prior((before.column_scale, before.row_scale))
        - before.off_prior((before.column_scale, before.row_scale));
    step.fixed_rows_mut::<3>(0).copy_from(&turn.scaled_axis());
    let shift = after.probe_from_image.translation.vector - before.probe_from_image.translation.vector;
    step.fixed_rows_mut::<3>(3).copy_from(&shift);
    step[LAG] = after.lag_s - before.lag_s;
    (0..step.len()).filter(|k| unit[*k] > 0.0).map(|k| step[k].abs() / unit[k]).fold(0.0, f64::max)
}
