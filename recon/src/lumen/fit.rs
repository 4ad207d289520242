//! The wall, fitted to the echo power of a B-scan through the point spread.
//!
//! Of fully developed speckle the mean power is linear: it is the power of the echoes, convolved with the square of
//! the point spread. So a lumen with border `r(theta)`, a wall of some thickness round it and tissue outside predict
//! the mean power of every cell, and the border is found where prediction and image agree best (Fisher scoring;
//! the standard deviation of exponential speckle is its mean). Nothing is fitted to one model of the wall: its
//! brightness, how that changes round the vessel, its thickness, the tissue's and the lumen's brightness are unknowns
//! too. Where no wall is seen, the image is not asked, and the border's smoothness says where it runs.
//!
//! The prediction is exact on its cells; its derivatives take every cell's own direction for the direction its echoes
//! come from, which makes five fields do for 23 unknowns. Where the steps end that plays no part: what ends is the
//! residual.

mod equations;
mod fields;
mod lattice;
mod sight;
mod steps;

use nalgebra::{SMatrix, SVector};
use probepath_us_capture::BScan;

use super::NoLumen;
use super::region::{RAYS, Region, angle};
use super::wall::{Told, WallPrior};
use crate::patch::PowerOfGrey;
use equations::{GainStep, Gains, Matrix, RADIUS, Residual, SPANS, UNKNOWNS, Vector, Weights, equations};
use fields::{BY_THICKNESS, Fields, LUMEN, Scene, TISSUE, WALL};
use lattice::{BINS, Lattice, Wanted, direction};
use sight::Sight;
use steps::Steps;

/// Harmonics of the border.
pub(crate) const HARMONICS: usize = 5;
const BORDER: usize = 2 * HARMONICS + 1;
/// Harmonics of the wall's and the tissue's brightness: they are dimmer where the beam runs along them.
const SHADE: usize = 5;
/// Where the other unknowns begin: logarithms of powers, and of the wall's thickness.
const SHADES: usize = SPANS[WALL].0;
const TISSUES: usize = SPANS[TISSUE].0;
const BLOOD: usize = SPANS[LUMEN].0;
const THICKNESS: usize = SPANS[BY_THICKNESS].0;

/// How far outside the wall the image is asked (m).
const BEYOND_M: f64 = 1.2e-3;
/// How far outside of where a front lets expect it the wall is looked for (m), and the largest step of a fit.
const FARTHEST_OUT_M: f64 = 1.0e-3;
const LARGEST_STEP_M: f64 = 0.4e-3;
/// Cells are this large, in standard deviations of the point spread's power along x and y.
const CELL: (f64, f64) = (0.8, 1.2);
/// Steps end when no harmonic moves farther (m), or after so many. Directions are tabulated, so that harmonics sway by
/// some 10 um in the end; speckle moves them by five times that.
const SETTLED_M: f64 = 20e-6;
/// The same of a fit that another one goes on from.
const NEARLY_SETTLED_M: f64 = 40e-6;
const MOST_STEPS: usize = 8;

/// What speckle does to the right side, as a part of the echoes' information: 0.33 for the border's size, 0.44 for its
/// place, 0.55 for its shape.
const NOISE_OF_INFORMATION: f64 = 0.45;

/// Covariance of the border's harmonics (m2).
type Harmonics = SMatrix<f64, BORDER, BORDER>;

/// What the fit is told.
#[derive(Clone, Copy)]
pub(crate) struct FitInput<'a> {
    /// The image, and what its grey levels stand for.
    pub(crate) bscan: &'a BScan,
    pub(crate) table: &'a PowerOfGrey,
    /// Where the lumen is.
    pub(crate) region: &'a Region,
    /// Standard deviations of the point spread's amplitude along x and y (m), and how well they are known, as a part
    /// of themselves.
    pub(crate) sigma: (f64, f64),
    pub(crate) sigma_sd: f64,
    /// What the wall's thickness is likely to be.
    pub(crate) wall: WallPrior,
    /// What the beam's thickness takes in.
    pub(crate) planes: &'a [Plane],
    /// Whether it is the last fit of this image. Before that, what the point spread's error does is not asked, how sure the
    /// border is roughly, and it may sway more.
    pub(crate) last: bool,
    /// Where it begins.
    pub(crate) start: Start<'a>,
}

