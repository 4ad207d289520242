//! The fastest speed over the distance: an interior-point method on `b(s) = speed^2`.
//!
//! With `b` as the unknown the acceleration is `b' / 2` and the jerk `sqrt(b) b'' / 2`, so a joint's limits are
//!
//! ```text
//! acceleration  |q' b' / 2 + q'' b|                  <= A
//! jerk          |q' b'' / 2 + 3/2 q'' b' + q''' b|   <= J / sqrt(b)
//! ```
//!
//! linear in `b` but for the right side of the last, which is convex: its tangent lies below it, so what keeps the
//! tangent keeps the limit. The time, the integral of `1 / sqrt(b)`, is convex. Each step solves for the optimum of
//! the problem with tangents at the last one (a convex-concave procedure inside a primal-dual interior-point method;
//! Debrouwere et al., *Time-optimal path following for robots with convex-concave constraints*, IEEE T-RO 29 (2013)).
//! `b` is a quadratic B-spline, so every limit touches three neighbouring unknowns and a step is one banded
//! elimination.

use super::bands::Bands;
use super::way::{Motion, Way};
use super::{MotionBounds, PathSpeed};

/// A place where the limits are asked.
struct Place {
    /// Index of the first of the three unknowns that matter here.
    at: usize,
    /// `b`, `b'` and `b''` from these three.
    basis: [[f64; 3]; 3],
    /// The largest `b` that the velocities allow.
    fastest: f64,
    /// Where its rows begin.
    rows: usize,
}

/// One limit, either way: `|row . (b, b', b'')| <= 1`, or `<= 1 / sqrt(b)` for a jerk.
#[derive(Clone, Copy)]
struct Limit {
    row: [f64; 3],
    is_jerk: bool,
    slack: [f64; 2],
    dual: [f64; 2],
}

/// The speed along inner cells of the path, as control points of a quadratic B-spline.
pub(super) struct Fastest<'a> {
    nodes: &'a [f64],
    places: Vec<Place>,
    limits: Vec<Limit>,
    /// Of `b` at each place, slack and dual.
    tops: Vec<(f64, f64)>,
    /// Time's integral: first unknown, weight, basis of `b`.
    times: Vec<(usize, f64, [f64; 3])>,
    control: Vec<f64>,
    bands: Bands,
    right: Vec<f64>,
}

/// What a search begins with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Start {
    /// Far from the optimum.
    Cold,
    /// The optimum of nearly the same problem.
    Warm,
}

/// Where two-point Gauss integration asks.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];
/// Part of the way to the nearest bound that a step takes.
const CLOSE: f64 = 0.99;
/// The optimum is near enough when the duality gap is this part of the time.
const GAP: f64 = 3e-4;
const MOST_STEPS: usize = 60;

impl<'a> Fastest<'a> {
    /// Over the cells between `nodes`, from the values of `control`: the first two and the last two stay.
    /// `tight` shrinks a cell's limits (velocity, acceleration, jerk).
    pub(super) fn new(
        nodes: &'a [f64],
        way: &Way,
        wanted: &PathSpeed,
        tight: &[MotionBounds],
        control: Vec<f64>,
        start: Start,
    ) -> Self {
        let cells = nodes.len() - 1;
        let mut found = Self {
            nodes,
            places: Vec::with_capacity(cells),
            limits: Vec::new(),
            tops: Vec::new(),
            times: Vec::with_capacity(2 * cells),
            bands: Bands::zeros(control.len()),
            right: vec![0.0; control.len()],
            control,
        };
        let zigzag = zigzag_s(way, wanted);
        for (cell, tight) in tight.iter().enumerate() {
            let (h, middle) = (nodes[cell + 1] - nodes[cell], 0.5 * (nodes[cell] + nodes[cell + 1]));
            for part in found.asked(cell, is_free(way, middle, h / zigzag, wanted)) {
                found.ask(cell, *part, way, wanted, tight);
            }
            for part in GAUSS {
                found.times.push((cell, 0.5 * h, basis(nodes, cell, part * h)[0]));
            }
        }
        found.begin(start);
        found
    }

