//! Where a branch leaves its parent: the stretch between its first section and the parent's middle.

use nalgebra::Vector3;
use probepath_frames::{Direction, Point};

use super::{Leaves, Vessel};
use crate::centreline::{Centreline, CentrelinePoint, normal_part};

/// A branch that begins farther than this from the parent's surface has not been seen to leave it (m).
const FARTHEST_M: f64 = 12e-3;
/// Distance of the root's samples (m).
const STEP_M: f64 = 0.25e-3;
/// A branch leaves at no flatter angle than this: its root reaches back along the parent by at most so many times
/// the distance between them.
const FLATTEST: f64 = 1.5;

/// The stretch from the parent's middle to the branch's beginning: nothing was measured there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Root {
    /// Its samples, then the branch's own, with lengths from the parent's middle on.
    pub line: Centreline,
    /// The root's own length (m).
    pub length_m: f64,
    /// What the branch's first radii are multiplied by where the root begins, so that it stays inside the parent.
    pub narrow: f64,
}

/// The earlier vessel that a line begins or ends nearest to: its place in `vessels`, and whether it is the end.
pub(crate) fn parent(line: &Centreline, vessels: &[Vessel]) -> Option<(usize, bool)> {
    let (first, last) = (line.points.first()?.point.vector(), line.points.last()?.point.vector());
    let ends = vessels
        .iter()
        .enumerate()
        .flat_map(|(i, v)| [(i, false, apart(v, &first)), (i, true, apart(v, &last))]);
    let (parent, is_end, _) = ends.min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some((parent, is_end))
}

/// How far a place is from a vessel's surface (m); negative inside.
fn apart(vessel: &Vessel, place: &Vector3<f64>) -> f64 {
    vessel.centreline.nearest(place).map_or(f64::INFINITY, |near| {
        (near.point.vector() - place).norm() - vessel.tube.section(near.at_m)[0]
    })
}

/// The root of a branch, and where it leaves; nothing when it begins too far away.
pub(crate) fn root(branch: &Vessel, vessels: &[Vessel], parent: usize) -> Option<(Root, Leaves)> {
    let stem = vessels.get(parent)?;
    let start = branch.centreline.points.first()?;
    let (begin, along) = (start.point.vector(), start.tangent.vector());
    let radius = branch.tube.section(0.0)[0];
    if apart(stem, &begin) - radius > FARTHEST_M {
        return None;
    }
    let foot = stem.centreline.at(stem.centreline.foot(&begin, stem.centreline.nearest_m(&begin)?)?)?;
    let distance = (begin - foot.point.vector()).norm();
    let cosine = along.dot(&foot.tangent.vector());
    let back = (cosine / (1.0 - cosine * cosine).max(1e-6).sqrt()).clamp(-FLATTEST, FLATTEST) * distance;
    let take_off = (foot.at_m - back).clamp(0.0, stem.centreline.length_m());
    let origin = stem.centreline.at(take_off)?.point.vector();
    let points = samples(origin, start)?;
    let line = joined(points, &branch.centreline);
    let length_m = line.points.last()?.at_m - branch.centreline.length_m();
    let narrow = (0.85 * stem.tube.section(take_off)[0] / radius.max(1e-6)).min(1.0);
    let outside = line.points.iter().find(|point| apart(stem, &point.point.vector()) > 0.0).unwrap_or(start);
    let at_mm = stem.centreline.nearest_m(&outside.point.vector())? * 1e3;
    let angle_deg = cosine.clamp(-1.0, 1.0).acos().to_degrees();
    let leaves = Leaves { parent: stem.number, at_mm, angle_deg };
    Some((Root { line, length_m, narrow }, leaves))
}

/// From the parent's middle to the branch's first point, which is left out: a parabola that arrives in the branch's
/// direction. The axes are those of the branch, carried back without twist.
fn samples(origin: Vector3<f64>, start: &CentrelinePoint) -> Option<Vec<CentrelinePoint>> {
    let (end, tangent) = (start.point.vector(), start.tangent.vector());
    let length = (end - origin).norm();
    let control = end - tangent * (0.5 * length);
    let count = (length / STEP_M).ceil().max(1.0);
    let mut up = start.up.vector();
    let mut points = Vec::new();
    for i in (0..count as usize).rev() {
        let t = i as f64 / count;
        let u = 1.0 - t;
        let place = origin * (u * u) + control * (2.0 * u * t) + end * (t * t);
        let slope = (control - origin) * u + (end - control) * t;
        let along = Direction::of(slope).ok()?;
        let normal = normal_part(up, along.vector())?;
        up = normal.vector();
        let side = Direction::of(along.vector().cross(&up)).ok()?;
        points.push(CentrelinePoint {
            at_m: 0.0,
            point: Point::from_vector(place),
            tangent: along,
            up: normal,
            side,
        });
    }
    points.reverse();
    Some(points)
}

/// One line of both, with its lengths.
fn joined(mut points: Vec<CentrelinePoint>, branch: &Centreline) -> Centreline {
    points.extend(&branch.points);
    let mut at_m = 0.0;
    for i in 0..points.len() {
        if i > 0 {
            at_m += points[i].point.distance(&points[i - 1].point);
        }
        points[i].at_m = at_m;
    }
    Centreline { points }
}
