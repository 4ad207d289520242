//! The piece of the image under a summit: grown from it, measured in the whole image.

use nalgebra::{Matrix2, Vector2};

use super::summits::Summit;

/// Which pixels of the searched image were visited, and which belong to the piece.
pub(super) struct Grower {
    width: usize,
    seen: Vec<u32>,
    round: u32,
    /// The piece's pixels.
    pub piece: Vec<u32>,
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
    /// The brightest pixel.
    pub peak: u8,
}

impl Grower {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, seen: vec![0; width * height], round: 0, piece: Vec::new() }
    }

    /// Grows the piece of pixels of at least `level` (and inside) around a summit; whether it was cut by an edge.
    pub(super) fn grow(&mut self, image: &[u8], inside: &[u8], summit: &Summit, level: u8) -> bool {
        self.next_round();
        self.piece.clear();
        let start = summit.at[1] * self.width + summit.at[0];
        self.seen[start] = self.round;
        self.piece.push(start as u32);
        let (mut next, mut cut) = (0, false);
        while let Some(pixel) = self.piece.get(next).map(|p| *p as usize) {
            next += 1;
            for near in around(pixel, self.width, image.len()) {
                match near {
                    Some(near) if inside[near] != 0 => self.visit(image, near, level),
                    _ => cut = true,
                }
            }
        }
        cut
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

    /// Calls `each` with the column and row of every pixel of the whole image in the piece.
    pub(super) fn each(&self, k: usize, size: [usize; 2], mut each: impl FnMut(usize, usize)) {
        for pixel in &self.piece {
            let (column, row) = (*pixel as usize % self.width * k, *pixel as usize / self.width * k);
            for v in row..(row + k).min(size[1]) {
                for u in column..(column + k).min(size[0]) {
                    each(u, v);
                }
            }
        }
    }

    /// The moments of the piece's brightness over `base`, in the whole image.
    pub(super) fn moments(&self, pixels: &[u8], k: usize, size: [usize; 2], base: f64) -> Option<Moments> {
        let (mut mass, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
        let mut peak = 0;
        let origin =
            self.piece.first().map(|p| (*p as usize % self.width * k, *p as usize / self.width * k))?;
        self.each(k, size, |u, v| {
            let pixel = pixels[v * size[0] + u];
            let weight = (f64::from(pixel) - base).max(0.0);
            let at = Vector2::new(u as f64 - origin.0 as f64, v as f64 - origin.1 as f64);
            (mass, first, second) =
                (mass + weight, first + at * weight, second + at * at.transpose() * weight);
            peak = pixel.max(peak);
        });
        if mass <= 0.0 {
            return None;
        }
        let centre = first / mass;
        let spread = second / mass - centre * centre.transpose();
        let centre = centre + Vector2::new(origin.0 as f64, origin.1 as f64);
        Some(Moments { mass, centre, spread, peak })
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
