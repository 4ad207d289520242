//! The piece of the image under a summit: grown from it, measured in the whole image.

use nalgebra::{Matrix2, Vector2};

use super::summits::Summit;

/// A wire's echo is at least so many pixels of the searched image.
const SMALLEST: usize = 5;

/// Which pixels of the searched image were visited, and which belong to the piece.
pub(super) struct Grower {
    width: usize,
    seen: Vec<u32>,
    round: u32,
    longest: [f64; 2],
    /// The piece's pixels.
    piece: Vec<u32>,
}

/// How a piece ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grown {
    /// All around it is darker.
    Whole,
    /// It touches the edge of what is looked at.
    Cut,
    /// It is too small or too long to be a dot.
    NoDot,
}

/// The moments of a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Sum of the weights.
    pub mass: f64,
    /// Their centre (px of the whole image).
    pub centre: Vector2<f64>,
    /// Their second moments about it (px²).
    pub spread: Matrix2<f64>,
    /// How uncertain the centre is by the noise of its pixels (px²).
    pub noise: Matrix2<f64>,
    /// The brightest pixel.
    pub peak: u8,
    /// The largest step from a pixel to its neighbour.
    pub steepest: u8,
    /// The box around it: first and last column and row.
    pub first: [usize; 2],
    /// Its other corner.
    pub last: [usize; 2],
}

impl Grower {
    pub(super) fn new(width: usize, height: usize, longest: [f64; 2]) -> Self {
        Self { width, seen: vec![0; width * height], round: 0, longest, piece: Vec::new() }
    }

    /// Grows the piece of pixels of at least `level` (and inside) around a summit.
    pub(super) fn grow(&mut self, image: &[u8], inside: &[u8], summit: &Summit, level: u8) -> Grown {
        self.next_round();
        self.piece.clear();
        let start = summit.at[1] * self.width + summit.at[0];
        self.seen[start] = self.round;
        self.piece.push(start as u32);
        let (mut next, mut cut) = (0, false);
        while let Some(pixel) = self.piece.get(next).map(|p| *p as usize) {
            next += 1;
            if self.too_far(pixel, summit) {
                return Grown::NoDot;
            }
            for near in around(pixel, self.width, image.len()) {
                match near {
                    Some(near) if inside[near] != 0 => self.visit(image, near, level),
                    _ => cut = true,
                }
            }
        }
        match cut {
            _ if self.piece.len() < SMALLEST => Grown::NoDot,
            true => Grown::Cut,
            false => Grown::Whole,
        }
    }

    /// The floor may have risen under the piece, and hidden how long it is.
    fn too_far(&self, pixel: usize, summit: &Summit) -> bool {
        let at = [pixel % self.width, pixel / self.width];
        (0..2).any(|axis| at[axis].abs_diff(summit.at[axis]) as f64 > self.longest[axis])
    }

    fn visit(&mut self, image: &[u8], pixel: usize, level: u8) {
        if self.seen[pixel] != self.round && image[pixel] >= level {
            self.seen[pixel] = self.round;
            self.piece.push(pixel as u32);
        }
    }

    fn next_round(&mut self) {
        if self.round == u32::MAX {
            self.seen.fill(0);
            self.round = 0;
        }
        self.round += 1;
    }

    /// The moments of the piece's brightness over `base`, in the whole image; `k` of its pixels, each way, are one of
    /// the searched image.
    pub(super) fn moments(&self, whole: &Whole<'_>, k: usize, base: f64) -> Option<Moments> {
        let start = *self.piece.first()? as usize;
        let origin = [start % self.width * k, start / self.width * k];
        let mut sums = Sums::new(origin, base);
        self.each(whole, k, |at| sums.add(whole, at));
        let mut moments = sums.moments()?;
        self.each(whole, k, |at| moments.add_noise(whole, at));
        moments.noise /= moments.mass * moments.mass;
        Some(moments)
    }

    /// Calls `each` with the column and row of every pixel of the whole image in the piece.
    fn each(&self, whole: &Whole<'_>, k: usize, mut each: impl FnMut([usize; 2])) {
        for pixel in &self.piece {
            let (column, row) = (*pixel as usize % self.width * k, *pixel as usize / self.width * k);
            for v in row..(row + k).min(whole.height) {
                (column..(column + k).min(whole.width)).for_each(|u| each([u, v]));
            }
        }
    }
}

