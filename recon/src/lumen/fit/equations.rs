//! The normal equations of the fit, summed direction by direction: within one, every unknown is a factor of a few fields.

use nalgebra::{SMatrix, SVector};

use super::fields::{BY_RADIUS, FIELDS, Fields, LUMEN, TISSUE, WALL};
use super::lattice::{BINS, Lattice};
use super::{BORDER, SHADE};

/// Where the unknowns of each field begin, and how many there are: harmonics, the first ones of the same row.
pub(super) const SPANS: [(usize, usize); FIELDS] = [
    (0, BORDER),
    (BORDER + 2 * SHADE + 1, 1),
    (BORDER, SHADE),
    (BORDER + SHADE, SHADE),
    (BORDER + 2 * SHADE, 1),
];
pub(super) const UNKNOWNS: usize = BORDER + 2 * SHADE + 2;

pub(super) type Matrix = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
pub(super) type Vector = SVector<f64, UNKNOWNS>;

/// Directions that are summed apart.
pub(super) const SECTORS: usize = 48;
pub(super) const BINS_A_SECTOR: usize = BINS / SECTORS;
const PAIRS: usize = FIELDS * (FIELDS + 1) / 2;
/// An echo this much brighter than predicted (in standard deviations) says no more than that it is bright.
const BRIGHTEST: f32 = 6.0;

/// Sums over the cells of one sector.
#[derive(Clone, Copy)]
struct Sum {
    products: [f32; PAIRS],
    gradient: [f32; FIELDS],
}

/// How the cells are weighed.
pub(super) struct Weights {
    /// Independent speckles in a cell.
    pub(super) speckles: f64,
    /// Added to the prediction where it is asked how far off an echo is: deep in the lumen the prediction rests on the
    /// point spread's far tails.
    pub(super) floor: f32,
    /// How far each direction is trusted.
    pub(super) trust: [f32; BINS],
}

/// What a residual is made of.
#[derive(Clone, Copy)]
pub(super) enum Residual<'a> {
    /// Echo against prediction.
    Echo,
    /// What the prediction would change if the point spread were wider by a part of itself along x or y: that part,
    /// times the square of its power's standard deviation in cells.
    Wider { x: f32, y: f32 },
    /// What it would change if the border were smeared along its normal, in each direction by the matrix (xx, xy, yy,
    /// in cells) of half the variance.
    Smeared(&'a [[f32; 3]; BINS]),
}

/// Matrix and right side, the sectors' gains eliminated.
pub(super) fn equations(
    lattice: &Lattice,
    fields: &Fields,
    weights: &Weights,
    gains: &Gains,
    residual: Residual<'_>,
) -> (Matrix, Vector, GainStep) {
    let mut sums = [Sum { products: [0.0; PAIRS], gradient: [0.0; FIELDS] }; SECTORS];
    for row in 1..lattice.rows.saturating_sub(1) {
        add_row(&mut sums, lattice, fields, weights, residual, row);
    }
    let (mut matrix, mut right) = expand(&sums, weights.speckles);
    let gains = gains.eliminated(&sums, weights.speckles, &mut matrix, &mut right);
    (matrix, right, gains)
}

/// How much brighter than the rest a sector is (logarithms of power): a shadow's edge is sharper than the few harmonics
/// of the wall's brightness. Near zero unless the sector says otherwise (Student's distribution).
#[derive(Clone, Debug)]
pub(super) struct Gains([f64; SECTORS]);

/// A gain's usual size, and how many degrees of freedom its distribution has.
const GAIN_SD: f64 = 0.25;
const FREEDOM: f64 = 2.0;

/// A gain that was eliminated: what it becomes when the other unknowns are known.
#[derive(Clone, Copy)]
struct Eliminated {
    coupling: Vector,
    inverse: f64,
    gradient: f64,
}

/// The gains' part of the equations.
pub(super) struct GainStep([Eliminated; SECTORS]);

impl Gains {
    pub(super) const NONE: Self = Self([0.0; SECTORS]);

    /// The factor of the power in a bin.
    pub(super) fn factor(&self, bin: usize) -> f64 {
        self.0[bin / BINS_A_SECTOR].exp()
    }

