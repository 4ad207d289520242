//! What a border, a wall and their brightness predict for every cell, through the point spread.

use super::lattice::{BINS, Lattice};
use super::steps::Steps;

/// How the prediction changes with the border's radius and the wall's thickness, and the parts of it that wall,
/// tissue and lumen make.
pub(super) const FIELDS: usize = 5;
pub(super) const BY_RADIUS: usize = 0;
pub(super) const BY_THICKNESS: usize = 1;
pub(super) const WALL: usize = 2;
pub(super) const TISSUE: usize = 3;
pub(super) const LUMEN: usize = 4;

/// What is painted, by direction: the border's radius, and the power of wall, tissue and lumen.
pub(super) struct Scene {
    pub(super) radius: [f32; BINS],
    pub(super) wall: [f32; BINS],
    pub(super) tissue: [f32; BINS],
    pub(super) lumen: [f32; BINS],
    pub(super) thickness: f32,
}

/// The five fields over a lattice, and the scratch of their blur.
#[derive(Clone)]
pub(super) struct Fields {
    columns: usize,
    taps: (Vec<f32>, Vec<f32>),
    fields: [Vec<f32>; FIELDS],
    between: Vec<f32>,
}

impl Fields {
    /// For a point spread whose power has these standard deviations (m).
    pub(super) fn new(lattice: &Lattice, sigma: (f64, f64)) -> Self {
        let count = lattice.columns * lattice.rows;
        let taps =
            (taps(sigma.0, lattice.cell.0, lattice.pixel.0), taps(sigma.1, lattice.cell.1, lattice.pixel.1));
        let fields = std::array::from_fn(|_| vec![0.0; count]);
        Self { columns: lattice.columns, taps, fields, between: vec![0.0; count] }
    }

    /// The fields of a row of cells.
    pub(super) fn row(&self, row: usize) -> [&[f32]; FIELDS] {
        let range = row * self.columns..(row + 1) * self.columns;
        std::array::from_fn(|k| &self.fields[k][range.clone()])
    }

    /// Predicts.
    pub(super) fn predict(&mut self, lattice: &Lattice, steps: &Steps, scene: &Scene) {
        self.paint(lattice, steps, scene);
        for field in &mut self.fields {
            blur(field, &mut self.between, self.columns, (&self.taps.0, &self.taps.1));
        }
    }

    /// Multiplies every cell's fields by what `weigh(cell, prediction)` says, and gives them blurred by Gaussians of
    /// these standard deviations (m) as well.
    pub(super) fn weighed_and_smeared(
        &mut self,
        lattice: &Lattice,
        sigma: (f64, f64),
        weigh: impl Fn(usize, f32) -> f32,
    ) -> Self {
        for cell in 0..self.between.len() {
            let predicted = self.fields[WALL][cell] + self.fields[TISSUE][cell] + self.fields[LUMEN][cell];
            let weight = weigh(cell, predicted);
            self.fields.iter_mut().for_each(|field| field[cell] *= weight);
        }
        let mut smeared = Self::new(lattice, sigma);
        for (field, from) in smeared.fields.iter_mut().zip(&self.fields) {
            field.copy_from_slice(from);
            blur(field, &mut smeared.between, self.columns, (&smeared.taps.0, &smeared.taps.1));
        }
        smeared
    }

    fn paint(&mut self, lattice: &Lattice, steps: &Steps, scene: &Scene) {
        let [by_radius, by_thickness, walls, tissues, lumens] = &mut self.fields;
        let cells = lattice.r.iter().zip(&lattice.bin);
        let firsts = by_radius.iter_mut().zip(by_thickness);
        let parts = walls.iter_mut().zip(tissues).zip(lumens);
        for (((r, bin), (by_radius, by_thickness)), ((wall, tissue), lumen)) in cells.zip(firsts).zip(parts) {
            let bin = usize::from(*bin);
            let row = Steps::row(bin);
            let distance = r - scene.radius[bin];
            let (inner, d_inner) = steps.at(row, distance);
            let (outer, d_outer) = steps.at(row, distance - scene.thickness);
            let (bright, beyond, dark) = (scene.wall[bin], scene.tissue[bin], scene.lumen[bin]);
            let by_outer = (bright - beyond) * d_outer;
            *by_radius = by_outer - (bright - dark) * d_inner;
            *by_thickness = by_outer * scene.thickness;
            *wall = bright * (inner - outer);
            *tissue = beyond * outer;
            *lumen = dark * (1.0 - inner);
        }
    }
}

