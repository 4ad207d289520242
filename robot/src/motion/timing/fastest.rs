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

mod press;

use std::ops::Range;

use super::bands::Bands;
use super::way::{Motion, Way};
use super::{MotionBounds, PathSpeed};
use press::{Change, Limit, Pressed, changed, dot, nearer, outer, turned};

/// A place where the limits are asked.
struct Place {
    /// Index of the first of the three unknowns that matter here.
    at: usize,
    /// `b`, `b'` and `b''` from these three.
    basis: [[f64; 3]; 3],
    /// The largest `b` that the velocities allow.
    fastest: f64,
    /// Where its accelerations begin, and its jerks behind them.
    accelerations: usize,
    jerks: usize,
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
    /// Of every limit, and of every top (slack and dual).
    changes: Vec<Change>,
    top_changes: Vec<(f64, f64)>,
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
            changes: Vec::new(),
            top_changes: Vec::new(),
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
        let fastest = top * top;
        let (most_a, most_j) = (wanted.acceleration / tight.acceleration, wanted.jerk / tight.jerk);
        let joints = || (0..way.joints()).map(|joint| (joint, first[joint], second[joint], third[joint]));
        let accelerations = joints().map(|(joint, q1, q2, _)| {
            let a = acceleration[joint] * tight.acceleration;
            [q2 * a, 0.5 * q1 * a, 0.0]
        });
        let jerks = joints().map(|(joint, q1, q2, q3)| {
            let j = jerk[joint] * tight.jerk;
            [q3 * j, 1.5 * q2 * j, 0.5 * q1 * j]
        });
        let begin = self.limits.len();
        let slope = self.keep([fastest, 0.0, 1.0], 1, accelerations.chain([[0.0, 0.5 / most_a, 0.0]]));
        let middle = self.limits.len();
        let steepest = [fastest * top, slope * top, 1.0];
        self.keep(steepest, 2, jerks.chain([[0.0, 0.0, 0.5 / most_j]]));
        let basis = basis(self.nodes, cell, part * h);
        self.places.push(Place { at: cell, basis, fastest, accelerations: begin, jerks: middle });
    }

    /// Keeps those of a place's limits that can bind: where all others keep the parts of `(b, b', b'')` below what
    /// `most` says, up to the one at `last`, and the strictest of them bounds that, some can never be reached. Gives
    /// that bound.
    fn keep(&mut self, most: [f64; 3], last: usize, rows: impl Iterator<Item = [f64; 3]> + Clone) -> f64 {
        let before = |row: &[f64; 3]| (0..last).map(|k| row[k].abs() * most[k]).sum::<f64>();
        let bound =
            rows.clone().map(|row| (1.0 + before(&row)) / row[last].abs()).fold(f64::INFINITY, f64::min);
        let can_bind = |row: &[f64; 3]| before(row) + row[last].abs() * bound >= REDUNDANT;
        let kept = rows.filter(can_bind).map(|row| Limit { row, slack: [1.0; 2], dual: [1.0; 2] });
        self.limits.extend(kept);
        bound
    }

    /// The accelerations of a place, and its jerks.
    fn rows(&self, place: usize) -> [Range<usize>; 2] {
        let Place { accelerations, jerks, .. } = self.places[place];
        let end = self.places.get(place + 1).map_or(self.limits.len(), |next| next.accelerations);
        [accelerations..jerks, jerks..end]
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
            for (rows, most) in self.rows(place).into_iter().zip([1.0, 1.0 / jet[0].sqrt()]) {
                for limit in &mut self.limits[rows] {
                    let value = dot(&limit.row, &jet);
                    limit.slack = [value, -value].map(|value| (most - value).max(least * most));
                    limit.dual = limit.slack.map(|slack| mu / slack);
                }
            }
        }
        self.changes = vec![Change::default(); self.limits.len()];
        self.top_changes = vec![(0.0, 0.0); self.tops.len()];
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
            for (rows, root) in self.rows(place).into_iter().zip([1.0, jet[0].sqrt()]) {
                let shares = self.limits[rows].iter().map(|limit| dot(&limit.row, &jet).abs() * root);
                worst = shares.fold(worst, |worst, share| worst.max(share - 1.0));
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
    fn pressed(&mut self, place: usize, jet: &[f64; 3], mu: f64) -> ([[f64; 3]; 3], [f64; 3]) {
        let mut square = [[0.0; 3]; 3];
        let mut pull = [0.0; 3];
        let (slack, dual) = self.tops[place];
        let weight = dual / slack;
        square[0][0] += weight;
        pull[0] += mu / slack + weight * (jet[0] - self.places[place].fastest + slack);
        let [accelerations, jerks] = self.rows(place);
        for (limit, change) in self.limits[accelerations.clone()].iter().zip(&mut self.changes[accelerations])
        {
            let pressed = Pressed::by(limit, change, dot(&limit.row, jet), 1.0, mu);
            pressed.on(&limit.row, &mut square, &mut pull);
        }
        let most = 1.0 / jet[0].sqrt();
        let falls = 0.5 * most / jet[0];
        for (limit, change) in self.limits[jerks.clone()].iter().zip(&mut self.changes[jerks]) {
            let (row, pressed) = (&limit.row, Pressed::by(limit, change, dot(&limit.row, jet), most, mu));
            pressed.on(row, &mut square, &mut pull);
            for (i, here) in row.iter().enumerate() {
                square[0][i] += falls * pressed.odd * here;
            }
            square[0][0] += falls * (pressed.odd * row[0] + falls * pressed.both);
            pull[0] += falls * (pressed.up + pressed.down);
        }
        (square, pull)
    }

    /// Along the direction in `right`, as far as slacks, duals and `b` stay above zero.
    fn step(&mut self, mu: f64) {
        let direction = std::mem::take(&mut self.right);
        let (mut far, mut far_dual) = (1.0_f64, 1.0_f64);
        for place in 0..self.places.len() {
            let (jet, by) = (self.jet(place, &self.control), self.jet(place, &direction));
            far = nearer(far, jet[0], by[0]);
            let now = self.tops[place];
            let top = changed(now, 1.0 / now.0, jet[0] - self.places[place].fastest, by[0], mu);
            far = nearer(far, now.0, top.0);
            far_dual = nearer(far_dual, now.1, top.1);
            self.top_changes[place] = top;
            let bound = 1.0 / jet[0].sqrt();
            let kinds = [(1.0, 0.0), (bound, 0.5 * bound / jet[0] * by[0])];
            for (rows, (most, falls)) in self.rows(place).into_iter().zip(kinds) {
                for (limit, change) in self.limits[rows.clone()].iter().zip(&mut self.changes[rows]) {
                    let (value, slope) = (dot(&limit.row, &jet), dot(&limit.row, &by));
                    for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                        let (now, inverse) = ((limit.slack[side], limit.dual[side]), change.slack[side]);
                        let (slack, dual) =
                            changed(now, inverse, sign * value - most, sign * slope + falls, mu);
                        far = nearer(far, now.0, slack);
                        far_dual = nearer(far_dual, now.1, dual);
                        (change.slack[side], change.dual[side]) = (slack, dual);
                    }
                }
            }
        }
        for (at, _, basis) in &self.times {
            let by = dot(basis, &[direction[*at], direction[at + 1], direction[at + 2]]);
            far = nearer(far, self.value(*at, basis), by);
        }
        self.go(far, far_dual, &direction);
        self.right = direction;
    }

    /// So far along the direction, and along what it changes.
    fn go(&mut self, far: f64, far_dual: f64, direction: &[f64]) {
        for (control, by) in self.control.iter_mut().zip(direction) {
            *control += far * by;
        }
        for (top, by) in self.tops.iter_mut().zip(&self.top_changes) {
            *top = (top.0 + far * by.0, top.1 + far_dual * by.1);
        }
        for (limit, change) in self.limits.iter_mut().zip(&self.changes) {
            for side in [0, 1] {
                limit.slack[side] += far * change.slack[side];
                limit.dual[side] += far_dual * change.dual[side];
            }
        }
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

/// A limit that is never used beyond this share by what the others leave is left out.
const REDUNDANT: f64 = 0.999;
/// How much of the last gap the next step aims at.
const CENTRE: f64 = 0.15;

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
