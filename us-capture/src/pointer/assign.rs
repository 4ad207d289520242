//! Which place is which landmark, when nobody wrote it down: every order is tried whose distances agree.

use nalgebra::Vector3;

use super::PointerError;
use super::rigid::{Rigid, rigid};

/// Orders grow with the factorial of this: 8 are 40320.
const MOST_UNNAMED: usize = 8;
/// Distances between touches differ from those between landmarks by less than this (m), or the order is wrong.
const DISTANCE_WITHIN_M: f64 = 0.01;
/// A second order that fits better than this (m) is not excluded by noise.
const TOLD_APART_M: f64 = 1e-3;
/// Nor is one that fits less than so many times worse than the best.
const TOLD_APART_TIMES: f64 = 3.0;

/// Landmarks and places, and what is known of which is which.
pub(super) struct Places<'a> {
    pub landmarks: &'a [Vector3<f64>],
    pub names: &'a [&'a str],
    pub places: &'a [Vector3<f64>],
    /// For every place its landmark, where it was named.
    pub known: &'a [Option<usize>],
}

/// The two best orders found so far.
#[derive(Default)]
struct Best {
    first: Option<(Rigid, Vec<usize>)>,
    second: Option<(Rigid, Vec<usize>)>,
}

/// For every place its landmark.
pub(super) fn assign(what: &Places<'_>) -> Result<Vec<usize>, PointerError> {
    if let Some(all) = what.known.iter().copied().collect::<Option<Vec<usize>>>() {
        return Ok(all);
    }
    let unnamed = what.known.iter().filter(|known| known.is_none()).count();
    if unnamed > MOST_UNNAMED {
        return Err(PointerError::TooManyUnnamed { unnamed, most: MOST_UNNAMED });
    }
    let mut best = Best::default();
    what.extend(&mut Vec::new(), &mut best);
    let Some((fit, order)) = best.first else {
        return Err(PointerError::NoOrder { within_mm: DISTANCE_WITHIN_M * 1e3 });
    };
    let limit = (fit.rms_m * TOLD_APART_TIMES).max(TOLD_APART_M);
    match best.second.filter(|(next, _)| next.rms_m < limit) {
        None => Ok(order),
        Some((next, other)) => Err(PointerError::Ambiguous {
            best: what.named(&order),
            best_mm: fit.rms_m * 1e3,
            next: what.named(&other),
            next_mm: next.rms_m * 1e3,
        }),
    }
}

impl Places<'_> {
    /// Tries every landmark for the next place, as long as the distances to those before agree.
    fn extend(&self, order: &mut Vec<usize>, best: &mut Best) {
        let Some(known) = self.known.get(order.len()) else {
            return best.take(self, order);
        };
        for landmark in 0..self.landmarks.len() {
            let taken = order.contains(&landmark) || self.known.contains(&Some(landmark));
            let free = known.map_or(!taken, |known| known == landmark);
            if free && self.agrees(order, landmark) {
                order.push(landmark);
                self.extend(order, best);
                order.pop();
            }
        }
    }

    fn agrees(&self, order: &[usize], landmark: usize) -> bool {
        let (Some(place), Some(mark)) = (self.places.get(order.len()), self.landmarks.get(landmark)) else {
            return false;
        };
        order.iter().zip(self.places).all(|(other, other_place)| {
            let there = self.landmarks.get(*other).map_or(f64::INFINITY, |other| (mark - other).norm());
            ((place - other_place).norm() - there).abs() < DISTANCE_WITHIN_M
        })
    }

    fn named(&self, order: &[usize]) -> Vec<String> {
        order.iter().filter_map(|index| self.names.get(*index)).map(|name| (*name).to_owned()).collect()
    }
}

impl Best {
    fn take(&mut self, what: &Places<'_>, order: &[usize]) {
        let marks: Vec<Vector3<f64>> =
            order.iter().filter_map(|index| what.landmarks.get(*index)).copied().collect();
        let Some(fit) = rigid(&marks, what.places) else { return };
        let better = |than: &Option<(Rigid, Vec<usize>)>| than.as_ref().is_none_or(|t| fit.rms_m < t.0.rms_m);
        if better(&self.first) {
            self.second = self.first.replace((fit, order.to_vec()));
        } else if better(&self.second) {
            self.second = Some((fit, order.to_vec()));
        }
    }
}
