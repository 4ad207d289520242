//! First guesses: pairs of dots laid on pairs of wires, completed by a third, kept when more wires agree.
//!
//! A plane across the wires shows their cross-section, turned, from the front or from the back, and longer by
//! 1/cos(tilt) in one direction: two dots on two wires fix the turn, a third fixes the stretch.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use super::plane::Match;
use super::seen::Seen;

/// How near a dot has to be to where two others put its wire (m), before the stretch is known.
const LOOSE_M: f64 = 1.0e-3;
/// The same once three fix the stretch.
const TIGHT_M: f64 = 0.9e-3;
/// Dots nearer to each other than this fix no turn (m).
const NEAREST_M: f64 = 3.0e-3;

/// Takes the image's plane to the section: `linear · q + offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lay {
    pub linear: Matrix2<f64>,
    pub offset: Vector2<f64>,
}

/// A guess: the lay, and the dots on the places that made it.
#[derive(Clone, Debug)]
pub(super) struct Guess {
    pub lay: Lay,
    /// Dot and index of the place in the section.
    pub hits: Vec<Match>,
}

/// What a plane may do to distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowed {
    /// The pixel size is right within this (relative).
    pub scale: f64,
    /// Cosine of the steepest tilt.
    pub cosine: f64,
}

/// Places in a section and what is looked up of them again and again.
#[derive(Clone, Debug)]
pub(super) struct Places {
    pub at: Vec<Vector2<f64>>,
    /// Pairs by distance: (distance, first, second).
    pairs: Vec<(f64, usize, usize)>,
    nearest: Raster,
}

impl Places {
    pub fn new(at: Vec<Vector2<f64>>) -> Self {
        let mut pairs = Vec::new();
        for i in 0..at.len() {
            for j in i + 1..at.len() {
                pairs.push(((at[j] - at[i]).norm(), i, j));
            }
        }
        pairs.retain(|p| p.0 > NEAREST_M);
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = Raster::of(&at);
        Self { at, pairs, nearest }
    }

    /// Pairs that may look `seen` apart.
    fn as_long_as(&self, seen: f64, allowed: &Allowed) -> &[(f64, usize, usize)] {
        let (low, high) = (seen * allowed.cosine / (1.0 + allowed.scale), seen * (1.0 + allowed.scale));
        let from = self.pairs.partition_point(|p| p.0 < low);
        let until = self.pairs.partition_point(|p| p.0 <= high);
        &self.pairs[from..until]
    }
}

/// The place nearest to every cell of a grid over the section.
#[derive(Clone, Debug)]
struct Raster {
    low: Vector2<f64>,
    cell: f64,
    size: [usize; 2],
    nearest: Vec<u16>,
}

impl Raster {
    fn of(at: &[Vector2<f64>]) -> Self {
        let margin = Vector2::repeat(6e-3);
        let low = at.iter().fold(Vector2::repeat(f64::INFINITY), |a, b| a.inf(b)) - margin;
        let high = at.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |a, b| a.sup(b)) + margin;
        let span = high - low;
        if at.is_empty() || at.len() > usize::from(u16::MAX) {
            return Self { low: Vector2::zeros(), cell: 1.0, size: [0, 0], nearest: Vec::new() };
        }
        // A millimetre, or what keeps the grid of a phantom of any size within 200 x 200.
        let cell = (span.max() / 200.0).max(1e-3);
        let size = [0, 1].map(|i| (span[i] / cell).ceil() as usize + 1);
        let centre =
            |k: usize| low + Vector2::new((k % size[0]) as f64 + 0.5, (k / size[0]) as f64 + 0.5) * cell;
        let nearest = (0..size[0] * size[1]).map(|k| closest(at, centre(k))).collect();
        Self { low, cell, size, nearest }
    }

    fn look(&self, place: Vector2<f64>) -> Option<usize> {
        let cell = (place - self.low) / self.cell;
        let (x, y) = (cell.x as usize, cell.y as usize);
        let inside = cell.x >= 0.0 && cell.y >= 0.0 && x < self.size[0] && y < self.size[1];
        inside.then(|| usize::from(self.nearest[y * self.size[0] + x]))
    }
}

fn closest(at: &[Vector2<f64>], place: Vector2<f64>) -> u16 {
    let by =
        |i: &usize, j: &usize| (at[*i] - place).norm_squared().total_cmp(&(at[*j] - place).norm_squared());
    (0..at.len()).min_by(by).unwrap_or(0) as u16
}

