//! A vessel as a solid: how far outside it a place is.

use nalgebra::Vector3;

use super::super::Vessel;
use crate::centreline::Centreline;
use crate::surface::{SectionCovariance, Way};

/// Seeds are this far apart along the vessel (m): a narrow place must not hide what lies beyond it.
const SEED_M: f64 = 5e-3;
/// Covariances are kept this far apart (m).
const STEP_M: f64 = 0.5e-3;

/// A vessel with its root, and caps where it ends.
pub(super) struct Solid<'a> {
    vessel: &'a Vessel,
    line: &'a Centreline,
    root_m: f64,
    narrow: f64,
    /// Covariances of the sections, each `STEP_M` along the vessel.
    covariances: Vec<SectionCovariance>,
}

/// A place as seen from the vessel's line.
struct Seen {
    /// Length along the vessel itself: negative in its root (m).
    at: f64,
    turn: (f64, f64),
    /// Distance from the line (m).
    r: f64,
    /// How far beyond the nearer end (m); negative between the ends.
    beyond: f64,
}

impl<'a> Solid<'a> {
    pub(super) fn of(vessel: &'a Vessel) -> Self {
        let (line, root_m, narrow) = match &vessel.root {
            Some(root) => (&root.line, root.length_m, root.narrow),
            None => (&vessel.centreline, 0.0, 1.0),
        };
        let steps = (vessel.centreline.length_m() / STEP_M).ceil() as usize;
        let covariances = (0..=steps).map(|i| vessel.tube.covariance(i as f64 * STEP_M)).collect();
        Self { vessel, line, root_m, narrow, covariances }
    }

    fn seen(&self, place: &Vector3<f64>) -> Option<Seen> {
        let length = self.line.length_m();
        let foot = self.line.foot(place, self.line.nearest_m(place)?)?;
        let at = foot.clamp(0.0, length);
        let centre = self.line.at(at)?;
        let off = place - centre.point.vector();
        let (x, y) = (off.dot(&centre.up.vector()), off.dot(&centre.side.vector()));
        let r = x.hypot(y);
        let turn = if r > 0.0 { (x / r, y / r) } else { (1.0, 0.0) };
        let between = (-foot).max(foot - length);
        let beyond = if between > 0.0 { off.dot(&centre.tangent.vector()).abs() } else { between };
        Some(Seen { at: at - self.root_m, turn, r, beyond })
    }

    fn radius(&self, at: f64, turn: (f64, f64)) -> f64 {
        let radius = self.vessel.tube.shape().radius(at.max(0.0), turn);
        if at >= 0.0 { radius } else { radius * (1.0 + (self.narrow - 1.0) * (-at / self.root_m)) }
    }

    /// How far outside a place is (m); negative inside. Exact where it is zero.
    pub(super) fn outside(&self, place: &Vector3<f64>) -> f64 {
        let out = |seen: Seen| (seen.r - self.radius(seen.at, seen.turn)).max(seen.beyond);
        self.seen(place).map_or(f64::INFINITY, out)
    }

    /// Places inside, and a way out of the vessel from each.
    pub(super) fn seeds(&self) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let count = (self.line.length_m() / SEED_M).ceil().max(1.0) as usize;
        let places = (0..count).map(|i| self.line.length_m() * (i as f64 + 0.5) / count as f64);
        let points = places.filter_map(|at| self.line.at(at));
        points.flat_map(|p| [1.0, -1.0].map(|sign| (p.point.vector(), p.up.vector() * sign))).collect()
    }

    /// Area (m2) there, distance from the line (m) and its standard deviation (m).
    pub(super) fn numbers(&self, place: &Vector3<f64>) -> (f64, f64, f64) {
        let none = f64::NAN;
        let Some(seen) = self.seen(place) else { return (none, none, none) };
        let r = if seen.beyond > 0.0 { self.radius(seen.at, seen.turn) } else { seen.r };
        if seen.at < 0.0 || !self.vessel.is_measured(seen.at) {
            return (none, r, none);
        }
        let covariance = self.covariances.get((seen.at / STEP_M).round() as usize);
        let sd = covariance.map_or(none, |covariance| self.vessel.tube.sd(covariance, &Way::of(seen.turn)));
        (self.vessel.tube.shape().area(seen.at), r, sd)
    }
}
