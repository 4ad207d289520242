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
/// Cosine to the probe's axis that a descent or a lift reaches somewhere: no skin is so steep under a probe that is
/// held square to it.
const STEEP: f64 = 0.75;
/// Cosine beyond which the strides before and after belong to it: a hand that still goes along rises slowly at first.
const GENTLE: f64 = 0.4;
/// The least descent or lift that counts (m along the probe's axis): below it, it is a bump of the skin.
const LEAST_DROP: f64 = 0.005;
/// The least lift that counts (m) when such a descent follows at the same place: over hard skin a hand that lifts does not
/// rise far, and what came down steeply was up.
const LEAST_PAIRED: f64 = 0.0025;
/// Part of a lift that has to be lost again, however slowly, before the probe is back on the skin.
const BACK: f64 = 0.6;
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

/// A motion along the probe's axis: from one sample to another, so far (m, positive is down).
#[derive(Clone, Debug, PartialEq)]
struct Drop {
    range: Range<usize>,
    by: f64,
}

/// The stretches between descents and lifts.
///
/// The first descent ends on the skin. A lift ends the contact until the next descent, or until the probe has slowly
/// come down by most of what it rose; when it rises once more instead, the skin only let it rise the first time. A
/// further descent before it went along is still the approach, a short one afterwards a hand that presses deeper.
fn by_motion(samples: &[Sample], places: &[Vector3<f64>]) -> Vec<Range<usize>> {
    let heights = heights(samples, places);
    let drops = drops(samples, places, &heights);
    let mut found = Vec::new();
    let mut since = if drops.first().is_some_and(|drop| drop.by > 0.0) { None } else { Some(0) };
    let mut drops = drops.iter().peekable();
    while let Some(drop) = drops.next() {
        let Some(from) = since else {
            since = (drop.by > 0.0).then_some(drop.range.end);
            continue;
        };
        if drop.by > 0.0 {
            if drop.by >= DEEPER || !went_along(samples, places, from..drop.range.end) {
                since = Some(drop.range.end);
            }
            continue;
        }
        let next = drops.peek();
        let until = next.map_or(samples.len(), |next| next.range.start);
        let back = comes_back(&heights, &drop.range, until);
        if back.is_none() && next.is_some_and(|next| next.by < 0.0) {
            continue;
        }
        found.push(from..drop.range.start.max(from));
        since = back;
    }
    found.extend(since.map(|from| from..samples.len()));
    found
}

/// Where, before `until`, the probe has slowly come down by most of what it rose since the lift began.
fn comes_back(heights: &[f64], lift: &Range<usize>, until: usize) -> Option<usize> {
    let foot = *heights.get(lift.start)?;
    let mut top = *heights.get(lift.end)?;
    (lift.end..until).find(|i| {
        top = top.max(heights[*i]);
        top - heights[*i] >= BACK * (top - foot)
    })
}

/// Whether the probe went along the skin, across its own axis, and not only into it.
fn went_along(samples: &[Sample], places: &[Vector3<f64>], range: Range<usize>) -> bool {
    let (Some(from), Some(until)) = (places.get(range.start), places.get(range.end)) else { return false };
    let axis = samples[range.start].base_from_probe.z_axis().vector();
    let way = until - from;
    (way - axis * way.dot(&axis)).norm() >= ALONG
}

/// How high the probe is (m), from wherever it began: what it moved against its own axis, summed.
fn heights(samples: &[Sample], places: &[Vector3<f64>]) -> Vec<f64> {
    let mut height = 0.0;
    let mut last = places.first();
    let rises = samples.iter().zip(places).map(|(sample, place)| {
        let way = last.map_or(Vector3::zeros(), |last| place - last);
        last = Some(place);
        height -= way.dot(&sample.base_from_probe.z_axis().vector());
        height
    });
    rises.collect()
}

/// Every descent and lift, in order: strides that go the same way along the axis, one of them steeply.
fn drops(samples: &[Sample], places: &[Vector3<f64>], heights: &[f64]) -> Vec<Drop> {
    let strides = strides(places);
    let cosines: Vec<f64> = (0..strides.len()).map(|k| cosine(samples, places, &strides, k)).collect();
    let way = |cosine: f64| if cosine.abs() < GENTLE { 0 } else { cosine.signum() as i8 };
    let (mut found, mut from) = (Vec::new(), 0);
    while from < cosines.len() {
        let same = cosines[from..].iter().take_while(|c| way(**c) == way(cosines[from])).count();
        let run = &cosines[from..from + same];
        let range = strides[from]..strides[from + same - 1];
        let by = heights[range.start] - heights[range.end];
        if way(cosines[from]) != 0 && by.abs() >= LEAST_PAIRED && run.iter().any(|c| c.abs() >= STEEP) {
            found.push(Drop { range, by });
        }
        from += same;
    }
    found.retain(|drop: &Drop| drop.by < 0.0 || drop.by >= LEAST_DROP);
    paired(samples, places, &found)
}

/// Without the small lifts that no descent follows at the same place.
fn paired(samples: &[Sample], places: &[Vector3<f64>], drops: &[Drop]) -> Vec<Drop> {
    let counts = |(i, drop): (usize, &Drop)| {
        let comes_down = drops.get(i + 1).is_some_and(|next| {
            next.by > 0.0 && !went_along(samples, places, drop.range.start..next.range.end)
        });
        (drop.by.abs() >= LEAST_DROP || comes_down).then(|| drop.clone())
    };
    drops.iter().enumerate().filter_map(counts).collect()
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

/// Cosine of the motion around a stride to the probe's axis; none where it hardly moves.
fn cosine(samples: &[Sample], places: &[Vector3<f64>], strides: &[usize], k: usize) -> f64 {
    let (from, until) = (k.saturating_sub(REACH), (k + REACH).min(strides.len() - 1));
    let way = places[strides[until]] - places[strides[from]];
    let along = way.dot(&samples[strides[k]].base_from_probe.z_axis().vector());
    if way.norm() < STRIDE { 0.0 } else { along / way.norm() }
}