/// Where a fit begins.
#[derive(Clone, Copy)]
pub(crate) enum Start<'a> {
    /// At what the front filled.
    Front,
    /// Where the image beside this one has the lumen, unless the wall is seen to rise elsewhere: from inside it, a fit may
    /// end at a speckle.
    Beside(&'a Border),
    /// Where an earlier fit of this image ended.
    Again(&'a Border),
}

impl<'a> Start<'a> {
    const fn earlier(self) -> Option<&'a Border> {
        match self {
            Self::Front => None,
            Self::Beside(border) | Self::Again(border) => Some(border),
        }
    }
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
    unknowns: Vector,
    gains: Gains,
    /// Standard deviation of the mean radius (m).
    pub(crate) sd: f64,
    /// Covariance of the harmonics (m2).
    covariance: Harmonics,
    /// Standard deviation of what images of the same wall share (m): of a point, and of the mean radius.
    pub(crate) common_sd: f64,
    pub(crate) common_size_sd: f64,
    /// Part of the circumference where a wall is seen (0 to 1).
    pub(crate) walled: f64,
    /// Mean square of how far cells are off the prediction, in standard deviations: about one where a wall round a
    /// lumen is what the picture shows.
    pub(crate) misfit: f64,
    /// Wall's thickness (m), and what the image says of it.
    pub(crate) wall: f64,
    pub(crate) told: Told,
    /// How much brighter than the lumen the wall is (dB).
    pub(crate) contrast_db: f64,
}

impl Border {
    /// Distance from the centre in a direction (m).
    pub(crate) fn radius(&self, theta: f64) -> f64 {
        harmonic::<BORDER>(&self.unknowns, RADIUS, theta)
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

/// The sum of `N` harmonics whose coefficients begin at `from`.
fn harmonic<const N: usize>(unknowns: &Vector, from: usize, theta: f64) -> f64 {
    basis::<N>(theta).iter().zip(unknowns.rows(from, N).iter()).map(|(a, b)| a * b).sum()
}

/// The unknowns, their prior, and what they are held against.
struct Model<'a> {
    input: FitInput<'a>,
    lattice: Lattice,
    steps: Steps,
    fields: Fields,
    sight: Sight,
    unknowns: Vector,
    prior: Vector,
    prior_sd: Vector,
    weights: Weights,
    gains: Gains,
}

/// Fits the border.
pub(crate) fn fit(input: &FitInput<'_>) -> Result<Border, NoLumen> {
    let mut model = Model::new(input)?;
    let settled_m = if input.last { SETTLED_M } else { NEARLY_SETTLED_M };
    for _ in 0..MOST_STEPS {
        let (matrix, gradient, gains) = model.normal_equations();
        let solved = matrix.cholesky().ok_or(NoLumen::Unsettled)?;
        let step = limited(solved.solve(&gradient));
        model.unknowns += step;
        model.gains.follow(&step, &gains);
        if step.rows(RADIUS, BORDER).amax() < settled_m {
            // What is known so near to the end is known there.
            return model.border(&matrix, &solved.inverse()).ok_or(NoLumen::Unsettled);
        }
    }
    let (matrix, ..) = model.normal_equations();
    let solved = matrix.cholesky().ok_or(NoLumen::Unsettled)?;
    model.border(&matrix, &solved.inverse()).ok_or(NoLumen::Unsettled)
}

/// A step no larger than the linearisation is good for.
fn limited(step: Vector) -> Vector {
    let largest =
        (step.rows(RADIUS, BORDER).amax() / LARGEST_STEP_M).max(step.rows(BORDER, UNKNOWNS - BORDER).amax());
    if largest > 1.0 { step / largest } else { step }
}

impl<'a> Model<'a> {
    fn new(input: &FitInput<'a>) -> Result<Self, NoLumen> {
        let mut start: [f64; BINS] = std::array::from_fn(|bin| start_radius(input, direction(bin)));
        let sigma = (input.sigma.0 / 2_f64.sqrt(), input.sigma.1 / 2_f64.sqrt());
        let mut lattice = lattice(input, &start, sigma)?;
        let speckle = std::f64::consts::TAU * input.sigma.0 * input.sigma.1;
        let inside = std::array::from_fn(|bin| (start[bin] - front_to_wall(input, direction(bin))) as f32);
        let sight = Sight::new(&lattice, &inside);
        let off = sight.farther_out(|bin| front_to_wall(input, direction(bin)));
        if matches!(input.start, Start::Beside(_)) && off.abs() > LARGEST_STEP_M {
            return Self::new(&FitInput { start: Start::Front, ..*input });
        }
        let earlier = input.start.earlier();
        if earlier.is_none() {
            start.iter_mut().for_each(|r| *r += off.clamp(-LARGEST_STEP_M, FARTHEST_OUT_M));
        }
        lattice.limit(|bin| start[bin] + input.wall.thickness_m + BEYOND_M);
        let (prior, prior_sd) = prior(input, &lattice, &start, &sight);
        Ok(Self {
            steps: Steps::new(input.planes, lattice.cell),
            fields: Fields::new(&lattice, sigma),
            unknowns: earlier.map_or(prior, |border| border.unknowns),
            prior,
            prior_sd,
            weights: Weights {
                speckles: (lattice.cell.0 * lattice.cell.1 / speckle).min(1.0),
                floor: 0.0,
                trust: sight.trust,
            },
            gains: earlier.map_or(Gains::NONE, |border| border.gains.clone()),
            input: *input,
            lattice,
            sight,
        })
    }