    /// Where in a cell the limits are asked: at both ends where the speed changes much inside, else in the middle; and
    /// at its beginning too where the jerk leaves the acceleration free to go up and down from node to node, which the
    /// middles do not see.
    fn asked(&self, cell: usize, free: bool) -> &'static [f64] {
        let h = |k: usize| self.nodes[k + 1] - self.nodes[k];
        let last = self.nodes.len() - 2;
        let even = |k: usize| (h(k) / h(cell) - 1.0).abs() < 1e-6;
        match even(cell.saturating_sub(1)) && even((cell + 1).min(last)) {
            true if free => &[0.0, 0.5],
            true => &[0.5],
            false => &[0.0, 1.0],
        }
    }

    fn ask(&mut self, cell: usize, part: f64, way: &Way, wanted: &PathSpeed, tight: &MotionBounds) {
        let h = self.nodes[cell + 1] - self.nodes[cell];
        let slopes = way.at(self.nodes[cell] + part * h);
        let [first, second, third] = &slopes;
        let [velocity, acceleration, jerk] = way.per();
        let top = wanted.speed.min(1.0 / first.component_mul(velocity).amax()) / tight.velocity;
        let rows = self.limits.len();
        self.places.push(Place {
            at: cell,
            basis: basis(self.nodes, cell, part * h),
            fastest: top * top,
            rows,
        });
        let mut add = |row: [f64; 3], is_jerk: bool| {
            self.limits.push(Limit { row, is_jerk, slack: [1.0; 2], dual: [1.0; 2] });
        };
        let (most_a, most_j) = (wanted.acceleration / tight.acceleration, wanted.jerk / tight.jerk);
        add([0.0, 0.5 / most_a, 0.0], false);
        add([0.0, 0.0, 0.5 / most_j], true);
        for joint in 0..way.joints() {
            let (a, j) = (acceleration[joint] * tight.acceleration, jerk[joint] * tight.jerk);
            let (q1, q2, q3) = (first[joint], second[joint], third[joint]);
            add([q2 * a, 0.5 * q1 * a, 0.0], false);
            add([q3 * j, 1.5 * q2 * j, 0.5 * q1 * j], true);
        }
    }

    fn rows(&self, place: usize) -> std::ops::Range<usize> {
        let end = self.places.get(place + 1).map_or(self.limits.len(), |next| next.rows);
        self.places[place].rows..end
    }

    /// `b`, `b'`, `b''` of unknowns at a place.
    fn jet(&self, place: usize, of: &[f64]) -> [f64; 3] {
        let Place { at, basis, .. } = &self.places[place];
        let three = &of[*at..at + 3];
        basis.each_ref().map(|row| row[0] * three[0] + row[1] * three[1] + row[2] * three[2])
    }

    /// Slacks from the start, and duals that balance them.
    fn begin(&mut self, start: Start) {
        let count = 2 * self.limits.len() + self.places.len();
        let (gap, least) = match start {
            Start::Cold => (1.0, 0.05),
            Start::Warm => (0.02, 0.01),
        };
        let mu = gap * self.time() / count as f64;
        self.tops = Vec::with_capacity(self.places.len());
        for place in 0..self.places.len() {
            let jet = self.jet(place, &self.control);
            let top = &self.places[place];
            let slack = (top.fastest - jet[0]).max(least * top.fastest);
            self.tops.push((slack, mu / slack));
            let bound = 1.0 / jet[0].sqrt();
            let rows = self.rows(place);
            for limit in &mut self.limits[rows] {
                let most = if limit.is_jerk { bound } else { 1.0 };
                let value = dot(&limit.row, &jet);
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    limit.slack[side] = (most - sign * value).max(least * most);
                    limit.dual[side] = mu / limit.slack[side];
                }
            }
        }
    }

    /// The time it takes (s).
    pub(super) fn time(&self) -> f64 {
        self.times.iter().map(|(at, weight, basis)| weight / self.value(*at, basis).sqrt()).sum()
    }

    fn value(&self, at: usize, basis: &[f64; 3]) -> f64 {
        dot(basis, &[self.control[at], self.control[at + 1], self.control[at + 2]])
    }

    /// To the optimum: the control points. What is found may be outside the limits by what lies between the places
    /// asked, and when it stopped early.
    pub(super) fn solve(mut self) -> Vec<f64> {
        for _ in 0..MOST_STEPS {
            let gap = self.gap();
            let count = (2 * self.limits.len() + self.places.len()) as f64;
            if gap < GAP * self.time() && self.worst() < 1e-3 {
                break;
            }
            let mu = (CENTRE * gap / count).max(0.1 * GAP * self.time() / count);
            self.assemble(mu);
            if !self.bands.solve(&mut self.right) {
                break;
            }
            self.step(mu);
        }
        self.control
    }

    /// The sum of slack times dual.
    fn gap(&self) -> f64 {
        let tops: f64 = self.tops.iter().map(|(s, z)| s * z).sum();
        let limits: f64 = self.limits.iter().map(|l| l.slack[0] * l.dual[0] + l.slack[1] * l.dual[1]).sum();
        tops + limits
    }

    /// By how much the worst limit is crossed, as a share.
    fn worst(&self) -> f64 {
        let mut worst = 0.0_f64;
        for place in 0..self.places.len() {
            let jet = self.jet(place, &self.control);
            worst = worst.max(jet[0] / self.places[place].fastest - 1.0);
            let root = jet[0].sqrt();
            for limit in &self.limits[self.rows(place)] {
                let share = dot(&limit.row, &jet).abs() * if limit.is_jerk { root } else { 1.0 };
                worst = worst.max(share - 1.0);
            }
        }
        worst
    }

    /// Newton's system: the time's curvature and every limit's, and the slope to be taken away.
    fn assemble(&mut self, mu: f64) {
        self.bands.clear();
        self.right.fill(0.0);
        for (at, weight, basis) in &self.times {
            let b = dot(basis, &[self.control[*at], self.control[at + 1], self.control[at + 2]]);
            let root = b.sqrt();
            let (slope, bend) = (-0.5 * weight / (b * root), 0.75 * weight / (b * b * root));
            self.bands.add(*at, &outer(basis, bend));
            for (k, part) in basis.iter().enumerate() {
                self.right[at + k] -= slope * part;
            }
        }
        for place in 0..self.places.len() {
            let jet = self.jet(place, &self.control);
            let (square, pull) = self.pressed(place, &jet, mu);
            let Place { at, basis, .. } = &self.places[place];
            let block = turned(&square, basis);
            self.bands.add(*at, &block);
            for k in [0, 1, 2] {
                self.right[at + k] -= pull[0] * basis[0][k] + pull[1] * basis[1][k] + pull[2] * basis[2][k];
            }
        }
        let last = self.control.len() - 1;
        for fixed in [0, 1, last - 1, last] {
            self.bands.fix(fixed, &mut self.right);
        }
    }

    /// What the limits of a place add: a square form on `(b, b', b'')` and a slope.
    fn pressed(&self, place: usize, jet: &[f64; 3], mu: f64) -> ([[f64; 3]; 3], [f64; 3]) {
        let bound = 1.0 / jet[0].sqrt();
        let falls = 0.5 * bound / jet[0];
        let mut square = [[0.0; 3]; 3];
        let mut pull = [0.0; 3];
        let (slack, dual) = self.tops[place];
        let weight = dual / slack;
        square[0][0] += weight;
        pull[0] += mu / slack + weight * (jet[0] - self.places[place].fastest + slack);
        for limit in &self.limits[self.rows(place)] {
            let (most, falls) = if limit.is_jerk { (bound, falls) } else { (1.0, 0.0) };
            let value = dot(&limit.row, jet);
            let weights = [limit.dual[0] / limit.slack[0], limit.dual[1] / limit.slack[1]];
            let force = |side: usize, value: f64| {
                mu / limit.slack[side] + weights[side] * (value - most + limit.slack[side])
            };
            let (up, down) = (force(0, value), force(1, -value));
            let (both, odd) = (weights[0] + weights[1], weights[0] - weights[1]);
            let row = &limit.row;
            for (i, here) in row.iter().enumerate() {
                for (k, there) in row.iter().enumerate().skip(i) {
                    square[i][k] += both * here * there;
                }
                square[0][i] += falls * odd * here;
                pull[i] += here * (up - down);
            }
            square[0][0] += falls * (odd * row[0] + falls * both);
            pull[0] += falls * (up + down);
        }
        (square, pull)
    }

    /// Along the direction in `right`, as far as slacks, duals and `b` stay above zero.
    fn step(&mut self, mu: f64) {
        let (mut far, mut far_dual) = (1.0_f64, 1.0_f64);
        let direction = std::mem::take(&mut self.right);
        let mut changes = Vec::with_capacity(self.limits.len());
        let mut tops = Vec::with_capacity(self.places.len());
        for place in 0..self.places.len() {
            let jet = self.jet(place, &self.control);
            let by = self.jet(place, &direction);
            far = nearer(far, jet[0], by[0]);
            let top = changed(self.tops[place], jet[0] - self.places[place].fastest, by[0], mu);
            far = nearer(far, self.tops[place].0, top.0);
            far_dual = nearer(far_dual, self.tops[place].1, top.1);
            tops.push(top);
            let bound = 1.0 / jet[0].sqrt();
            let falls = 0.5 * bound / jet[0] * by[0];
            for limit in &self.limits[self.rows(place)] {
                let (most, falls) = if limit.is_jerk { (bound, falls) } else { (1.0, 0.0) };
                let (value, slope) = (dot(&limit.row, &jet), dot(&limit.row, &by));
                let mut change = [(0.0, 0.0); 2];
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let now = (limit.slack[side], limit.dual[side]);
                    change[side] = changed(now, sign * value - most, sign * slope + falls, mu);
                    far = nearer(far, now.0, change[side].0);
                    far_dual = nearer(far_dual, now.1, change[side].1);
                }
                changes.push(change);
            }
        }
        for (at, _, basis) in &self.times {
            let by = dot(basis, &[direction[*at], direction[at + 1], direction[at + 2]]);
            far = nearer(far, self.value(*at, basis), by);
        }
        for (control, by) in self.control.iter_mut().zip(&direction) {
            *control += far * by;
        }
        for (top, by) in self.tops.iter_mut().zip(tops) {
            *top = (top.0 + far * by.0, top.1 + far_dual * by.1);
        }
        for (limit, change) in self.limits.iter_mut().zip(changes) {
            for side in [0, 1] {
                limit.slack[side] += far * change[side].0;
                limit.dual[side] += far_dual * change[side].1;
            }
        }
        self.right = direction;
    }
}

