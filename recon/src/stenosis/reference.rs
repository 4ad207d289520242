//! What a stenosis is measured against.

use nalgebra::Vector3;

use super::place::Place;
use super::{Reference, ReferenceChoice, ReferenceSide};
use crate::uncertainty::{COMMON, shared};

/// Length of the normal segment that is the reference (mm), and the least of it that must be measured.
const REFERENCE_MM: f64 = 10.0;
const LEAST_REFERENCE_MM: f64 = 2.0;
/// How far from the narrowing it may end, when another narrowing lies between (mm).
const AWAY_MM: f64 = 30.0;
/// Places farther apart than this are not of one segment (mm).
const APART_MM: f64 = 2.0;

/// A stretch of places, with its median area and how sure that is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Beginning and end (mm).
    pub(super) ends: [f64; 2],
    /// Median area (mm2).
    pub(super) area: f64,
    /// Variance of the random error, relative to the area.
    pub(super) variance: f64,
    /// Errors from common causes, relative to the area.
    pub(super) common: [f64; COMMON],
    /// The middle of its outlines (m), and where along the vessel that is (mm).
    pub(super) middle: Vector3<f64>,
    /// Along the vessel there.
    pub(super) along: Vector3<f64>,
}

/// The normal segments on both sides of a narrowing; `normal` says whether a place lies in no narrowing.
pub(super) fn beside(
    places: &[Place],
    [from, to]: [usize; 2],
    normal: impl Fn(f64) -> bool,
) -> [Option<Segment>; 2] {
    let before = run(places, (0..=from).rev(), &normal);
    let after = run(places, to..places.len(), &normal);
    [before, after].map(|run| Segment::of(places, &run))
}

/// The first normal stretch going outward that is long enough, up to the reference's length of it.
fn run(places: &[Place], outward: impl Iterator<Item = usize>, normal: impl Fn(f64) -> bool) -> Vec<usize> {
    let mut run: Vec<usize> = Vec::new();
    let mut start = None;
    for i in outward {
        let at = places[i].at;
        let start = *start.get_or_insert(at);
        let reach = run.first().map_or(0.0, |&first| (at - places[first].at).abs());
        let hole = run.last().is_some_and(|&last| (at - places[last].at).abs() > APART_MM);
        if reach > REFERENCE_MM || (at - start).abs() > AWAY_MM {
            break;
        }
        if hole || !normal(at) {
            if length(places, &run) >= LEAST_REFERENCE_MM {
                break;
            }
            run.clear();
        }
        if normal(at) {
            run.push(i);
        }
    }
    run
}

fn length(places: &[Place], run: &[usize]) -> f64 {
    let ends = run.first().zip(run.last());
    ends.map_or(0.0, |(&a, &b)| (places[b].at - places[a].at).abs())
}

impl Segment {
    /// Of these places, when they are long enough.
    fn of(places: &[Place], run: &[usize]) -> Option<Self> {
        if length(places, run) < LEAST_REFERENCE_MM {
            return None;
        }
        let mut inside: Vec<&Place> = run.iter().filter_map(|&i| places.get(i)).collect();
        inside.sort_by(|a, b| a.at.total_cmp(&b.at));
        let middle = inside.get(inside.len() / 2)?;
        let (first, last) = (inside.first()?, inside.last()?);
        Some(Self {
            ends: [first.at, last.at],
            area: median(&inside),
            variance: variance_of_mean(&inside),
            common: mean_common(&inside),
            middle: middle.middle,
            along: middle.along,
        })
    }

    /// Where its middle is (mm).
    fn at(&self) -> f64 {
        0.5 * (self.ends[0] + self.ends[1])
    }
}

fn median(inside: &[&Place]) -> f64 {
    let mut areas: Vec<f64> = inside.iter().map(|place| place.area).collect();
    areas.sort_by(f64::total_cmp);
    let half = areas.len() / 2;
    if areas.len() % 2 == 1 { areas[half] } else { 0.5 * (areas[half - 1] + areas[half]) }
}

/// Of the mean of areas whose random errors near neighbours share, relative to the area. The median of errors that
/// smooth is hardly less sure than their mean.
fn variance_of_mean(inside: &[&Place]) -> f64 {
    let relative = |place: &Place| place.error.random_mm2 / place.area;
    let pair = |a: &Place, b: &Place| relative(a) * relative(b) * shared(a.at - b.at);
    let sum: f64 = inside.iter().flat_map(|a| inside.iter().map(move |b| pair(a, b))).sum();
    sum / (inside.len() * inside.len()) as f64
}

