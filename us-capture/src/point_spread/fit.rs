//! From the shapes of many dots to widths by depth: robust least squares on the variances.

use std::collections::BTreeMap;

use nalgebra::{SMatrix, SVector, Vector2};

/// Axial; lateral width, waist, depth of field; elevational width, waist, depth of field.
const UNKNOWNS: usize = 7;
type Vector = SVector<f64, UNKNOWNS>;
type Matrix = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// How far off the setting's model may be, one standard deviation: logarithms, and depths (m). Where the dots say
/// nothing the model holds.
const PRIOR_SD: [f64; UNKNOWNS] = [1.0, 1.0, 10e-3, 0.5, 0.5, 8e-3, 0.4];
/// Steps of the fit; in the first ones far dots still pull.
const STEPS: usize = 30;
const GENTLE_STEPS: usize = 8;
/// Where Huber's weights begin to fall, and Tukey's have fallen to zero, in standard deviations.
const HUBER: f64 = 2.0;
const TUKEY: f64 = 4.7;
/// A standard deviation is this many median deviations.
const OF_MEDIAN: f64 = 1.4826;

/// The shape of one dot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Which wire made it: its dots share errors.
    pub(super) wire: usize,
    /// How deep it lies under the face (m).
    pub(super) depth: f64,
    /// How far its wire runs along x and y for each metre across the plane.
    pub(super) slope: Vector2<f64>,
    /// Variance along x, along y, and covariance (m²).
    pub(super) shape: [f64; 3],
}

/// Standard deviations of the amplitude (m) and how they go with depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Widths {
    pub(super) axial: f64,
    pub(super) lateral: Waist,
    pub(super) elevational: Waist,
}

/// A width that is narrowest at a depth: `width sqrt(1 + ((z - at) / length)^2)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Waist {
    pub(super) width: f64,
    pub(super) at: f64,
    pub(super) length: f64,
}

/// What the dots say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) widths: Widths,
    /// Standard errors of axial, lateral and elevational width, as parts of themselves.
    pub(super) sd: [f64; 3],
}

impl Waist {
    fn variance(&self, depth: f64) -> f64 {
        self.width.powi(2) * (1.0 + ((depth - self.at) / self.length).powi(2))
    }
}

impl Widths {
    fn unknowns(&self) -> Vector {
        let Self { axial, lateral, elevational } = self;
        let waist = |waist: &Waist| [waist.width.ln(), waist.at, waist.length.ln()];
        let ([a, b, c], [d, e, f]) = (waist(lateral), waist(elevational));
        Vector::from([axial.ln(), a, b, c, d, e, f])
    }

    fn of(x: &Vector) -> Self {
        let waist = |k: usize| Waist { width: x[k].exp(), at: x[k + 1], length: x[k + 2].exp() };
        Self { axial: x[0].exp(), lateral: waist(1), elevational: waist(4) }
    }

    /// Variance along x, along y, and covariance of a dot (m²): the beam's thickness smears an oblique wire.
    fn shape(&self, seen: &Seen) -> [f64; 3] {
        let thick = self.elevational.variance(seen.depth);
        let (x, y) = (seen.slope.x, seen.slope.y);
        [self.lateral.variance(seen.depth) + x * x * thick, self.axial.powi(2) + y * y * thick, x * y * thick]
    }

    /// By how much of itself every number of a shape is off.
    fn off(&self, seen: &Seen) -> [f64; 3] {
        let (ours, size) = (self.shape(seen), self.size(seen));
        std::array::from_fn(|k| (seen.shape[k] - ours[k]) / size[k])
    }

    fn size(&self, seen: &Seen) -> [f64; 3] {
        let [x, y, _] = self.shape(seen);
        [x, y, (x * y).sqrt()]
    }

    /// Derivatives of the three numbers, as parts of their size, by the unknowns.
    fn slopes(&self, seen: &Seen) -> [Vector; 3] {
        let (x, size) = (self.unknowns(), self.size(seen));
        let mut slopes = [Vector::zeros(); 3];
        for k in 0..UNKNOWNS {
            let step = if k == 2 || k == 5 { 1e-6 } else { 1e-5 };
            let moved = |by: f64| {
                let mut x = x;
                x[k] += by;
                Self::of(&x).shape(seen)
            };
            let (up, down) = (moved(step), moved(-step));
            for (i, slope) in slopes.iter_mut().enumerate() {
                slope[k] = (up[i] - down[i]) / (2.0 * step * size[i]);
            }
        }
        slopes
    }
}

/// Fits the widths, from what the setting's model has. Nothing when the numbers lead nowhere.
pub(super) fn fit(seen: &[Seen], model: &Widths) -> Option<Found> {
    let prior = model.unknowns();
    let mut x = prior;
    let information = Matrix::from_diagonal(&Vector::from(PRIOR_SD.map(|sd| sd.powi(-2))));
    for step in 0..STEPS {
        let sums = Sums::of(seen, &Widths::of(&x), step < GENTLE_STEPS);
        let gradient = sums.gradient + information * (prior - x);
        let by = (sums.matrix + information).cholesky()?.solve(&gradient);
        // No more than a third at once, and 3 mm.
        let most = by.iter().enumerate().map(|(k, by)| by.abs() / if k == 2 || k == 5 { 3e-3 } else { 0.3 });
        x += by / most.fold(1.0, f64::max);
    }
    let widths = Widths::of(&x);
    let sums = Sums::of(seen, &widths, false);
    // Dots of one wire lie on the same unevenness: their errors are added up before they are squared.
    let inverse = (sums.matrix + information).cholesky()?.inverse();
    let covariance = inverse * (sums.by_wire + information) * inverse;
    let sd = [0, 1, 4].map(|k| covariance[(k, k)].max(0.0).sqrt());
    let sound = x.iter().chain(&sd).all(|number| number.is_finite());
    sound.then_some(Found { widths, sd })
}

