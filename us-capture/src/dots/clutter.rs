//! What is bright and small and no wire: screen text, second echoes.

use nalgebra::{Matrix2, Vector2};

use super::Dot;
use super::region::Moments;

/// How many of its spreads from a dot's centre a weaker dot counts as its second echo.
const ECHO: f64 = 3.5;
/// A step from one pixel to the next of more than this part of the brightest pixel: drawn, not echoed.
const SHARP: f64 = 0.45;
/// So many sharp pieces side by side are text.
const TEXT: usize = 4;

/// A dot with what tells it from text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The dot.
    pub dot: Dot,
    first: [usize; 2],
    last: [usize; 2],
    sharp: bool,
}

impl Found {
    pub(super) fn new(moments: &Moments, cut: bool, wobble: f64) -> Self {
        // A pixel is a square: its own spread keeps that of a dot of one line from being flat.
        let spread_px2 = moments.spread + Matrix2::identity() / 12.0;
        let peak = f64::from(moments.peak);
        let dot = Dot {
            at_px: moments.centre.into(),
            covariance_px2: spread_px2 * wobble.powi(2) + moments.noise,
            spread_px2,
            peak,
            mass: moments.mass,
            cut,
        };
        Self {
            dot,
            first: moments.first,
            last: moments.last,
            sharp: f64::from(moments.steepest) > SHARP * peak,
        }
    }

    /// Whether what lies between them is no wider than the thinner of both.
    fn beside(&self, other: &Self) -> bool {
        let gap = |axis: usize| {
            let (first, last) =
                (self.first[axis].max(other.first[axis]), self.last[axis].min(other.last[axis]));
            first.saturating_sub(last)
        };
        gap(0).max(gap(1)) <= self.thickness().min(other.thickness())
    }

    fn thickness(&self) -> usize {
        (self.last[0] - self.first[0]).min(self.last[1] - self.first[1]) + 1
    }
}

/// Leaves out screen text: several pieces with edges as sharp as pixels, side by side. Wires are as far apart as
/// several of their echoes, and an echo's edges are as wide as the beam.
pub(super) fn drop_text(found: &mut Vec<Found>) {
    let groups = groups(found);
    let size = |group: usize| groups.iter().filter(|other| **other == group).count();
    let text: Vec<bool> =
        found.iter().zip(&groups).map(|(f, group)| f.sharp && size(*group) >= TEXT).collect();
    let mut text = text.into_iter();
    found.retain(|_| !text.next().unwrap_or(false));
}

/// The number of the group each belongs to: sharp pieces that lie side by side.
fn groups(found: &[Found]) -> Vec<usize> {
    let mut groups: Vec<usize> = (0..found.len()).collect();
    for (i, a) in found.iter().enumerate().filter(|(_, a)| a.sharp) {
        for (j, b) in found.iter().enumerate().skip(i + 1).filter(|(_, b)| b.sharp) {
            if groups[i] != groups[j] && a.beside(b) {
                let (from, to) = (groups[j], groups[i]);
                groups.iter_mut().filter(|group| **group == from).for_each(|group| *group = to);
            }
        }
    }
    groups
}

/// Leaves out dots that lie in the skirt of a stronger one (`found` comes strongest first): the wire's second echo.
pub(super) fn drop_second_echoes(found: &mut Vec<Found>) {
    let mut kept: Vec<Found> = Vec::with_capacity(found.len());
    for one in found.drain(..) {
        if !kept.iter().any(|stronger| in_skirt(&stronger.dot, &one.dot)) {
            kept.push(one);
        }
    }
    *found = kept;
}

fn in_skirt(stronger: &Dot, dot: &Dot) -> bool {
    let off = Vector2::from(dot.at_px) - Vector2::from(stronger.at_px);
    let Some(inverse) = stronger.spread_px2.try_inverse() else { return false };
    off.dot(&(inverse * off)) < ECHO * ECHO
}