fn mean_common(inside: &[&Place]) -> [f64; COMMON] {
    let count = inside.len() as f64;
    inside.iter().fold([0.0; COMMON], |mut sum, place| {
        sum.iter_mut().zip(place.common()).for_each(|(sum, part)| *sum += part / count);
        sum
    })
}

/// The area that would be there without the narrowing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normal {
    /// mm2.
    pub(super) area: f64,
    /// Variance of the random error, relative to the area.
    pub(super) variance: f64,
    /// Errors from common causes, relative to the area.
    pub(super) common: [f64; COMMON],
    /// What it is.
    pub(super) reference: Reference,
}

impl Normal {
    /// As chosen, for a narrowing at `at` mm between these segments.
    pub(super) fn chosen(
        places: &[Place],
        choice: ReferenceChoice,
        [proximal, distal]: &[Option<Segment>; 2],
        at: f64,
    ) -> Option<Self> {
        let before = proximal.as_ref().map(|segment| Self::of(segment, ReferenceSide::Proximal));
        let after = distal.as_ref().map(|segment| Self::of(segment, ReferenceSide::Distal));
        match choice {
            ReferenceChoice::Proximal => before.or(after),
            ReferenceChoice::Interpolated => match (proximal, distal) {
                (Some(a), Some(b)) => Some(Self::between(a, b, at)),
                _ => before.or(after),
            },
            ReferenceChoice::Between { from_mm, to_mm } => {
                let segment = stretch(places, from_mm, to_mm)?;
                Some(Self::of(&segment, ReferenceSide::Chosen))
            }
        }
    }

    fn of(segment: &Segment, side: ReferenceSide) -> Self {
        let [from_mm, to_mm] = segment.ends;
        Self {
            area: segment.area,
            variance: segment.variance,
            common: segment.common,
            reference: Reference { side, from_mm, to_mm, distal_mm: None },
        }
    }

    /// The diameter linear between two segments, as a vessel tapers.
    fn between(a: &Segment, b: &Segment, at: f64) -> Self {
        let part = ((at - a.at()) / (b.at() - a.at()).max(1e-9)).clamp(0.0, 1.0);
        let (left, right) = ((1.0 - part) * a.area.sqrt(), part * b.area.sqrt());
        let root = left + right;
        // How much of the diameter, and so of its relative error, each of them makes.
        let (u, v) = (left / root, right / root);
        Self {
            area: root * root,
            variance: u * u * a.variance + v * v * b.variance,
            common: std::array::from_fn(|k| u * a.common[k] + v * b.common[k]),
            reference: Reference {
                side: ReferenceSide::Interpolated,
                from_mm: a.ends[0],
                to_mm: a.ends[1],
                distal_mm: Some(b.ends),
            },
        }
    }
}

/// What is measured between two places, when that is enough for a reference.
pub(super) fn stretch(places: &[Place], from_mm: f64, to_mm: f64) -> Option<Segment> {
    let inside: Vec<usize> =
        (0..places.len()).filter(|&i| (from_mm..=to_mm).contains(&places[i].at)).collect();
    Segment::of(places, &inside)
}

/// How far a narrow lumen lies off the line that the normal segments continue to it, of the room there is.
pub(super) fn asymmetry(
    least: &Place,
    least_area: f64,
    [proximal, distal]: &[Option<Segment>; 2],
) -> Option<f64> {
    let (a, b) = (proximal.as_ref()?, distal.as_ref()?);
    let span = b.at() - a.at();
    let t = (least.at - a.at()) / span;
    // A cubic from one middle to the other with the vessel's direction at both (Hermite): it bends as the vessel does.
    let reach = (b.middle - a.middle).norm();
    let place = (1.0 + 2.0 * t) * (1.0 - t).powi(2) * a.middle
        + t * (1.0 - t).powi(2) * reach * a.along
        + t * t * (3.0 - 2.0 * t) * b.middle
        + t * t * (t - 1.0) * reach * b.along;
    let off = least.middle - place;
    let across = (off - least.along * off.dot(&least.along)).norm() * 1e3;
    let radius = |area: f64| (area / std::f64::consts::PI).sqrt();
    let room = (1.0 - t) * radius(a.area) + t * radius(b.area) - radius(least_area);
    (room > 0.0 && t.is_finite()).then(|| (across / room).min(1.0))
}