/// Half of a Gaussian of unit sum, its middle first, for cells that are means over whole pixels. Step and cell are
/// already smeared over the cell; only points of the picture are, so that a pixel's own width is taken off.
fn taps(sigma: f64, cell: f64, pixel: f64) -> Vec<f32> {
    let square = (sigma * sigma - pixel * pixel / 12.0).max(0.0) / (cell * cell);
    let sigma = square.sqrt();
    if sigma < 0.2 {
        return vec![1.0];
    }
    // Below about two thirds of a cell a sampled Gaussian is narrower than it says; integrated over cells it is wider
    // by a twelfth, which is taken off first.
    let sigma = (square - 1.0 / 12.0).max(0.02).sqrt();
    let half = (3.2 * sigma + 0.5).ceil() as i32;
    let integral = |k: i32| {
        let edge = |x: f64| normal(x / sigma);
        edge(f64::from(k) + 0.5) - edge(f64::from(k) - 0.5)
    };
    let sum: f64 = (-half..=half).map(integral).sum();
    (0..=half).map(|k| (integral(k) / sum) as f32).collect()
}

/// The normal distribution (Abramowitz and Stegun 26.2.17, good to 1e-7).
fn normal(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x.abs());
    let series = [0.319_381_530, -0.356_563_782, 1.781_477_937, -1.821_255_978, 1.330_274_429];
    let tail = (-x * x / 2.0).exp() / std::f64::consts::TAU.sqrt()
        * series.iter().rev().fold(0.0, |sum, c| (sum + c) * t);
    if x > 0.0 { 1.0 - tail } else { tail }
}

/// Blurs a field in place. Within a kernel's half of the edges it is left as it is: nothing there is looked at.
fn blur(field: &mut [f32], between: &mut [f32], columns: usize, taps: (&[f32], &[f32])) {
    for (line, out) in field.chunks_exact(columns).zip(between.chunks_exact_mut(columns)) {
        smear_line(line, out, taps.0);
    }
    let (rows, half) = (field.len() / columns, taps.1.len() - 1);
    for row in 0..rows {
        let out = &mut field[row * columns..(row + 1) * columns];
        let line = |row: usize| &between[row * columns..(row + 1) * columns];
        if row < half || row + half >= rows {
            out.copy_from_slice(line(row));
            continue;
        }
        out.iter_mut().zip(line(row)).for_each(|(sum, value)| *sum = taps.1[0] * value);
        for (k, tap) in taps.1.iter().enumerate().skip(1) {
            let pair = line(row - k).iter().zip(line(row + k));
            out.iter_mut().zip(pair).for_each(|(sum, (a, b))| *sum += tap * (a + b));
        }
    }
}

fn smear_line(line: &[f32], out: &mut [f32], taps: &[f32]) {
    let (half, n) = (taps.len() - 1, line.len());
    out.copy_from_slice(line);
    if n <= 2 * half {
        return;
    }
    let middle = &mut out[half..n - half];
    middle.iter_mut().for_each(|sum| *sum *= taps[0]);
    for (k, tap) in taps.iter().enumerate().skip(1) {
        let pair = line[half - k..n - half - k].iter().zip(&line[half + k..n - half + k]);
        middle.iter_mut().zip(pair).for_each(|(sum, (a, b))| *sum += tap * (a + b));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_keeps_the_sum_and_its_variance_less_that_of_a_pixel() {
        let (columns, rows) = (61, 51);
        let mut field = vec![0.0; columns * rows];
        field[25 * columns + 30] = 1.0;
        let mut between = field.clone();
        // Cells of three and of one pixel; what a cell's own width adds is in the steps.
        let taps = (taps(0.5, 0.3, 0.1), taps(0.105, 0.125, 0.125));
        blur(&mut field, &mut between, columns, (&taps.0, &taps.1));
        let sum: f32 = field.iter().sum();
        let at = |i: usize| ((i % columns) as f64 - 30.0, (i / columns) as f64 - 25.0);
        let vx: f64 = field.iter().enumerate().map(|(i, v)| f64::from(*v) * at(i).0.powi(2)).sum();
        let vy: f64 = field.iter().enumerate().map(|(i, v)| f64::from(*v) * at(i).1.powi(2)).sum();
        assert!((sum - 1.0).abs() < 1e-5);
        let (x, y) =
            ((0.25 - 0.01 / 12.0) / 0.09, (0.105_f64.powi(2) - 0.125_f64.powi(2) / 12.0) / 0.125_f64.powi(2));
        assert!((vx - x).abs() < 0.03 * x && (vy - y).abs() < 0.03 * y, "{vx} {x}, {vy} {y}");
    }
}