impl Lay {
    /// From two dots on two places: no stretch across their line; `side` is 1 seen from the front, -1 from the back.
    fn of_two(dots: [Vector2<f64>; 2], places: [Vector2<f64>; 2], across: f64) -> Self {
        let (u, v) = (dots[1] - dots[0], places[1] - places[0]);
        let along = v.norm() / u.norm();
        let (u, v) = (u.normalize(), v.normalize());
        let turned = |w: Vector2<f64>| Vector2::new(-w.y, w.x);
        let linear = v * u.transpose() * along + turned(v) * turned(u).transpose() * across;
        Self { linear, offset: places[0] - linear * dots[0] }
    }

    /// The affine map that fits dots to places best; `None` when they lie on a line.
    fn fitted(pairs: impl Iterator<Item = (Vector2<f64>, Vector2<f64>)>) -> Option<Self> {
        let (mut square, mut column) = (Matrix3::zeros(), Matrix3x2::zeros());
        for (q, c) in pairs {
            let q = Vector3::new(q.x * 100.0, q.y * 100.0, 1.0);
            square += q * q.transpose();
            column += q * c.transpose();
        }
        let solved = square.try_inverse()? * column;
        let linear = solved.fixed_rows::<2>(0).transpose() * 100.0;
        linear.iter().all(|x| x.is_finite()).then(|| Self { linear, offset: solved.row(2).transpose() })
    }

    pub fn place(&self, q: Vector2<f64>) -> Vector2<f64> {
        self.linear * q + self.offset
    }

    /// Longest and shortest of what it makes of a unit vector.
    pub fn stretches(&self) -> (f64, f64) {
        let (sum, det) = (self.linear.norm_squared(), self.linear.determinant());
        let root = (sum * sum - 4.0 * det * det).max(0.0).sqrt();
        (((sum + root) / 2.0).sqrt(), ((sum - root) / 2.0).max(0.0).sqrt())
    }

    fn is_allowed(&self, allowed: &Allowed) -> bool {
        let (long, short) = self.stretches();
        long < 1.03 + allowed.scale && long > 0.97 - allowed.scale && short > (allowed.cosine - 0.04) * long
    }

    /// The direction in the image along which it shortens most, and the sine of the tilt that does so.
    pub fn tilt(&self) -> (Vector2<f64>, f64) {
        let (long, short) = self.stretches();
        let m = self.linear.transpose() * self.linear;
        let angle = (2.0 * m[(0, 1)]).atan2(m[(0, 0)] - m[(1, 1)]) / 2.0 + FRAC_PI_2;
        let sine = (1.0 - (short / long.max(1e-9)).powi(2)).max(0.0).sqrt();
        (Vector2::new(angle.cos(), angle.sin()), sine)
    }
}

/// The search for guesses among the dots of one image.
pub(super) struct Search<'a> {
    pub places: &'a Places,
    pub seen: &'a [Seen],
    pub allowed: Allowed,
    /// A guess has at least this many hits.
    pub least: usize,
    /// Guesses so far, and the most hits of any.
    pub guesses: Vec<Guess>,
    pub most: usize,
}

