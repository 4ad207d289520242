//! The wall, fitted to the echo power of a B-scan through the point spread.
//!
//! Of fully developed speckle the mean power is linear: it is the power of the echoes, convolved with the square of
//! the point spread. So a lumen with border `r(theta)`, a wall of some thickness round it and tissue outside predict
//! the mean power of every cell, and the border is found where prediction and image agree best (Fisher scoring;
//! the standard deviation of exponential speckle is its mean). Nothing is fitted to one model of the wall: its
//! brightness, how that changes round the vessel, its thickness, the tissue's and the lumen's brightness are unknowns too.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::NoLumen;
use super::region::{RAYS, Region, angle};
use crate::patch::{Blur, Patch};

/// Harmonics of the border.
pub(crate) const HARMONICS: usize = 5;
const BORDER: usize = 2 * HARMONICS + 1;
/// Harmonics of the wall's brightness: it is dimmer where the beam runs along it.
const SHADE: usize = 5;
const TISSUE: usize = BORDER + SHADE;
const SLOPE: usize = TISSUE + 1;
const LUMEN: usize = TISSUE + 2;
const THICKNESS: usize = TISSUE + 3;
const UNKNOWNS: usize = TISSUE + 4;
/// How well the point spread is known, relative to itself; what it is off moves the border by about as much.
const SPREAD_SD: f64 = 0.1;

/// What the fit is told.
pub(crate) struct FitInput<'a> {
    /// Power round the lumen.
    pub(crate) patch: &'a Patch,
    /// Where the lumen is.
    pub(crate) region: &'a Region,
    /// Standard deviations of the point spread's amplitude along x and y (m).
    pub(crate) sigma: (f64, f64),
    /// What the wall's thickness is likely to be (m).
    pub(crate) wall: f64,
    /// What the beam's thickness takes in.
    pub(crate) planes: &'a [Plane],
    /// An earlier fit of the same region, to go on from.
    pub(crate) earlier: Option<&'a Border>,
}

/// A plane parallel to the image, within the thickness of the beam: where the vessel is there, relative to the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// Its part of the power.
    pub(crate) weight: f64,
    /// How far the vessel's centre is moved along x and y (m).
    pub(crate) shift: (f64, f64),
    /// By how much the radius is larger (m).
    pub(crate) wider: f64,
}

impl Plane {
    /// The image alone, as if the beam were thin.
    pub(crate) const ITSELF: [Self; 1] = [Self { weight: 1.0, shift: (0.0, 0.0), wider: 0.0 }];
}

/// A border round a centre, in the image's metres.
#[derive(Clone, Debug)]
pub(crate) struct Border {
    /// What the harmonics are about.
    pub(crate) centre: (f64, f64),
    harmonics: [f64; BORDER],
    unknowns: DVector<f64>,
    /// Standard deviation of the border's place, mean over the circumference (m).
    pub(crate) sd: f64,
    /// Covariance of the harmonics (m2).
    covariance: SMatrix<f64, BORDER, BORDER>,
    /// Standard deviation of what an error of the point spread does to the mean radius (m).
    pub(crate) common_sd: f64,
    /// Part of the circumference where a wall is seen (0 to 1).
    pub(crate) walled: f64,
    /// Wall's thickness (m).
    pub(crate) wall: f64,
    /// How much brighter than the lumen the wall is (dB).
    pub(crate) contrast_db: f64,
}

impl Border {
    /// Distance from the centre in a direction (m).
    pub(crate) fn radius(&self, theta: f64) -> f64 {
        basis::<BORDER>(theta).iter().zip(&self.harmonics).map(|(a, b)| a * b).sum()
    }

    /// Standard deviation of the distance from the centre in a direction (m), along the normal.
    pub(crate) fn sd_at(&self, theta: f64) -> f64 {
        let basis = SVector::from(basis::<BORDER>(theta));
        let (r, slope) = (self.radius(theta), (self.radius(theta + 1e-3) - self.radius(theta - 1e-3)) / 2e-3);
        // Where the border is not square to the ray, less of a step along the ray is along the normal.
        let square = r / r.hypot(slope).max(1e-9);
        (basis.dot(&(self.covariance * basis))).max(0.0).sqrt() * square
    }

    /// The closed contour, one place a ray.
    pub(crate) fn contour(&self) -> Vec<(f64, f64)> {
        (0..RAYS)
            .map(|ray| {
                let (r, (sin, cos)) = (self.radius(angle(ray)), angle(ray).sin_cos());
                (self.centre.0 + r * cos, self.centre.1 + r * sin)
            })
            .collect()
    }
}