    /// Follows a step of the other unknowns.
    pub(super) fn follow(&mut self, step: &Vector, gains: &GainStep) {
        for (gain, by) in self.0.iter_mut().zip(&gains.0) {
            *gain += (by.inverse * (by.gradient - by.coupling.dot(step))).clamp(-1.0, 1.0);
        }
    }

    fn eliminated(
        &self,
        sums: &[Sum; SECTORS],
        speckles: f64,
        matrix: &mut Matrix,
        right: &mut Vector,
    ) -> GainStep {
        GainStep(std::array::from_fn(|sector| {
            let (gain, sum) = (self.0[sector], &sums[sector]);
            // The power as a whole is the sum of what wall, tissue and lumen make.
            let total = |a: usize| [WALL, TISSUE, LUMEN].iter().map(|&b| sum.product(a, b)).sum::<f64>();
            let basis = sector_basis(sector);
            let mut coupling = Vector::zeros();
            for (a, (from, count)) in SPANS.into_iter().enumerate() {
                let product = speckles * total(a);
                (0..count).for_each(|i| coupling[from + i] = product * basis[i]);
            }
            let prior = (FREEDOM + 1.0) / (FREEDOM * GAIN_SD * GAIN_SD + gain * gain);
            let parts = [WALL, TISSUE, LUMEN];
            let own: f64 = parts.iter().map(|&a| total(a)).sum();
            let pull: f64 = parts.iter().map(|&a| f64::from(sum.gradient[a])).sum();
            let (inverse, gradient) = (1.0 / (speckles * own + prior), speckles * pull - prior * gain);
            matrix.ger(-inverse, &coupling, &coupling, 1.0);
            right.axpy(-inverse * gradient, &coupling, 1.0);
            Eliminated { coupling, inverse, gradient }
        }))
    }
}

impl Sum {
    fn product(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (a.max(b), a.min(b));
        f64::from(self.products[a * (a + 1) / 2 + b])
    }
}

fn sector_basis(sector: usize) -> [f64; BORDER] {
    super::basis::<BORDER>((sector as f64 + 0.5) * std::f64::consts::TAU / SECTORS as f64)
}

/// Covariance of the right side: what speckle does to it. Speckle is correlated over the point spread, and as strong as
/// the prediction, not as the prediction with the floor. Takes the fields apart for it.
pub(super) fn noise(lattice: &Lattice, fields: &mut Fields, weights: &Weights, sigma: (f64, f64)) -> Matrix {
    let weigh = |cell: usize, predicted: f32| {
        let inverse = 1.0 / (predicted + weights.floor);
        lattice.used[cell] * weights.trust[usize::from(lattice.bin[cell])] * predicted * inverse * inverse
    };
    let smeared = fields.weighed_and_smeared(lattice, sigma, weigh);
    let mut sums = [Sum { products: [0.0; PAIRS], gradient: [0.0; FIELDS] }; SECTORS];
    for row in 0..lattice.rows {
        let (plain, smeared) = (fields.row(row), smeared.row(row));
        for column in 0..lattice.columns {
            let cell = row * lattice.columns + column;
            if lattice.used[cell] <= 0.0 {
                continue;
            }
            let sum = &mut sums[usize::from(lattice.bin[cell]) / BINS_A_SECTOR];
            let mut pair = 0;
            for a in 0..FIELDS {
                for b in 0..=a {
                    let both = plain[a][column] * smeared[b][column] + plain[b][column] * smeared[a][column];
                    sum.products[pair] += 0.5 * both;
                    pair += 1;
                }
            }
        }
    }
    expand(&sums, weights.speckles).0
}

/// Mean square of the residuals over what speckle lets expect, each cell counted as far as its direction is trusted.
pub(super) fn misfit(lattice: &Lattice, fields: &Fields, weights: &Weights) -> f64 {
    let (mut sum, mut expected) = (0.0_f32, 1e-9_f32);
    for row in 0..lattice.rows {
        let parts = fields.row(row);
        let cells = row * lattice.columns..(row + 1) * lattice.columns;
        for (column, cell) in cells.enumerate() {
            let trust = lattice.used[cell] * weights.trust[usize::from(lattice.bin[cell])];
            let predicted = parts[LUMEN][column] + parts[WALL][column] + parts[TISSUE][column];
            let sd = predicted + weights.floor;
            let off = ((lattice.power[cell] - predicted) / sd).min(BRIGHTEST);
            (sum, expected) = (sum + trust * off * off, expected + trust * (predicted / sd).powi(2));
        }
    }
    f64::from(sum / expected)
}