/// The whole image.
pub(super) struct Whole<'a> {
    /// Its pixels, row after row.
    pub pixels: &'a [u8],
    /// Its columns.
    pub width: usize,
    /// Its rows.
    pub height: usize,
}

impl Whole<'_> {
    fn at(&self, [u, v]: [usize; 2]) -> u8 {
        self.pixels[v * self.width + u]
    }

    /// The nine pixels around a place, those beyond the edge as the last before it.
    fn around(&self, [u, v]: [usize; 2]) -> [[f64; 3]; 3] {
        let columns = [u.saturating_sub(1), u, (u + 1).min(self.width - 1)];
        let rows = [v.saturating_sub(1), v, (v + 1).min(self.height - 1)];
        rows.map(|v| columns.map(|u| f64::from(self.at([u, v]))))
    }

    /// The larger of the steps to the next column and the next row.
    fn step(&self, [u, v]: [usize; 2]) -> u8 {
        let here = self.at([u, v]);
        let right = self.at([(u + 1).min(self.width - 1), v]);
        here.abs_diff(right).max(here.abs_diff(self.at([u, (v + 1).min(self.height - 1)])))
    }
}

/// The running sums of a piece, about its first pixel: small numbers, nothing is lost.
struct Sums {
    origin: [usize; 2],
    base: f64,
    mass: f64,
    first_moment: Vector2<f64>,
    second_moment: Matrix2<f64>,
    peak: u8,
    steepest: u8,
    first: [usize; 2],
    last: [usize; 2],
}

impl Sums {
    fn new(origin: [usize; 2], base: f64) -> Self {
        let (first_moment, second_moment) = (Vector2::zeros(), Matrix2::zeros());
        let (first, last) = (origin, origin);
        Self { origin, base, mass: 0.0, first_moment, second_moment, peak: 0, steepest: 0, first, last }
    }

    fn add(&mut self, whole: &Whole<'_>, at: [usize; 2]) {
        let pixel = whole.at(at);
        let weight = (f64::from(pixel) - self.base).max(0.0);
        let off = |axis: usize| at[axis] as f64 - self.origin[axis] as f64;
        let off = Vector2::new(off(0), off(1));
        self.mass += weight;
        self.first_moment += off * weight;
        self.second_moment += off * off.transpose() * weight;
        self.peak = self.peak.max(pixel);
        self.steepest = self.steepest.max(whole.step(at));
        self.first = [self.first[0].min(at[0]), self.first[1].min(at[1])];
        self.last = [self.last[0].max(at[0]), self.last[1].max(at[1])];
    }

    fn moments(&self) -> Option<Moments> {
        let Self { mass, peak, steepest, first, last, .. } = *self;
        if mass <= 0.0 {
            return None;
        }
        let off = self.first_moment / mass;
        let spread = self.second_moment / mass - off * off.transpose();
        let centre = Vector2::new(self.origin[0] as f64, self.origin[1] as f64) + off;
        Some(Moments { mass, centre, spread, noise: Matrix2::zeros(), peak, steepest, first, last })
    }
}

impl Moments {
    /// A pixel of standard deviation s, off the centre by x, moves it by x s / mass. The noise is what is left of the
    /// nine pixels around after all that is smooth is taken out: Immerkær, CVIU 64 (1996) 300.
    fn add_noise(&mut self, whole: &Whole<'_>, at: [usize; 2]) {
        let [a, b, c] = whole.around(at).map(|row| row[0] - 2.0 * row[1] + row[2]);
        let rough = (a - 2.0 * b + c) / 6.0;
        let off = Vector2::new(at[0] as f64, at[1] as f64) - self.centre;
        self.noise += off * off.transpose() * rough * rough;
    }
}

/// Left, right, above, below; none beyond the image.
fn around(pixel: usize, width: usize, count: usize) -> [Option<usize>; 4] {
    let column = pixel % width;
    [
        (column > 0).then(|| pixel - 1),
        (column + 1 < width).then_some(pixel + 1),
        pixel.checked_sub(width),
        Some(pixel + width).filter(|below| *below < count),
    ]
}
