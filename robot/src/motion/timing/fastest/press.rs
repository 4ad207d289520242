//! How limits press on the speed: what each adds to Newton's system, and how its slack and dual change.

/// One limit, either way: `|row . (b, b', b'')| <= 1`, or `<= 1 / sqrt(b)` for a jerk.
#[derive(Clone, Copy)]
pub(super) struct Limit {
    pub(super) row: [f64; 3],
    pub(super) slack: [f64; 2],
    pub(super) dual: [f64; 2],
}

/// What a step finds out about one limit: first `1 / slack` of both sides, then the changes of slacks and duals.
#[derive(Clone, Copy, Default)]
pub(super) struct Change {
    pub(super) slack: [f64; 2],
    pub(super) dual: [f64; 2],
}

/// Part of the way to the nearest bound that a step takes.
const CLOSE: f64 = 0.99;

/// How a limit presses from both sides.
pub(super) struct Pressed {
    pub(super) up: f64,
    pub(super) down: f64,
    pub(super) both: f64,
    pub(super) odd: f64,
}

impl Pressed {
    /// By a limit whose value is `value` of at most `most`; remembers what `1 / slack` is.
    pub(super) fn by(limit: &Limit, change: &mut Change, value: f64, most: f64, mu: f64) -> Self {
        change.slack = limit.slack.map(f64::recip);
        let weights = [limit.dual[0] * change.slack[0], limit.dual[1] * change.slack[1]];
        let force = |side: usize, value: f64| {
            mu * change.slack[side] + weights[side] * (value - most + limit.slack[side])
        };
        let (both, odd) = (weights[0] + weights[1], weights[0] - weights[1]);
        Self { up: force(0, value), down: force(1, -value), both, odd }
    }

    pub(super) fn on(&self, row: &[f64; 3], square: &mut [[f64; 3]; 3], pull: &mut [f64; 3]) {
        for (i, here) in row.iter().enumerate() {
            for (k, there) in row.iter().enumerate().skip(i) {
                square[i][k] += self.both * here * there;
            }
            pull[i] += here * (self.up - self.down);
        }
    }
}

/// The change of slack and dual of one limit whose value is `value` and changes by `by`.
pub(super) fn changed((slack, dual): (f64, f64), inverse: f64, value: f64, by: f64, mu: f64) -> (f64, f64) {
    let slack_by = -(value + slack) - by;
    (slack_by, (mu - dual * slack_by) * inverse - dual)
}

/// The part of a step that keeps `value` above zero.
pub(super) fn nearer(far: f64, value: f64, by: f64) -> f64 {
    // A division is asked for seldom.
    if far * by < -CLOSE * value { -CLOSE * value / by } else { far }
}

pub(super) fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn outer(row: &[f64; 3], weight: f64) -> [[f64; 3]; 3] {
    row.map(|a| row.map(|b| weight * a * b))
}

/// The square form (its upper half) on `(b, b', b'')` as one on the three unknowns.
pub(super) fn turned(square: &[[f64; 3]; 3], basis: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
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
