//! Where the lag about is: a calibration at every lag of a grid.
//!
//! A track is straight between its samples and the cost of a wrong lag has more than one valley (a probe that goes to
//! and fro), so that no descent finds the lag from afar.

use super::parameters::{LAG, Values};
use super::problem::Problem;
use super::{FitError, Lag, solve};

/// From one lag to the next (s).
const GRID_S: f64 = 0.05;
/// Images that take part: a valley shows with few.
const IMAGES: usize = 60;
/// Steps of a calibration at one lag; it starts from the neighbour's.
const STEPS: usize = 6;

/// The lags to try, in order: the one that is known, or a grid over those that are possible.
pub(super) fn grid(lag: Lag) -> Vec<f64> {
    let (from_s, to_s) = match lag {
        Lag::Known(lag) => return vec![lag.seconds()],
        Lag::Estimated { from, to } => (from.seconds(), to.seconds()),
    };
    let count = ((to_s - from_s) / GRID_S).ceil().max(1.0) as usize;
    (0..=count).map(|k| from_s + (to_s - from_s) * k as f64 / count as f64).collect()
}

/// The values at the best lag of the grid; from the start's lag outward, each from its neighbour.
pub(super) fn scan(problem: &mut Problem<'_>, start: &Values, lag: Lag) -> Result<Values, FitError> {
    let mut few = thinned(problem);
    let grid = grid(lag);
    let (before, after) = grid.split_at(grid.partition_point(|lag| *lag < start.lag_s));
    let mut found = Vec::with_capacity(grid.len());
    let mut trouble = None;
    for lags in [after.to_vec(), before.iter().rev().copied().collect()] {
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
    few.weigh(values)?;
    let values = solve::descend(few, values, STEPS)?;
    few.weigh(&values)?;
    let values = solve::descend(few, &values, STEPS)?;
    few.weigh(&values)?;
    Ok(values)
}

/// All are judged by one measure, the mean cost of a dot with the smallest scale that any lag left.
fn best(few: &mut Problem<'_>, found: &[(f64, Values)]) -> Option<Values> {
    let least = found.iter().map(|(sigma, _)| *sigma).min_by(f64::total_cmp)?;
    let mut best: Option<(f64, Values)> = None;
    for (_, values) in found {
        if few.weigh(values).is_err() {
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