fn add_row(
    sums: &mut [Sum; SECTORS],
    lattice: &Lattice,
    fields: &Fields,
    weights: &Weights,
    residual: Residual<'_>,
    row: usize,
) {
    let (above, here, below) = (fields.row(row - 1), fields.row(row), fields.row(row + 1));
    let total = |of: &[&[f32]; FIELDS], i: usize| of[LUMEN][i] + of[WALL][i] + of[TISSUE][i];
    let start = row * lattice.columns;
    for column in 1..lattice.columns - 1 {
        let cell = start + column;
        if lattice.used[cell] <= 0.0 {
            continue;
        }
        let bin = usize::from(lattice.bin[cell]);
        let predicted = total(&here, column);
        let inverse = 1.0 / (predicted + weights.floor);
        let off = match residual {
            Residual::Echo => ((lattice.power[cell] - predicted) * inverse).min(BRIGHTEST),
            Residual::Wider { x, y } => {
                let along = total(&here, column - 1) + total(&here, column + 1) - 2.0 * predicted;
                let down = total(&above, column) + total(&below, column) - 2.0 * predicted;
                (x * along + y * down) * inverse
            }
            Residual::Smeared(by) => {
                let [xx, xy, yy] = by[bin];
                let along = total(&here, column - 1) + total(&here, column + 1) - 2.0 * predicted;
                let down = total(&above, column) + total(&below, column) - 2.0 * predicted;
                let turned = total(&below, column + 1) + total(&above, column - 1)
                    - total(&below, column - 1)
                    - total(&above, column + 1);
                (xx * along + yy * down + 0.5 * xy * turned) * inverse
            }
        };
        let trust = weights.trust[bin];
        let sum = &mut sums[bin / BINS_A_SECTOR];
        let values: [f32; FIELDS] = std::array::from_fn(|k| here[k][column] * inverse);
        let mut pair = 0;
        for (a, value) in values.iter().enumerate() {
            let weighed = trust * value;
            sum.gradient[a] += weighed * off;
            for other in &values[..=a] {
                sum.products[pair] += weighed * other;
                pair += 1;
            }
        }
    }
}

/// From fields to unknowns.
fn expand(sums: &[Sum; SECTORS], speckles: f64) -> (Matrix, Vector) {
    let (mut matrix, mut right) = (Matrix::zeros(), Vector::zeros());
    for (sector, sum) in sums.iter().enumerate() {
        let basis = sector_basis(sector);
        let mut pair = 0;
        for (a, (from_a, count_a)) in SPANS.into_iter().enumerate() {
            let gradient = speckles * f64::from(sum.gradient[a]);
            (0..count_a).for_each(|i| right[from_a + i] += gradient * basis[i]);
            for (from_b, count_b) in SPANS.into_iter().take(a + 1) {
                let product = speckles * f64::from(sum.products[pair]);
                pair += 1;
                for i in 0..count_a {
                    let scaled = product * basis[i];
                    (0..count_b).for_each(|j| matrix[(from_a + i, from_b + j)] += scaled * basis[j]);
                }
            }
        }
    }
    // Each pair of different fields was summed on one side only.
    for a in 0..UNKNOWNS {
        for b in 0..a {
            let sum = if of_one_field(a, b) { matrix[(a, b)] } else { matrix[(a, b)] + matrix[(b, a)] };
            (matrix[(a, b)], matrix[(b, a)]) = (sum, sum);
        }
    }
    (matrix, right)
}

fn of_one_field(a: usize, b: usize) -> bool {
    SPANS.iter().any(|&(from, count)| (from..from + count).contains(&a) && (from..from + count).contains(&b))
}

/// Where the border's unknowns are.
pub(super) const RADIUS: usize = SPANS[BY_RADIUS].0;