    fn scene(&self) -> Scene {
        let gain = |bin: usize| self.gains.factor(bin);
        let along = |from: usize, bin: usize| {
            (gain(bin) * harmonic::<SHADE>(&self.unknowns, from, direction(bin)).exp()) as f32
        };
        Scene {
            radius: std::array::from_fn(|bin| {
                harmonic::<BORDER>(&self.unknowns, RADIUS, direction(bin)) as f32
            }),
            wall: std::array::from_fn(|bin| along(SHADES, bin)),
            tissue: std::array::from_fn(|bin| along(TISSUES, bin)),
            lumen: std::array::from_fn(|bin| (gain(bin) * self.unknowns[BLOOD].exp()) as f32),
            thickness: self.unknowns[THICKNESS].exp() as f32,
        }
    }

    fn normal_equations(&mut self) -> (Matrix, Vector, GainStep) {
        let scene = self.scene();
        self.fields.predict(&self.lattice, &self.steps, &scene);
        self.weights.floor = 0.03 * self.unknowns[SHADES].exp() as f32;
        let (mut matrix, mut gradient, gains) =
            equations(&self.lattice, &self.fields, &self.weights, &self.gains, Residual::Echo);
        for k in 0..UNKNOWNS {
            let information = self.prior_sd[k].powi(-2);
            matrix[(k, k)] += information;
            gradient[k] += information * (self.prior[k] - self.unknowns[k]);
        }
        (matrix, gradient, gains)
    }

    /// The right side that a residual makes, the gains held.
    fn answer(&self, residual: Residual<'_>) -> Vector {
        equations(&self.lattice, &self.fields, &self.weights, &Gains::NONE, residual).1
    }

