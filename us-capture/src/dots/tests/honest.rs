//! Whether the covariance says how far the centres are off: thousands of drawn dots, any shape, any angle, with speckle
//! and noise.

use nalgebra::{Matrix2, Rotation2, Vector2};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::{Dot, DotFinder, DotSettings, Mask};

const SIDE: usize = 96;
const BACKGROUND: f64 = 20.0;

/// A dot as it is drawn.
struct Drawn {
    centre: Vector2<f64>,
    inverse: Matrix2<f64>,
    height: f64,
}

impl Drawn {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let spreads = Vector2::new(rng.random_range(2.5..7.0), rng.random_range(1.5..3.5));
        let turn = Rotation2::new(rng.random_range(0.0..std::f64::consts::PI)).into_inner();
        let inverse = turn * Matrix2::from_diagonal(&spreads.map(|s| 1.0 / (s * s))) * turn.transpose();
        let centre = Vector2::new(rng.random_range(44.0..52.0), rng.random_range(44.0..52.0));
        Self { centre, inverse, height: rng.random_range(60.0..180.0) }
    }

    fn at(&self, u: usize, v: usize) -> f64 {
        let off = Vector2::new(u as f64, v as f64) - self.centre;
        self.height * (-0.5 * off.dot(&(self.inverse * off))).exp()
    }

    /// Its image: each pixel of the echo times its speckle, plus the background and noise.
    fn image(&self, rng: &mut ChaCha8Rng, speckle: &[f64], noise: f64) -> Vec<u8> {
        let level = |i: usize, rng: &mut ChaCha8Rng| {
            let echo = self.at(i % SIDE, i / SIDE) * speckle[i];
            (BACKGROUND + echo + noise * normal(rng)).round().clamp(0.0, 255.0) as u8
        };
        (0..SIDE * SIDE).map(|i| level(i, rng)).collect()
    }

    /// The squared error of a dot's centre in units of its covariance: 2 on average when the covariance is true.
    fn surprise(&self, dot: &Dot) -> f64 {
        let off = Vector2::from(dot.at_px) - self.centre;
        off.dot(&(dot.covariance_px2.try_inverse().unwrap() * off))
    }
}

fn normal(rng: &mut impl Rng) -> f64 {
    let (a, b): (f64, f64) =
        (rng.random_range(f64::EPSILON..1.0), rng.random_range(0.0..std::f64::consts::TAU));
    (-2.0 * a.ln()).sqrt() * b.cos()
}

/// One plus a field of unit variance times the contrast: pixel by pixel, or smoothed to `grain` pixels.
fn speckle(rng: &mut ChaCha8Rng, contrast: f64, grain: usize) -> Vec<f64> {
    let white: Vec<f64> = (0..SIDE * SIDE).map(|_| normal(rng)).collect();
    let mean = |i: usize| {
        let (u, v) = (i % SIDE, i / SIDE);
        let cells = (0..grain * grain).map(|c| (u + c % grain) % SIDE + (v + c / grain) % SIDE * SIDE);
        cells.map(|at| white[at]).sum::<f64>() / grain as f64
    };
    (0..SIDE * SIDE).map(|i| (1.0 + contrast * mean(i)).max(0.0)).collect()
}

/// The mean surprise, per axis, of so many dots.
fn mean_surprise(settings: DotSettings, count: usize, contrast: f64, grain: usize, noise: f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut finder = DotFinder::new(settings, &Mask::whole(), SIDE, SIDE).unwrap();
    let mut sum = 0.0;
    for _ in 0..count {
        let drawn = Drawn::random(&mut rng);
        let speckle = speckle(&mut rng, contrast, grain);
        let image = drawn.image(&mut rng, &speckle, noise);
        let dots = finder.find(&image).unwrap();
        sum += drawn.surprise(dots.first().expect("the dot")) / 2.0;
    }
    sum / count as f64
}

/// Noise alone, no shape: the covariance of the noise is true.
#[test]
fn noise_and_fine_speckle_move_the_centre_as_far_as_is_said() {
    let settings = DotSettings { wobble: 0.0, ..DotSettings::default() };
    for (contrast, noise) in [(0.0, 2.0), (0.0, 5.0), (0.3, 1.0), (0.2, 4.0)] {
        let surprise = mean_surprise(settings, 800, contrast, 1, noise);
        eprintln!("fine speckle {contrast}, noise {noise}: normalised variance {surprise:.3}");
        assert!((0.7..1.3).contains(&surprise), "{contrast} {noise}: {surprise}");
    }
}

/// What the wobble stands for: speckle in grains of several pixels, of a contrast up to 0.2. Coarser or stronger
/// speckle moves the centre further than is said (contrast 0.25 in grains of 5 px: a normalised variance of 2.3).
#[test]
fn coarse_speckle_moves_the_centre_no_further_than_is_said() {
    for (contrast, grain) in [(0.2, 3), (0.15, 5)] {
        let surprise = mean_surprise(DotSettings::default(), 600, contrast, grain, 2.0);
        eprintln!("coarse speckle {contrast} of {grain} px: normalised variance {surprise:.3}");
        assert!((0.4..1.3).contains(&surprise), "{contrast} {grain}: {surprise}");
    }
}
