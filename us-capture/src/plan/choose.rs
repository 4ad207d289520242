//! Choosing poses: the one that helps most, again and again, then exchanges while they help.

use probepath_frames::{Pose, Probe, World};

use super::NoPlan;
use super::candidates::Candidates;
use super::information::{Information, covariance};

/// Rounds of exchange at most; two or three are enough.
const ROUNDS: usize = 3;
/// An exchange has to lower the mean variance by this part to be worth it.
const WORTH: f64 = 1e-4;

/// `count` free candidates that make the mean variance of a reconstructed point small; they are taken.
pub(super) fn best(
    candidates: &mut Candidates<'_>,
    prior: &Information,
    goal: &Information,
    count: usize,
    reachable: &dyn Fn(&Pose<World, Probe>) -> bool,
) -> Result<Vec<usize>, NoPlan> {
    let mut chosen = Vec::with_capacity(count);
    let mut sum = *prior;
    while chosen.len() < count {
        let Some(next) = next(candidates, &sum, goal, reachable) else {
            return Err(NoPlan::TooFew { found: chosen.len(), wanted: count, refused: candidates.refused });
        };
        sum += candidates.information(next);
        chosen.push(next);
    }
    for _ in 0..ROUNDS {
        if !exchange(candidates, &mut chosen, &mut sum, goal, reachable) {
            break;
        }
    }
    Ok(chosen)
}

/// The prior's information with that of the chosen poses.
pub(super) fn total(prior: &Information, chosen: &[usize], candidates: &Candidates<'_>) -> Information {
    chosen.iter().fold(*prior, |sum, i| sum + candidates.information(*i))
}

/// The free candidate that leaves the least variance and can be reached: taken.
fn next(
    candidates: &mut Candidates<'_>,
    sum: &Information,
    goal: &Information,
    reachable: &dyn Fn(&Pose<World, Probe>) -> bool,
) -> Option<usize> {
    let mut left: Vec<(f64, usize)> =
        candidates.free().map(|i| (variance(&(sum + candidates.information(i)), goal), i)).collect();
    left.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    left.into_iter().map(|(_, i)| i).find(|i| candidates.take(*i, reachable))
}

/// Gives every chosen pose back once and takes the best instead; whether that helped.
fn exchange(
    candidates: &mut Candidates<'_>,
    chosen: &mut [usize],
    sum: &mut Information,
    goal: &Information,
    reachable: &dyn Fn(&Pose<World, Probe>) -> bool,
) -> bool {
    let before = variance(sum, goal);
    for place in chosen {
        let without = *sum - candidates.information(*place);
        candidates.give_back(*place);
        // It is free itself, so that there is always one.
        if let Some(better) = next(candidates, &without, goal, reachable) {
            *place = better;
        }
        *sum = without + candidates.information(*place);
    }
    variance(sum, goal) < before * (1.0 - WORTH)
}

/// Mean variance of a reconstructed point over the image (m²).
fn variance(information: &Information, goal: &Information) -> f64 {
    covariance(information).component_mul(goal).sum()
}

/// Puts the chosen in an order that goes little way: the nearest next, a degree of turning counted as a millimetre.
pub(super) fn in_order(chosen: &mut [usize], candidates: &Candidates<'_>) {
    let way = |a: usize, b: usize| match (candidates.pose(a), candidates.pose(b)) {
        (Some(a), Some(b)) => {
            let (metres, radians) = a.distance(&b);
            metres + radians.to_degrees() * 1e-3
        }
        _ => f64::INFINITY,
    };
    for done in 1..chosen.len() {
        let (behind, ahead) = chosen.split_at_mut(done);
        let Some(last) = behind.last().copied() else { continue };
        let nearest = (0..ahead.len()).min_by(|a, b| way(last, ahead[*a]).total_cmp(&way(last, ahead[*b])));
        if let Some(nearest) = nearest {
            ahead.swap(0, nearest);
        }
    }
}
