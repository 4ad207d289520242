//! Where the lag about is: a calibration at every lag of a grid.
//!
//! A track is straight between its samples and the cost of a wrong lag has more than one valley (a probe that goes to
//! and fro), so that no descent finds the lag from afar.

use super::parameters::{LAG, Values};
use super::problem::Problem;
use super::{FitError, solve};

/// From one lag to the next (s).
const GRID_S: f64 = 0.05;
/// Images that take part: a valley shows with few.
const IMAGES: usize = 60;
/// Steps of a calibration at one lag; it starts from the neighbour's.
const STEPS: usize = 6;

/// The values at the best lag of the grid.
pub(super) fn scan(
    problem: &mut Problem<'_>,
    start: &Values,
    (from_s, to_s): (f64, f64),
) -> Result<Values, FitError> {
    let mut few = thinned(problem);
    let count = ((to_s - from_s) / GRID_S).ceil().max(1.0) as usize;
    let grid: Vec<f64> = (0..=count).map(|k| from_s + (to_s - from_s) * k as f64 / count as f64).collect();
    let middle = grid.partition_point(|lag| *lag < 0.0).min(count);
    let mut found = Vec::with_capacity(grid.len());
    let mut trouble = None;
    for lags in [grid[middle..].to_vec(), grid[..middle].iter().rev().copied().collect()] {
        let mut values = *start;
        for lag_s in lags {
            match at(&mut few, &Values { lag_s, ..values }) {
                Ok(fitted) => {
                    values = fitted;
                    found.push((few.sigma, fitted));
                }
                Err(error) => trouble = Some(error),
            }
        }
    }
    best(&mut few, &found).ok_or_else(|| trouble.unwrap_or(FitError::Diverged))
}

/// So few images that the scan is quick, from the whole sequence; the lag stands still.
fn thinned<'a>(problem: &Problem<'a>) -> Problem<'a> {
    let mut few = problem.clone();
    few.active[LAG] = false;
    few.images.retain(|image| !image.dots.is_empty());
    let every = few.images.len().div_ceil(IMAGES).max(1);
    let mut number = 0;
    few.images.retain(|_| {
        number += 1;
        (number - 1) % every == 0
    });
    few
}

fn at(few: &mut Problem<'_>, values: &Values) -> Result<Values, FitError> {
    few.weigh(values, 0.0)?;
    let values = solve::descend(few, values, STEPS)?;
    few.weigh(&values, 0.0)?;
    let values = solve::descend(few, &values, STEPS)?;
    few.weigh(&values, 0.0)?;
    Ok(values)
}

/// All are judged by one measure, the mean cost of a dot with the smallest scale that any lag left.
fn best(few: &mut Problem<'_>, found: &[(f64, Values)]) -> Option<Values> {
    let least = found.iter().map(|(sigma, _)| *sigma).min_by(f64::total_cmp)?;
    let mut best: Option<(f64, Values)> = None;
    for (_, values) in found {
        if few.weigh(values, 0.0).is_err() {
            continue;
        }
        few.sigma = least;
        let dots: usize = few.images.iter().filter(|i| i.inside).map(|i| i.dots.len()).sum();
        let Some(cost) = few.cost(values).map(|cost| cost / dots as f64) else { continue };
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, *values));
        }
    }
    best.map(|(_, values)| values)
}