/// Where a bend uses this part of an acceleration at the steady speed, the acceleration matters.
const MATTERS: f64 = 0.2;

/// Whether the jerk leaves the acceleration free within a cell, and that matters: where even the steady speed is above
/// `slow` the cell is too short for it.
fn is_free(way: &Way, middle: f64, slow: f64, wanted: &PathSpeed) -> bool {
    let slopes = way.at(middle);
    let speed = way.steady(&slopes, wanted.speed);
    speed < slow && way.shares(&slopes, &Motion { speed, ..Motion::default() })[1] > MATTERS
}

/// A cell that takes longer than this (s) lets the jerk turn a good part of the acceleration round in it.
fn zigzag_s(way: &Way, wanted: &PathSpeed) -> f64 {
    let [_, acceleration, jerk] = way.per();
    let joints = (0..way.joints()).map(|joint| jerk[joint] / acceleration[joint]);
    0.5 * joints.fold(wanted.acceleration / wanted.jerk, f64::min)
}

/// How much of the last gap the next step aims at.
const CENTRE: f64 = 0.15;

/// The change of slack and dual of one limit whose value is `value` and changes by `by`.
fn changed((slack, dual): (f64, f64), value: f64, by: f64, mu: f64) -> (f64, f64) {
    let slack_by = -(value + slack) - by;
    (slack_by, mu / slack - dual - dual / slack * slack_by)
}

