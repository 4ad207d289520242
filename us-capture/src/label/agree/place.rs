//! With a known place of the phantom: every candidate puts the image somewhere on the probe; the right ones at the
//! same place.

use nalgebra::Isometry3;

use super::Verdict;
use super::views::{Views, mean};

/// Candidates are of one mind while within this of each other, before the lag is taken off (rad, m).
const LOOSE_RAD: f64 = 0.35;
const LOOSE_M: f64 = 30e-3;
/// How many places are looked at closely.
const CLOSELY: usize = 10;
/// First guesses are made of this many images, evenly taken.
const SAMPLED: usize = 40;

pub(super) fn verdicts(views: &Views<'_>, place: &Isometry3<f64>) -> Vec<Verdict> {
    centres(views, place).iter().map(|x| closely(views, *x, place)).collect()
}

/// Where single candidates put the image, the most agreed first, no two alike.
fn centres(views: &Views<'_>, place: &Isometry3<f64>) -> Vec<Isometry3<f64>> {
    let step = views.views.len().div_ceil(SAMPLED).max(1);
    let sampled: Vec<Vec<(Isometry3<f64>, f64)>> = views
        .views
        .iter()
        .step_by(step)
        .filter_map(|v| {
            let pose = v.poses[0]?;
            Some(
                v.candidates
                    .iter()
                    .map(|c| (pose.inverse() * place * c.phantom_from_image, c.weight))
                    .collect(),
            )
        })
        .collect();
    let mut rated: Vec<(f64, Isometry3<f64>)> =
        sampled.iter().flatten().map(|(x, _)| (agreed(views, x, &sampled), *x)).collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut centres: Vec<Isometry3<f64>> = Vec::new();
    for (_, x) in rated {
        if centres.len() < CLOSELY && !centres.iter().any(|c| apart(views, c, &x) < 0.5) {
            centres.push(x);
        }
    }
    centres
}

/// How far apart two places are, in units of what the lag may do.
fn apart(views: &Views<'_>, a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let metres = (a * views.probes[0] - b * views.probes[0]).norm();
    (a.rotation.angle_to(&b.rotation) / LOOSE_RAD).hypot(metres / LOOSE_M)
}

fn agreed(views: &Views<'_>, x: &Isometry3<f64>, sampled: &[Vec<(Isometry3<f64>, f64)>]) -> f64 {
    let best = |of: &Vec<(Isometry3<f64>, f64)>| {
        of.iter().map(|(other, w)| w * (1.0 - apart(views, x, other).powi(2))).fold(0.0, f64::max)
    };
    sampled.iter().map(best).sum()
}

/// The lag and the mean place that the images agree on best, from a first guess.
fn closely(views: &Views<'_>, x: Isometry3<f64>, place: &Isometry3<f64>) -> Verdict {
    let mut best = views.judge(x, *place, 0);
    for lag in 0..views.lags.len() {
        let mut refined = x;
        for gate in [LOOSE_M, 2.0 * views.gate_m, views.gate_m] {
            refined = meaned(views, refined, place, lag, gate).unwrap_or(refined);
        }
        let verdict = views.judge(refined, *place, lag);
        if verdict.worth > best.worth {
            best = verdict;
        }
    }
    best
}

fn meaned(
    views: &Views<'_>,
    x: Isometry3<f64>,
    place: &Isometry3<f64>,
    lag: usize,
    gate: f64,
) -> Option<Isometry3<f64>> {
    let mut placed = Vec::with_capacity(views.views.len());
    for view in &views.views {
        if let (Some(pose), Some(best)) = (view.poses[lag], views.best(view, lag, (&x, place), gate)) {
            placed.push(pose.inverse() * place * view.candidates[best.0].phantom_from_image);
        }
    }
    (placed.len() >= 3).then(|| mean(&placed, &views.probes[0]))
}