    /// Where the unknowns are now, from the normal equations of the last step and their inverse.
    fn border(&mut self, matrix: &Matrix, inverse: &Matrix) -> Option<Border> {
        let misfit = equations::misfit(&self.lattice, &self.fields, &self.weights);
        let (spread, spread_size) = if self.input.last { self.spread_sd(inverse) } else { (0.0, 0.0) };
        // Speckle that is smoother than fully developed speckle, as machines draw it, has less to say and less to shake:
        // the dispersion of a quasi-score (McCullagh 1983).
        let (random, common) = self.covariances(inverse, self.noise(matrix) * misfit);
        self.unknowns += self.bias(inverse, &random);
        let variance = inverse[(THICKNESS, THICKNESS)];
        let wall_db = 10.0 / std::f64::consts::LN_10 * (self.unknowns[SHADES] - self.unknowns[BLOOD]);
        let border = Border {
            centre: self.input.region.centre,
            unknowns: self.unknowns,
            gains: self.gains.clone(),
            sd: random[(0, 0)].sqrt(),
            covariance: random,
            common_sd: mean_square(|k| common[(k, k)]).sqrt().hypot(spread),
            common_size_sd: common[(0, 0)].sqrt().hypot(spread_size),
            walled: self.sight.walled,
            misfit,
            wall: self.unknowns[THICKNESS].exp(),
            told: Told::apart_from(&self.input.wall, self.unknowns[THICKNESS], variance),
            contrast_db: wall_db,
        };
        let sound = border.sd.is_finite() && self.unknowns.iter().all(|x| x.is_finite());
        let positive = (0..RAYS).all(|ray| border.radius(angle(ray)) > 0.0);
        (sound && positive).then_some(border)
    }

    /// Covariance of the right side: what speckle does to it. Before the last fit it is guessed from the echoes' information
    /// in `matrix`.
    fn noise(&self, matrix: &Matrix) -> Matrix {
        if self.input.last {
            let fields = &mut self.fields.clone();
            return equations::noise(&self.lattice, fields, &self.weights, self.input.sigma);
        }
        NOISE_OF_INFORMATION * (matrix - Matrix::from_diagonal(&self.prior_sd.map(|sd| sd.powi(-2))))
    }

    /// Covariances of the border's harmonics: what is this image's own (its speckle, and shapes it cannot tell), and
    /// what images of the same wall share (brightness and thickness as far as they are only expected).
    fn covariances(&self, inverse: &Matrix, mut own: Matrix) -> (Harmonics, Harmonics) {
        let mut shared = Matrix::zeros();
        for k in 0..UNKNOWNS {
            let of = if k < BORDER { &mut own } else { &mut shared };
            of[(k, k)] += self.prior_sd[k].powi(-2);
        }
        // Of the wall's thickness a part is the image's own.
        let alone = (self.input.wall.own_sd / self.input.wall.sd()).powi(2) * shared[(THICKNESS, THICKNESS)];
        own[(THICKNESS, THICKNESS)] += alone;
        shared[(THICKNESS, THICKNESS)] -= alone;
        let border = |middle: Matrix| -> Harmonics {
            (inverse * middle * inverse).fixed_view::<BORDER, BORDER>(0, 0).into_owned()
        };
        (border(own), border(shared))
    }

    /// What is to be added to the unknowns because the prediction bends: a border that speckle shakes predicts, on the
    /// average, a softer edge than the picture has, and the fit answers with a thinner wall and a wider lumen (the bias
    /// of second order of a quasi-score: Cox and Snell 1968).
    fn bias(&self, inverse: &Matrix, covariance: &Harmonics) -> Vector {
        let cell = self.lattice.cell;
        let smeared = std::array::from_fn(|bin| {
            let theta = direction(bin);
            let basis = SVector::from(basis::<BORDER>(theta));
            let half = 0.5 * basis.dot(&(covariance * basis));
            let (sin, cos) = theta.sin_cos();
            let (x, y) = (cos / cell.0, sin / cell.1);
            [half * x * x, half * x * y, half * y * y].map(|value| value as f32)
        });
        inverse * self.answer(Residual::Smeared(&smeared))
    }