/// The part of a step that keeps `value` above zero.
fn nearer(far: f64, value: f64, by: f64) -> f64 {
    if by < 0.0 { far.min(-CLOSE * value / by) } else { far }
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn outer(row: &[f64; 3], weight: f64) -> [[f64; 3]; 3] {
    row.map(|a| row.map(|b| weight * a * b))
}

/// The square form (its upper half) on `(b, b', b'')` as one on the three unknowns.
fn turned(square: &[[f64; 3]; 3], basis: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let full = |i: usize, k: usize| if i <= k { square[i][k] } else { square[k][i] };
    let mut half = [[0.0; 3]; 3];
    for (i, row) in half.iter_mut().enumerate() {
        for (k, value) in row.iter_mut().enumerate() {
            *value = full(i, 0) * basis[0][k] + full(i, 1) * basis[1][k] + full(i, 2) * basis[2][k];
        }
    }
    let mut block = [[0.0; 3]; 3];
    for (i, row) in block.iter_mut().enumerate() {
        for (k, value) in row.iter_mut().enumerate() {
            *value = basis[0][i] * half[0][k] + basis[1][i] * half[1][k] + basis[2][i] * half[2][k];
        }
    }
    block
}

/// `b`, `b'` and `b''` at `right` into a cell, from its three control points.
pub(super) fn basis(nodes: &[f64], cell: usize, right: f64) -> [[f64; 3]; 3] {
    let last = nodes.len() - 1;
    let (x0, x1) = (nodes[cell], nodes[cell + 1]);
    let (before, after) = (nodes[cell.saturating_sub(1)], nodes[(cell + 2).min(last)]);
    let h = x1 - x0;
    let (left, wide) = (x1 - before, after - x0);
    // Value at the cell's beginning, slope at its beginning and its end.
    let value = [h / left, (x0 - before) / left, 0.0];
    let slope = [-2.0 / left, 2.0 / left, 0.0];
    let ending = [0.0, -2.0 / wide, 2.0 / wide];
    let bend = [0, 1, 2].map(|k| (ending[k] - slope[k]) / h);
    [
        [0, 1, 2].map(|k| value[k] + right * (slope[k] + 0.5 * right * bend[k])),
        [0, 1, 2].map(|k| slope[k] + right * bend[k]),
        bend,
    ]
}
