//! Where the probe was on the skin: approach and lift-off are found, and cut off.

use std::ops::Range;

use nalgebra::Vector3;

use crate::Sample;

/// How contact is told from air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactSign {
    /// By how the probe moves: it descends along its own axis onto the skin, and lifts off along it. For a sensor
    /// that carries probe and handle together: it feels hand and skin, whose sum says nothing while the hand
    /// presses just as hard as the skin.
    Motion,
    /// By the force along the probe's axis, with hysteresis: for a sensor that feels the skin alone.
    Force {
        /// Contact begins above it (N).
        on_n: f64,
        /// Contact ends below it (N).
        off_n: f64,
    },
}

/// Seconds over which the force is averaged before it is compared.
const FORCE_OVER_S: f64 = 0.05;
/// Distance between the places at which the direction of motion is looked at (m).
const STRIDE: f64 = 0.001;
/// Strides on either side over which a direction is measured.
const REACH: usize = 3;
/// Cosine to the probe's axis beyond which a motion is a descent or a lift.
const STEEP: f64 = 0.75;
/// The least descent or lift that counts (m): below it, it is a bump of the skin.
const LEAST_DROP: f64 = 0.006;
/// A descent of less than this (m), after the probe went along for at least [`ALONG`], is a hand that presses deeper
/// into soft skin: from the air it is longer.
const DEEPER: f64 = 0.02;
/// (m)
const ALONG: f64 = 0.01;

/// The stretches of `samples` in contact, in order. `places` are the probe's origins, tremor taken off.
pub(super) fn stretches(samples: &[Sample], places: &[Vector3<f64>], sign: ContactSign) -> Vec<Range<usize>> {
    match sign {
        ContactSign::Motion => by_motion(samples, places),
        // Soft skin gives way for a centimetre after the first touch: that is still the approach.
        ContactSign::Force { on_n, off_n } => {
            common(&by_force(samples, on_n, off_n), &by_motion(samples, places))
        }
    }
}

/// What two lists of stretches have in common.
fn common(some: &[Range<usize>], others: &[Range<usize>]) -> Vec<Range<usize>> {
    let pairs = some.iter().flat_map(|a| others.iter().map(move |b| a.start.max(b.start)..a.end.min(b.end)));
    pairs.filter(|range| !range.is_empty()).collect()
}

fn by_force(samples: &[Sample], on_n: f64, off_n: f64) -> Vec<Range<usize>> {
    let (mut found, mut since, mut mean) = (Vec::new(), None, 0.0);
    let mut last = samples.first().map(|s| s.stamp);
    for (i, sample) in samples.iter().enumerate() {
        let dt = last.map_or(0.0, |l| (sample.stamp - l).seconds());
        last = Some(sample.stamp);
        mean += (-sample.wrench.force.z - mean) * (dt / (FORCE_OVER_S + dt));
        match since {
            None if mean > on_n => since = Some(i),
            Some(from) if mean < off_n => {
                found.push(from..i);
                since = None;
            }
            _ => {}
        }
    }
    found.extend(since.map(|from| from..samples.len()));
    found
}

/// A motion along the probe's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Drop {
    /// Onto the skin, so far (m); contact begins at this sample.
    Descent(usize, f64),
    /// Off the skin; contact ends at this sample.
    Lift(usize),
}

fn by_motion(samples: &[Sample], places: &[Vector3<f64>]) -> Vec<Range<usize>> {
    let drops = drops(samples, places);
    let mut found = Vec::new();
    let mut since = if matches!(drops.first(), Some(Drop::Descent(..))) { None } else { Some(0) };
    let mut drops = drops.into_iter().peekable();
    while let Some(drop) = drops.next() {
        match (drop, since) {
            (Drop::Descent(at, by), Some(from)) if by < DEEPER && went_along(samples, places, from..at) => {}
            // Down further while already down: the first touch was none.
            (Drop::Descent(at, _), _) => since = Some(at),
            // Up once more without coming down in between: the first time the skin let the probe rise.
            (Drop::Lift(_), Some(_)) if matches!(drops.peek(), Some(Drop::Lift(_))) => {}
            (Drop::Lift(at), Some(from)) => {
                found.push(from..at.max(from));
                since = None;
            }
            (Drop::Lift(_), None) => {}
        }
    }
    found.extend(since.map(|from| from..samples.len()));
    found
}

/// Whether the probe went along the skin, across its own axis, and not only into it.
fn went_along(samples: &[Sample], places: &[Vector3<f64>], range: Range<usize>) -> bool {
    let (Some(from), Some(until)) = (places.get(range.start), places.get(range.end)) else { return false };
    let axis = samples[range.start].base_from_probe.z_axis().vector();
    let way = until - from;
    (way - axis * way.dot(&axis)).norm() >= ALONG
}

/// Every descent and lift, in order.
fn drops(samples: &[Sample], places: &[Vector3<f64>]) -> Vec<Drop> {
    let strides = strides(places);
    let slopes: Vec<i8> = (0..strides.len()).map(|k| slope(samples, places, &strides, k)).collect();
    let mut found = Vec::new();
    let mut from = 0;
    while from < slopes.len() {
        let way = slopes[from];
        let until = slopes[from..].iter().position(|s| *s != way).map_or(slopes.len(), |n| from + n);
        let (first, last) = (strides[from], strides[until - 1]);
        let by = (places[last] - places[first]).norm();
        if way != 0 && by >= LEAST_DROP {
            found.push(if way > 0 { Drop::Descent(last, by) } else { Drop::Lift(first) });
        }
        from = until;
    }
    found
}

/// Samples a stride apart.
fn strides(places: &[Vector3<f64>]) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for (i, place) in places.iter().enumerate() {
        if kept.last().is_none_or(|last| (place - places[*last]).norm() >= STRIDE) {
            kept.push(i);
        }
    }
    kept
}

/// +1 where the probe goes along its axis, -1 against it, 0 otherwise.
fn slope(samples: &[Sample], places: &[Vector3<f64>], strides: &[usize], k: usize) -> i8 {
    let (from, until) = (k.saturating_sub(REACH), (k + REACH).min(strides.len() - 1));
    let way = places[strides[until]] - places[strides[from]];
    let along = way.dot(&samples[strides[k]].base_from_probe.z_axis().vector());
    if along.abs() < STEEP * way.norm() || way.norm() < STRIDE { 0 } else { along.signum() as i8 }
}