    /// How far the border moves, root mean square over the circumference, and how much the mean radius changes when the
    /// point spread is wider by its standard deviation: that of the power solves the equation of heat.
    fn spread_sd(&self, covariance: &Matrix) -> (f64, f64) {
        let cells = |sigma: f64, cell: f64| (self.input.sigma_sd * (sigma / cell).powi(2) / 2.0) as f32;
        let (x, y) =
            (cells(self.input.sigma.0, self.lattice.cell.0), cells(self.input.sigma.1, self.lattice.cell.1));
        let moved = |x: f32, y: f32| {
            let by = covariance * self.answer(Residual::Wider { x, y });
            (mean_square(|k| by[k].powi(2)), by[0])
        };
        let ((point_x, size_x), (point_y, size_y)) = (moved(x, 0.0), moved(0.0, y));
        ((point_x + point_y).sqrt(), size_x.hypot(size_y))
    }
}

/// The mean over the circumference of the square of harmonics, of each of which the square is known.
fn mean_square(square: impl Fn(usize) -> f64) -> f64 {
    square(0) + (1..BORDER).map(|k| square(k) / 2.0).sum::<f64>()
}

/// The cells round the lumen, far enough for the point spread to reach in.
fn lattice(input: &FitInput<'_>, start: &[f64; BINS], sigma: (f64, f64)) -> Result<Lattice, NoLumen> {
    let farther = if input.start.earlier().is_none() { FARTHEST_OUT_M } else { 0.0 };
    let far = start.iter().copied().fold(0.0, f64::max) + farther + input.wall.thickness_m + BEYOND_M;
    let wanted = Wanted {
        centre: input.region.centre,
        half: (far + 3.5 * sigma.0, far + 3.5 * sigma.1),
        cell: (CELL.0 * sigma.0, CELL.1 * sigma.1),
        shadows: &input.region.shadows,
    };
    let outside = NoLumen::OutsidePicture { x_mm: wanted.centre.0 * 1e3, y_mm: wanted.centre.1 * 1e3 };
    Lattice::new(input.bscan, input.table, &wanted).ok_or(outside)
}

/// Where the wall is looked for first: where an earlier fit had it, or the front's border moved out.
fn start_radius(input: &FitInput<'_>, theta: f64) -> f64 {
    if let Some(border) = input.start.earlier() {
        return border.radius(theta);
    }
    let at = theta.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * RAYS as f64;
    let ray = at.round() as usize % RAYS;
    input.region.radii[ray] + front_to_wall(input, theta)
}

/// How far inside the wall a front stands: `1.75 sigma` (FIELD.md section 8).
fn front_to_wall(input: &FitInput<'_>, theta: f64) -> f64 {
    let (sin, cos) = theta.sin_cos();
    1.75 * (input.sigma.0 * cos).hypot(input.sigma.1 * sin)
}

/// Where the unknowns start, which is also what they are likely to be, and how sure that is.
fn prior(input: &FitInput<'_>, lattice: &Lattice, start: &[f64; BINS], sight: &Sight) -> (Vector, Vector) {
    let mut prior = Vector::zeros();
    let mut sd = Vector::from_element(3.0);
    prior.rows_mut(RADIUS, 3).copy_from(&circle(start, &sight.trust));
    // Size and place are free; sections of arteries are round or oval, and hardly anything else.
    sd.rows_mut(RADIUS, 3).fill(10e-3);
    for k in 2..=HARMONICS {
        sd.rows_mut(RADIUS + 2 * k - 1, 2).fill(1.6e-3 / (k * k) as f64);
    }
    let wall = input.wall.thickness_m;
    let mean = |from: f64, to: f64| lattice.mean(|bin| (start[bin] + from, start[bin] + to)).ln();
    prior[SHADES] = mean(0.0, wall);
    sd.rows_mut(SHADES + 1, SHADE - 1).fill(0.5);
    prior[TISSUES] = mean(wall + 0.5e-3, wall + 1.5e-3);
    sd.rows_mut(TISSUES + 1, SHADE - 1).fill(0.5);
    prior[BLOOD] = lattice.mean(|bin| (-1.0, 0.4 * start[bin])).ln();
    prior[THICKNESS] = wall.ln();
    sd[THICKNESS] = input.wall.sd();
    (prior, sd)
}

/// The circle through the starts (mean radius and shift) that are trusted.
fn circle(start: &[f64; BINS], trust: &[f32; BINS]) -> SVector<f64, 3> {
    let mut matrix = SMatrix::<f64, 3, 3>::identity() * 1e-3;
    let mut right = SVector::<f64, 3>::zeros();
    for (bin, (r, trust)) in start.iter().zip(trust).enumerate() {
        let basis = SVector::from(basis::<3>(direction(bin)));
        matrix += basis * basis.transpose() * f64::from(*trust);
        right += basis * (r * f64::from(*trust));
    }
    matrix.cholesky().map_or(right, |solved| solved.solve(&right))
}