struct Sums {
    matrix: Matrix,
    gradient: Vector,
    by_wire: Matrix,
}

impl Sums {
    fn of(seen: &[Seen], widths: &Widths, gentle: bool) -> Self {
        let offs: Vec<[f64; 3]> = seen.iter().map(|seen| widths.off(seen)).collect();
        let scale = scale(&offs);
        let (mut matrix, mut gradient) = (Matrix::zeros(), Vector::zeros());
        let mut wires: BTreeMap<usize, Vector> = BTreeMap::new();
        for (seen, off) in seen.iter().zip(&offs) {
            let of_wire = wires.entry(seen.wire).or_insert_with(Vector::zeros);
            for ((slope, off), scale) in widths.slopes(seen).iter().zip(off).zip(scale) {
                let weight = weight(off / scale, gentle) / (scale * scale);
                matrix += slope * slope.transpose() * weight;
                gradient += slope * (weight * off);
                *of_wire += slope * (weight * off);
            }
        }
        let by_wire = wires.values().map(|sum| sum * sum.transpose()).sum();
        Self { matrix, gradient, by_wire }
    }
}

fn weight(off: f64, gentle: bool) -> f64 {
    if gentle {
        return (HUBER / off.abs().max(HUBER)).min(1.0);
    }
    (1.0 - (off / TUKEY).powi(2)).max(0.0).powi(2)
}

/// How far the three numbers usually are off.
fn scale(offs: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let mut sizes: Vec<f64> = offs.iter().map(|off| off[k].abs()).collect();
        sizes.sort_by(f64::total_cmp);
        (OF_MEDIAN * sizes.get(sizes.len() / 2).copied().unwrap_or(1.0)).max(1e-3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: Widths = Widths {
        axial: 0.15e-3,
        lateral: Waist { width: 0.4e-3, at: 35e-3, length: 14e-3 },
        elevational: Waist { width: 1.3e-3, at: 30e-3, length: 28e-3 },
    };

    /// Numbers that look random, the same every time (splitmix64), uniform in -1 to 1.
    fn dice(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn widths_come_back_from_rough_shapes_a_tenth_of_which_are_wrong() {
        for seed in 1..=40 {
            let mut dice = dice(seed);
            let mut factor = |size: f64| (size * dice()).exp();
            let truth = Widths {
                axial: MODEL.axial * factor(0.5),
                lateral: Waist { width: MODEL.lateral.width * factor(0.5), ..MODEL.lateral },
                elevational: Waist { width: MODEL.elevational.width * factor(0.4), ..MODEL.elevational },
            };
            let mut one = |k: usize| {
                let slope = Vector2::new(0.3 * dice(), 0.25 * dice());
                let bare =
                    Seen { wire: k % 40, depth: 15e-3 + 20e-3 * (1.0 + dice()), slope, shape: [0.0; 3] };
                let clean = truth.shape(&bare);
                let size = truth.size(&bare);
                let wrong = if k.is_multiple_of(10) { 1.0 + dice().abs() } else { 0.0 };
                let shape = std::array::from_fn(|i| clean[i] + size[i] * (0.08 * dice() + wrong));
                Seen { shape, ..bare }
            };
            let seen: Vec<Seen> = (0..600).map(&mut one).collect();
            let found = fit(&seen, &MODEL).unwrap();
            let pairs = [
                (found.widths.axial, truth.axial, found.sd[0]),
                (found.widths.lateral.width, truth.lateral.width, found.sd[1]),
                (found.widths.elevational.width, truth.elevational.width, found.sd[2]),
            ];
            for (ours, truth, sd) in pairs {
                let off = (ours / truth).ln().abs();
                assert!(
                    off < 0.02 + 3.0 * sd && sd < 0.06,
                    "seed {seed}: {ours} instead of {truth}, sd {sd}"
                );
            }
        }
    }

    #[test]
    fn what_the_dots_do_not_say_stays_the_models() {
        // Wires that cross squarely tell nothing of the thickness.
        let seen: Vec<Seen> = (0..300)
            .map(|k| {
                let bare = Seen {
                    wire: k % 9,
                    depth: 0.02 + 1e-4 * k as f64,
                    slope: Vector2::zeros(),
                    shape: [0.0; 3],
                };
                Seen { shape: MODEL.shape(&bare), ..bare }
            })
            .collect();
        let found = fit(&seen, &MODEL).unwrap();
        assert!((found.widths.elevational.width / MODEL.elevational.width - 1.0).abs() < 1e-6);
        assert!(found.sd[2] > 0.4 && found.sd[0] < 0.02, "{:?}", found.sd);
    }
}