impl Search<'_> {
    /// Looks at every pair of dots on every pair of places that may be theirs, from both sides.
    pub fn run(&mut self) {
        for i in 0..self.seen.len() {
            for j in i + 1..self.seen.len() {
                let apart = (self.seen[j].at - self.seen[i].at).norm();
                if apart < NEAREST_M {
                    continue;
                }
                let places = self.places;
                for &(_, k, l) in places.as_long_as(apart, &self.allowed) {
                    for (k, l) in [(k, l), (l, k)] {
                        self.pair([(i, k), (j, l)], 1.0);
                        self.pair([(i, k), (j, l)], -1.0);
                    }
                }
            }
        }
    }

    /// Enough hits to be worth a look: one less than the best, for twins that lost a dot.
    fn wanted(&self) -> usize {
        self.least.max(self.most.saturating_sub(1))
    }

    fn known(&self, matches: &[Match], side: f64) -> bool {
        let same =
            |g: &Guess| g.lay.linear.determinant() * side > 0.0 && matches.iter().all(|m| g.hits.contains(m));
        self.guesses.iter().any(same)
    }

    fn pair(&mut self, pair: [Match; 2], side: f64) {
        let dots = pair.map(|m| self.seen[m.0].at);
        let across = side * (1.0 + self.allowed.cosine) / 2.0;
        let lay = Lay::of_two(dots, pair.map(|m| self.places.at[m.1]), across);
        let Some(thirds) = self.loose(&lay, dots, pair) else { return };
        let mut tried = 0;
        for third in thirds {
            if tried < 6 && !self.known(&[pair[0], pair[1], third], side) {
                tried += 1;
                self.triple([pair[0], pair[1], third], side);
            }
        }
        if tried == 0 {
            self.line(pair, side);
        }
    }

    /// Hits while the stretch across the pair is unknown, those that fix it best first; `None` when too few places
    /// are hit.
    fn loose(&self, lay: &Lay, dots: [Vector2<f64>; 2], pair: [Match; 2]) -> Option<Vec<Match>> {
        let wanted = self.wanted();
        let middle = (dots[0] + dots[1]) / 2.0;
        let length = (dots[1] - dots[0]).norm();
        let along = (dots[1] - dots[0]) / length;
        let slack = (1.0 - self.allowed.cosine) / 2.0 + self.allowed.scale;
        let mut places = (1u128 << (pair[0].1 % 128)) | (1u128 << (pair[1].1 % 128));
        let mut hits: Vec<(f64, Match)> = Vec::new();
        for (dot, s) in self.seen.iter().enumerate() {
            if (places.count_ones() as usize) + self.seen.len() - dot < wanted {
                return None;
            }
            let off = s.at - middle;
            let (on, beside) = (off.dot(&along), along.perp(&off).abs());
            let Some(place) = self.places.nearest.look(lay.place(s.at)) else { continue };
            let miss = (lay.place(s.at) - self.places.at[place]).norm();
            let far = LOOSE_M * (0.5 + on.abs() / length) + slack * beside;
            if dot != pair[0].0 && dot != pair[1].0 && place != pair[0].1 && place != pair[1].1 && miss < far
            {
                places |= 1u128 << (place % 128);
                hits.push((-beside, (dot, place)));
            }
        }
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let apart = hits.into_iter().filter(|h| h.0 < -NEAREST_M).map(|h| h.1).collect();
        (places.count_ones() as usize >= wanted).then_some(apart)
    }

    fn triple(&mut self, matches: [Match; 3], side: f64) {
        let pairs = matches.map(|m| (self.seen[m.0].at, self.places.at[m.1]));
        let Some(lay) = Lay::fitted(pairs.into_iter()) else { return };
        if lay.linear.determinant() * side > 0.0 && lay.is_allowed(&self.allowed) {
            self.keep(lay);
        }
    }

    /// All hits lie on the pair's line (one row of wires): the stretch across it stays what it is.
    fn line(&mut self, pair: [Match; 2], side: f64) {
        if self.known(&pair, side) {
            return;
        }
        let dots = pair.map(|m| self.seen[m.0].at);
        let lay = Lay::of_two(dots, pair.map(|m| self.places.at[m.1]), side);
        let hits = self.tight(&lay);
        if hits.len() >= self.wanted() {
            self.most = self.most.max(hits.len());
            self.guesses.push(Guess { lay, hits });
        }
    }

    fn keep(&mut self, lay: Lay) {
        let hits = self.tight(&lay);
        if hits.len() < self.wanted() {
            return;
        }
        let pairs = hits.iter().map(|m| (self.seen[m.0].at, self.places.at[m.1]));
        let Some(lay) = Lay::fitted(pairs).filter(|l| l.is_allowed(&self.allowed)) else { return };
        let hits = self.tight(&lay);
        if hits.len() >= self.wanted() && !self.guesses.iter().any(|g| g.hits == hits) {
            self.most = self.most.max(hits.len());
            self.guesses.push(Guess { lay, hits });
        }
    }

    /// The nearest dot of every place, in the order of the places.
    fn tight(&self, lay: &Lay) -> Vec<Match> {
        let mut best: Vec<(usize, f64, usize)> = Vec::with_capacity(16);
        for (dot, s) in self.seen.iter().enumerate() {
            let at = lay.place(s.at);
            let Some(place) = self.places.nearest.look(at) else { continue };
            let miss = (at - self.places.at[place]).norm();
            if miss > TIGHT_M {
                continue;
            }
            match best.iter_mut().find(|b| b.0 == place) {
                Some(b) if miss < b.1 => *b = (place, miss, dot),
                Some(_) => {}
                None => best.push((place, miss, dot)),
            }
        }
        best.sort_by_key(|b| b.0);
        best.into_iter().map(|b| (b.2, b.0)).collect()
    }
}