/// 1, cos, sin, cos 2, sin 2, ...
fn basis<const N: usize>(theta: f64) -> [f64; N] {
    let (sin, cos) = theta.sin_cos();
    let mut out = [1.0; N];
    let (mut c, mut s) = (1.0, 0.0);
    for pair in out[1..].chunks_exact_mut(2) {
        (c, s) = (c * cos - s * sin, s * cos + c * sin);
        pair.copy_from_slice(&[c, s]);
    }
    out
}

/// A cell as the model sees it.
struct Cell {
    r: f64,
    depth: f64,
    border: [f64; BORDER],
    shade: [f64; SHADE],
    /// Half the way through the cell in the direction of the ray.
    half: f64,
    used: bool,
}

/// The unknowns, their prior, and the cells they predict.
struct Model<'a> {
    input: &'a FitInput<'a>,
    cells: Vec<Cell>,
    unknowns: DVector<f64>,
    prior: DVector<f64>,
    prior_sd: DVector<f64>,
    blur: Blur,
    /// Independent speckles in a cell.
    weight: f64,
}

/// Fits the border.
pub(crate) fn fit(input: &FitInput<'_>) -> Result<Border, NoLumen> {
    let mut model = Model::new(input);
    let mut normal = None;
    for _ in 0..15 {
        let (matrix, gradient) = model.normal_equations();
        let Some(solved) = matrix.cholesky() else { return Err(NoLumen::Unsettled) };
        let step = limited(solved.solve(&gradient));
        model.unknowns += &step;
        normal = Some(solved);
        if step.rows(0, BORDER).amax() < 3e-6 {
            break;
        }
    }
    let covariance = normal.ok_or(NoLumen::Unsettled)?.inverse();
    model.border(&covariance).ok_or(NoLumen::Unsettled)
}

/// A step no larger than the linearisation is good for.
fn limited(step: DVector<f64>) -> DVector<f64> {
    let largest = (step.rows(0, BORDER).amax() / 0.4e-3).max(step.rows(BORDER, SHADE + 2).amax() / 1.0);
    let largest = largest.max(step.rows(LUMEN, 2).amax() / 1.0);
    if largest > 1.0 { step / largest } else { step }
}

impl<'a> Model<'a> {
    fn new(input: &'a FitInput<'a>) -> Self {
        let patch = input.patch;
        let sigma = (input.sigma.0 / 2_f64.sqrt(), input.sigma.1 / 2_f64.sqrt());
        let in_cells = (sigma.0 / patch.cell.0, sigma.1 / patch.cell.1);
        let speckle = std::f64::consts::TAU * input.sigma.0 * input.sigma.1;
        let cells: Vec<Cell> = (0..patch.power.len()).map(|cell| Cell::new(input, cell)).collect();
        let (prior, prior_sd) = prior(input, &cells);
        Self {
            input,
            cells,
            unknowns: input.earlier.map_or_else(|| prior.clone(), |border| border.unknowns.clone()),
            prior,
            prior_sd,
            blur: Blur::new(patch.columns, patch.rows, in_cells),
            weight: (patch.cell.0 * patch.cell.1 / speckle).min(1.0),
        }
    }

    fn powers(&self, cell: &Cell) -> (f64, f64, f64) {
        let shade: f64 =
            cell.shade.iter().zip(self.unknowns.rows(BORDER, SHADE).iter()).map(|(a, b)| a * b).sum();
        let tissue = self.unknowns[TISSUE] + self.unknowns[SLOPE] * cell.depth * 1e2;
        (self.unknowns[LUMEN].exp(), shade.exp(), tissue.exp())
    }

