//! Which dot belongs to which wire once the plane is nearly known, and how well that explains the image.

use super::plane::{Belief, Crossing, Match, Plane};
use super::section::Section;
use super::seen::Seen;
use nalgebra::Vector2;

/// A wire that should be seen is found this often; the price of a missing one is its logarithm's.
const FOUND: f64 = 0.9;
/// Wires nearer to their ends than this (m) need not be seen: plates, glue and holes hide them.
const ENDS_M: f64 = 1.5e-3;
/// Two wires nearer to each other in the image than this (m) make dots that cannot be told apart, or one dot.
const CROWDED_M: f64 = 1.5e-3;

/// Where dots can be: a rectangle of the image (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub low: Vector2<f64>,
    pub high: Vector2<f64>,
}

impl Window {
    /// The rectangle around all dots.
    pub fn around(seen: &[Seen]) -> Self {
        let start = Self { low: Vector2::repeat(f64::INFINITY), high: Vector2::repeat(f64::NEG_INFINITY) };
        seen.iter().fold(start, |w, s| Self { low: w.low.inf(&s.at), high: w.high.sup(&s.at) })
    }

    pub fn holds(&self, at: Vector2<f64>, margin: f64) -> bool {
        (0..2).all(|i| at[i] > self.low[i] + margin && at[i] < self.high[i] - margin)
    }

    /// Its area (m²), at least a square of two centimetres.
    pub fn area(&self) -> f64 {
        (0..2).map(|i| (self.high[i] - self.low[i]).max(0.02)).product()
    }
}

/// One dot a wire, one wire a dot, the nearest first, none further than `gate` (m) beyond what its covariance allows.
pub(super) fn assign(plane: &Plane, section: &Section, seen: &[Seen], gate: f64) -> Vec<Match> {
    let mut pairs = Vec::with_capacity(32);
    for (wire, strand) in section.strands.iter().enumerate() {
        let Some(crossing) = plane.crossing(strand).filter(|c| c.inside > -1e-3) else { continue };
        for (dot, s) in seen.iter().enumerate() {
            let off = (s.at - crossing.at).norm();
            if off < gate + 3.0 * s.covariance.trace().max(0.0).sqrt().min(gate) {
                pairs.push((off, dot, wire));
            }
        }
    }
    one_to_one(pairs)
}

/// The nearest pairs first, each dot and each wire once.
pub(super) fn one_to_one(mut pairs: Vec<(f64, usize, usize)>) -> Vec<Match> {
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut matches: Vec<Match> = Vec::with_capacity(pairs.len());
    for (_, dot, wire) in pairs {
        if !matches.iter().any(|&(d, w)| d == dot || w == wire) {
            matches.push((dot, wire));
        }
    }
    matches
}

/// How well a plane explains an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Worth {
    /// Logarithm of how much likelier the dots are with this plane than as clutter.
    pub score: f64,
    /// Wires that should be seen and no dot is there.
    pub missing: usize,
}

/// The likelihood of the matches against clutter spread evenly over the window, the price of wires not seen, and what
/// was believed before of tilt and scale.
pub(super) fn worth(
    plane: &Plane,
    section: &Section,
    seen: &[Seen],
    matches: &[Match],
    belief: &Belief,
    window: &Window,
) -> Worth {
    // False dots are as dense as the dots that this plane leaves unexplained.
    let clutter = (window.area() / (seen.len() - matches.len() + 1) as f64).ln();
    let gain = |&(dot, wire): &Match| {
        let (misfit, determinant) = plane.misfit(&seen[dot], &section.strands[wire], belief);
        let width = std::f64::consts::TAU * determinant.max(1e-18).sqrt();
        clutter - width.ln() + FOUND.ln() - misfit.min(25.0) / 2.0
    };
    let missing = missing(plane, section, matches, window);
    let tilt = plane.turn.matrix().fixed_view::<2, 1>(0, 2).norm_squared() / belief.tilt_sd.powi(2);
    let scale = plane.stretch.norm_squared() / belief.scale_sd.powi(2);
    let found: f64 = matches.iter().map(gain).sum();
    Worth { score: found + missing as f64 * (1.0 - FOUND).ln() - (tilt + scale) / 2.0, missing }
}

/// The matches whose wire has no other so near in the image that one dot could be both.
pub(super) fn alone(plane: &Plane, section: &Section, matches: &[Match]) -> Vec<Match> {
    let seen = |c: &Crossing| c.inside > -1e-3;
    let at: Vec<_> = section.strands.iter().map(|s| plane.crossing(s).filter(seen).map(|c| c.at)).collect();
    let crowded = |wire: usize| {
        let near = |other: usize| at[wire].zip(at[other]).is_some_and(|(a, b)| (a - b).norm() < CROWDED_M);
        (0..at.len()).any(|other| other != wire && near(other))
    };
    matches.iter().filter(|m| !crowded(m.1)).copied().collect()
}

fn missing(plane: &Plane, section: &Section, matches: &[Match], window: &Window) -> usize {
    let due = |wire: usize| {
        let crossing = plane.crossing(&section.strands[wire]);
        let unseen = !matches.iter().any(|m| m.1 == wire);
        unseen && crossing.is_some_and(|c| c.inside > ENDS_M && c.upright > 0.5 && window.holds(c.at, 1e-3))
    };
    (0..section.strands.len()).filter(|&wire| due(wire)).count()
}
