//! How much of every limit a motion uses, between the places it was made from too.
//!
//! Inside a piece of the joints' spline and a cell of the motion all is polynomial in the distance: `q'` of degree 2,
//! `q''` 1, `b` 2. A polynomial lies between its Bernstein coefficients, so their largest bounds it everywhere.

use super::profile::{Cell, Profile};
use super::way::{Row, Slopes, Way};
use super::{MotionBounds, PathSpeed};

/// The shares of velocity, acceleration and jerk that each cell uses at most.
pub(super) fn used(way: &Way, profile: &Profile, wanted: &PathSpeed) -> Vec<MotionBounds> {
    let ends = profile.cells.iter().skip(1).map(|c| c.place).chain([profile.length]);
    let step = way.step();
    let mut piece = 0;
    // q' and q'' where the last part ended, which are those where the next one begins.
    let [first, second, _] = way.on(0, 0.0);
    let mut here = [first, second];
    // A launch ends with the acceleration that the next cell begins with.
    let nexts = profile.cells.iter().skip(1).map(|c| c.acceleration).chain([0.0]);
    let each = profile.cells.iter().zip(ends).zip(nexts).map(|((cell, end), next)| {
        let peak = cell.acceleration.abs().max(next.abs());
        let mut most = MotionBounds { velocity: 0.0, acceleration: 0.0, jerk: 0.0 };
        let mut from = cell.place;
        while from < end {
            while piece + 1 < way.pieces() && step * (piece + 1) as f64 <= from {
                piece += 1;
            }
            let next = if piece + 1 < way.pieces() { step * (piece + 1) as f64 } else { f64::INFINITY };
            let until = end.min(next);
            let there = way.on(piece, until - step * piece as f64);
            most = most.max(&part(way, wanted, (cell, peak), (&here, &there), [from, until]));
            (here, from) = ([there[0], there[1]], until);
        }
        most
    });
    each.collect()
}

/// Speed squared at both ends of a part of a cell, and its slopes there; for a constant jerk, bounds of them.
struct Part {
    /// Bernstein coefficients of `b`.
    b: [f64; 3],
    /// `b'` at both ends.
    slope: [f64; 2],
    bend: f64,
    fastest: f64,
}

fn part(
    way: &Way,
    wanted: &PathSpeed,
    (cell, peak): (&Cell, f64),
    (left, right): (&[Row; 2], &Slopes),
    [from, until]: [f64; 2],
) -> MotionBounds {
    let length = until - from;
    // q' as Bernstein coefficients.
    let first = [left[0], left[0] + left[1] * (0.5 * length), right[0]];
    let (second, third) = ([left[1], right[1]], right[2]);
    if cell.jerk.abs() > 0.0 {
        return launched(way, wanted, (cell.jerk.abs(), peak), &first, &second, &third);
    }
    let part = Part::of(cell, from, length);
    let Part { b, slope: g, bend, fastest } = part;
    let [per_v, per_a, per_j] = way.per();
    let velocity = largest(&first, per_v) * fastest;
    let acceleration = [
        (first[0] * g[0]) * 0.5 + second[0] * b[0],
        (first[0] * g[1] + first[1] * (2.0 * g[0])) / 6.0
            + (second[1] * b[0] + second[0] * (2.0 * b[1])) / 3.0,
        (first[1] * (2.0 * g[1]) + first[2] * g[0]) / 6.0
            + (second[1] * (2.0 * b[1]) + second[0] * b[2]) / 3.0,
        (first[2] * g[1]) * 0.5 + second[1] * b[2],
    ];
    let middle = (second[0] * g[1] + second[1] * g[0]) * 0.5;
    let jerk = [
        first[0] * (0.5 * bend) + second[0] * (1.5 * g[0]) + third * b[0],
        first[1] * (0.5 * bend) + middle * 1.5 + third * b[1],
        first[2] * (0.5 * bend) + second[1] * (1.5 * g[1]) + third * b[2],
    ];
    MotionBounds {
        velocity: velocity.max(fastest / wanted.speed),
        acceleration: largest(&acceleration, per_a)
            .max(0.5 * g[0].abs().max(g[1].abs()) / wanted.acceleration),
        jerk: (largest(&jerk, per_j) * fastest).max(0.5 * bend.abs() * fastest / wanted.jerk),
    }
}

impl Part {
    fn of(cell: &Cell, from: f64, length: f64) -> Self {
        let (b0, g0, bend) = (cell.speed * cell.speed, 2.0 * cell.acceleration, 2.0 * cell.bend);
        let into = from - cell.place;
        let b = b0 + into * (g0 + 0.5 * into * bend);
        let g = g0 + into * bend;
        let after = g + length * bend;
        let ends = [b, b + 0.5 * length * g, b + length * (g + 0.5 * length * bend)];
        let fastest = ends.iter().fold(0.0_f64, |m, b| m.max(*b)).sqrt();
        Self { b: ends, slope: [g, after], bend, fastest }
    }
}

/// The first and the last cell, at a constant jerk: every factor at its largest.
fn launched(
    way: &Way,
    wanted: &PathSpeed,
    (jerk, a): (f64, f64),
    first: &[Row; 3],
    second: &[Row; 2],
    third: &Row,
) -> MotionBounds {
    let v = 0.5 * a * a / jerk;
    let [per_v, per_a, per_j] = way.per();
    let [q1, q2] = [per_a, per_j].map(|per| (largest(first, per), largest(second, per)));
    MotionBounds {
        velocity: (largest(first, per_v) * v).max(v / wanted.speed),
        acceleration: (q1.0 * a + q1.1 * v * v).max(a / wanted.acceleration),
        jerk: (q2.0 * jerk + 3.0 * q2.1 * v * a + third.component_mul(per_j).amax() * v * v * v)
            .max(jerk / wanted.jerk),
    }
}

fn largest(rows: &[Row], per: &Row) -> f64 {
    rows.iter().fold(0.0, |most, row| most.max(row.component_mul(per).amax()))
}