    /// Mean power of every cell, and its derivative by every unknown.
    fn predict(&mut self) -> (Vec<f64>, Vec<Vec<f64>>) {
        let count = self.cells.len();
        let mut power = vec![0.0; count];
        let mut columns = vec![vec![0.0; count]; UNKNOWNS];
        let thickness = self.unknowns[THICKNESS].exp();
        for (i, cell) in self.cells.iter().enumerate() {
            let (lumen, wall, tissue) = self.powers(cell);
            let r: f64 = cell.border.iter().zip(self.unknowns.iter()).map(|(a, b)| a * b).sum();
            let (inner, d_inner) = self.across_the_beam(cell, cell.r - r);
            let (outer, d_outer) = self.across_the_beam(cell, cell.r - r - thickness);
            let (w_lumen, w_wall, w_tissue) = (1.0 - inner, inner - outer, outer);
            power[i] = lumen * w_lumen + wall * w_wall + tissue * w_tissue;
            let by_outer = -(tissue - wall) * d_outer;
            let by_r = -(wall - lumen) * d_inner + by_outer;
            for (column, basis) in columns.iter_mut().zip(&cell.border) {
                column[i] = by_r * basis;
            }
            for (column, basis) in columns[BORDER..].iter_mut().zip(&cell.shade) {
                column[i] = wall * w_wall * basis;
            }
            columns[TISSUE][i] = tissue * w_tissue;
            columns[SLOPE][i] = tissue * w_tissue * cell.depth * 1e2;
            columns[LUMEN][i] = lumen * w_lumen;
            columns[THICKNESS][i] = by_outer * thickness;
        }
        let power = self.blur.apply(&power);
        let columns = columns.iter().map(|column| self.blur.apply(column)).collect();
        (power, columns)
    }

    /// A step at `distance` from a border, averaged over the beam's planes.
    fn across_the_beam(&self, cell: &Cell, distance: f64) -> (f64, f64) {
        let (cos, sin) = (cell.border[1], cell.border[2]);
        self.input.planes.iter().fold((0.0, 0.0), |sum, plane| {
            let moved = plane.wider + plane.shift.0 * cos + plane.shift.1 * sin;
            let (step, slope) = ramp(distance - moved, cell.half);
            (sum.0 + plane.weight * step, sum.1 + plane.weight * slope)
        })
    }

    fn normal_equations(&mut self) -> (DMatrix<f64>, DVector<f64>) {
        let (power, columns) = self.predict();
        let mut matrix = DMatrix::<f64>::zeros(UNKNOWNS, UNKNOWNS);
        let mut gradient = DVector::<f64>::zeros(UNKNOWNS);
        // Deep in the lumen the prediction rests on the point spread's far tails: they weigh little.
        let floor = 0.03 * self.unknowns[BORDER].exp();
        for (i, _) in self.cells.iter().enumerate().filter(|(_, cell)| cell.used) {
            let sd = power[i] + floor;
            let residual = ((self.input.patch.power[i] - power[i]) / sd).min(6.0);
            let row: [f64; UNKNOWNS] = std::array::from_fn(|k| columns[k][i] / sd);
            for (a, &left) in row.iter().enumerate() {
                gradient[a] += self.weight * left * residual;
                for (b, &right) in row.iter().enumerate().take(a + 1) {
                    matrix[(a, b)] += self.weight * left * right;
                }
            }
        }
        for k in 0..UNKNOWNS {
            let information = self.prior_sd[k].powi(-2);
            matrix[(k, k)] += information;
            gradient[k] += information * (self.prior[k] - self.unknowns[k]);
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        (matrix, gradient)
    }

    fn border(&self, covariance: &DMatrix<f64>) -> Option<Border> {
        let mut harmonics = [0.0; BORDER];
        harmonics.copy_from_slice(self.unknowns.rows(0, BORDER).as_slice());
        // The mean over the circumference of basis^T C basis.
        let variance = covariance[(0, 0)] + (1..BORDER).map(|k| covariance[(k, k)] / 2.0).sum::<f64>();
        let wall_db = 10.0 / std::f64::consts::LN_10 * (self.unknowns[BORDER] - self.unknowns[LUMEN]);
        let border = Border {
            centre: self.input.region.centre,
            harmonics,
            unknowns: self.unknowns.clone(),
            sd: variance.sqrt(),
            covariance: covariance.fixed_view::<BORDER, BORDER>(0, 0).into_owned(),
            common_sd: SPREAD_SD * (self.input.sigma.0 + self.input.sigma.1) / 2.0,
            walled: self.walled(),
            wall: self.unknowns[THICKNESS].exp(),
            contrast_db: wall_db,
        };
        let sound = border.sd.is_finite() && self.unknowns.iter().all(|x| x.is_finite());
        let positive = (0..RAYS).all(|ray| border.radius(angle(ray)) > 0.0);
        (sound && positive).then_some(border)
    }

    /// The part of the circumference where the image is at least 6 dB brighter in the wall than in the lumen.
    fn walled(&self) -> f64 {
        let thickness = self.unknowns[THICKNESS].exp();
        let mut sums = [(0.0, 0.0); 12];
        let mut lumen = (1e-12, 1e-9);
        for (i, cell) in self.cells.iter().enumerate() {
            let r: f64 = cell.border.iter().zip(self.unknowns.iter()).map(|(a, b)| a * b).sum();
            let power = self.input.patch.power[i];
            let sector =
                (cell.border[2].atan2(cell.border[1]) / std::f64::consts::TAU).rem_euclid(1.0) * 12.0;
            if let Some(sum) = sums.get_mut(sector as usize)
                && (r..r + thickness).contains(&cell.r)
            {
                *sum = (sum.0 + power, sum.1 + 1.0);
            }
            if cell.r < 0.5 * r {
                lumen = (lumen.0 + power, lumen.1 + 1.0);
            }
        }
        let dark = 4.0 * lumen.0 / lumen.1;
        sums.iter().filter(|(power, n)| *n > 0.0 && power / n > dark).count() as f64 / 12.0
    }
}

impl Cell {
    fn new(input: &FitInput<'_>, cell: usize) -> Self {
        let (x, y) = input.patch.place(cell);
        let (dx, dy) = (x - input.region.centre.0, y - input.region.centre.1);
        let (r, theta) = (dx.hypot(dy), dy.atan2(dx));
        let (sin, cos) = theta.sin_cos();
        let half = 0.5 * (input.patch.cell.0 * cos.abs() + input.patch.cell.1 * sin.abs());
        let outwards = start_radius(input, theta) + input.wall + 1.2e-3;
        Self { r, depth: dy, border: basis(theta), shade: basis(theta), half, used: r < outwards }
    }
}

/// Where the wall is looked for first: the front's border, moved out by `1.75 sigma` (FIELD.md section 8).
fn start_radius(input: &FitInput<'_>, theta: f64) -> f64 {
    let at = theta.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * RAYS as f64;
    let ray = at.round() as usize % RAYS;
    let (sin, cos) = theta.sin_cos();
    input.region.radii[ray] + 1.75 * (input.sigma.0 * cos).hypot(input.sigma.1 * sin)
}

/// Where the unknowns start, which is also what they are likely to be, and how sure that is.
fn prior(input: &FitInput<'_>, cells: &[Cell]) -> (DVector<f64>, DVector<f64>) {
    let mut prior = DVector::zeros(UNKNOWNS);
    let mut sd = DVector::from_element(UNKNOWNS, 3.0);
    for ray in 0..RAYS {
        let r = start_radius(input, angle(ray));
        for (k, b) in basis::<3>(angle(ray)).iter().enumerate() {
            prior[k] += r * b * if k == 0 { 1.0 } else { 2.0 } / RAYS as f64;
        }
    }
    // Size and place are free; sections of arteries are round or oval, and hardly anything else.
    sd.rows_mut(0, 3).fill(10e-3);
    for k in 2..=HARMONICS {
        sd.rows_mut(2 * k - 1, 2).fill(1.2e-3 / (k * k) as f64);
    }
    let mean = |from: f64, to: f64| {
        let inside = cells.iter().zip(&input.patch.power).filter(|(cell, _)| {
            let start = prior[0] + prior[1] * cell.border[1] + prior[2] * cell.border[2];
            (start + from..start + to).contains(&cell.r)
        });
        let (sum, n) = inside.fold((1e-12, 1e-9), |(sum, n), (_, power)| (sum + power, n + 1.0));
        f64::ln(sum / n)
    };
    let (wall, tissue) = (mean(0.0, input.wall), mean(input.wall + 0.5e-3, input.wall + 1.5e-3));
    let lumen = mean(-1.0, -0.6 * prior[0]);
    prior[BORDER] = wall;
    sd.rows_mut(BORDER + 1, SHADE - 1).fill(0.5);
    prior[TISSUE] = tissue;
    sd[SLOPE] = 0.5;
    prior[LUMEN] = lumen;
    prior[THICKNESS] = input.wall.ln();
    sd[THICKNESS] = 0.25;
    (prior, sd)
}

/// A step from 0 to 1 over a cell, and its derivative by the distance.
fn ramp(distance: f64, half: f64) -> (f64, f64) {
    if distance <= -half {
        (0.0, 0.0)
    } else if distance >= half {
        (1.0, 0.0)
    } else {
        (0.5 + distance / (2.0 * half), 1.0 / (2.0 * half))
    }
}
