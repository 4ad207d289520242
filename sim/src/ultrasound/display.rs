//! From amplitudes to grey levels: attenuation, compensation, noise, contact, logarithm.

use probepath_us_capture::Setting;

use super::config::{Contact, ImagingConfig, Reverberation};
use super::grid::Grid;
use super::hash;
use crate::tissue::Medium;

/// What sets the noise apart from the speckle of the same seed.
const NOISE: u64 = 0x6e6f_6973_6521_2121;
/// Entries of the table of normal quantiles.
const QUANTILES: usize = 4096;

/// Grey level by the power's leading bits: exponent and eight bits of mantissa are a step of 0.017 dB.
pub(super) struct Display {
    grey: Vec<u8>,
    normal: Vec<f32>,
    noise_seed: u64,
}

impl Display {
    pub(super) fn new(config: &ImagingConfig, seed: u64) -> Self {
        let grey = (0..1_u32 << 16).map(|top| {
            let power = f64::from(f32::from_bits(top << 15));
            let decibel = 10.0 * power.log10() + config.gain_db - config.white_db;
            // A cast saturates: black below the range, white above, and NaN (no such power) black.
            (255.0 * (1.0 + decibel / config.dynamic_range_db)).round() as u8
        });
        let normal = (0..QUANTILES).map(|i| normal_quantile((i as f64 + 0.5) / QUANTILES as f64) as f32);
        Self { grey: grey.collect(), normal: normal.collect(), noise_seed: hash::mix(seed ^ NOISE) }
    }

    pub(super) fn grey(&self, power: f32) -> u8 {
        self.grey[(power.to_bits() >> 15) as usize]
    }

    /// Real and imaginary electronic noise of power one, of one picture, row and node.
    fn noise(&self, number: u64, row: usize, node: usize) -> [f32; 2] {
        let bits = hash::cell(self.noise_seed, number as i64, row as i64, node as i64);
        let normal =
            |shift: u32| self.normal[(bits >> shift) as usize % QUANTILES] * std::f32::consts::FRAC_1_SQRT_2;
        [normal(12), normal(40)]
    }

    /// Makes a row's smeared echoes what the machine's amplifier gives.
    pub(super) fn amplify(&self, echoes: [&mut [f32]; 2], gains: &Gains, (number, row): (u64, usize)) {
        let level = gains.level[row];
        let [real, imaginary] = echoes;
        for (node, (re, im)) in real.iter_mut().zip(imaginary).enumerate() {
            let through = gains.through(node, row);
            let [noise_re, noise_im] = self.noise(number, row, node);
            *re = *re * level * through + noise_re * gains.noise[row] + gains.ringing(node, row);
            *im = *im * level * through + noise_im * gains.noise[row];
        }
    }
}

/// Inverse of the normal distribution, by bisection of the error function's series (only tables ask).
fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        if normal_share(middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Share of a normal distribution below `x` (series of Marsaglia 2004, exact to double within 8 deviations).
fn normal_share(x: f64) -> f64 {
    let (mut sum, mut term, mut i) = (x, x, 1.0);
    while term.abs() > 1e-17 * sum.abs() && i < 400.0 {
        i += 2.0;
        term *= x * x / i;
        sum += term;
    }
    0.5 + sum * (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt()
}

/// What each row and node is multiplied by.
pub(super) struct Gains {
    level: Vec<f32>,
    noise: Vec<f32>,
    /// Echo of the probe's own face, in contact and in air.
    face: Vec<[f32; 2]>,
    coupling: Vec<f32>,
    /// Per shadow: first row, and the loss at each node.
    shadows: Vec<(usize, Vec<f32>)>,
}

fn ratio(decibel: f64) -> f64 {
    10_f64.powf(decibel / 20.0)
}

impl Gains {
    pub(super) fn new(
        config: &ImagingConfig,
        setting: &Setting,
        grid: &Grid,
        (medium, contact): (Medium, Contact),
        rows: usize,
    ) -> Self {
        let loss_db_cm = medium.loss_db_cm(config.attenuation_db_cm_mhz, config.frequency_mhz);
        let depth = |row: usize| setting.window_top_m + row as f64 * setting.spacing.y_m;
        // There and back: twice the depth in centimetres.
        let lost = |row| 2.0 * loss_db_cm * depth(row) * 1e2;
        let made_up = |row| f64::min(lost(row), config.tgc_most_db);
        let place = |node: usize| node as f64 * grid.lateral_m;
        let shadows = config.shadows.iter().map(|shadow| {
            let first = (0..rows).find(|&row| depth(row) >= shadow.below_m).unwrap_or(rows);
            let [from_m, to_m] = shadow.across_m;
            let behind = Contact::Between { from_m, to_m };
            let loss = |node| ratio(-shadow.loss_db * behind.coupling(place(node))) as f32;
            (first, (0..grid.shown).map(loss).collect())
        });
        Self {
            level: (0..rows).map(|row| ratio(made_up(row) - lost(row)) as f32).collect(),
            noise: (0..rows)
                .map(|row| ratio(config.noise_db - config.tgc_most_db + made_up(row)) as f32)
                .collect(),
            face: (0..rows).map(|row| face(depth(row), config.reverberation.as_ref())).collect(),
            coupling: (0..grid.shown).map(|node| contact.coupling(place(node)) as f32).collect(),
            shadows: shadows.collect(),
        }
    }

    fn through(&self, node: usize, row: usize) -> f32 {
        let behind = self.shadows.iter().filter(|(first, _)| row >= *first);
        self.coupling[node] * behind.map(|(_, loss)| loss[node]).product::<f32>()
    }

    fn ringing(&self, node: usize, row: usize) -> f32 {
        let [skin, air] = self.face[row];
        skin * self.coupling[node] + air * (1.0 - self.coupling[node])
    }
}

/// In contact the face shows as one bright line. In air its echo runs to and fro in the lens: bars 0.8 mm apart, each
/// 6 dB below the last. Behind contact the skin's layers may ring as well.
fn face(depth_m: f64, ringing: Option<&Reverberation>) -> [f32; 2] {
    let bar = |at: f64, sigma: f64| (-0.5 * ((depth_m - at) / sigma).powi(2)).exp();
    let air: f64 =
        (0..14).map(|n| 6.0 * ratio(-6.0 * f64::from(n)) * bar(0.8e-3 * f64::from(n), 0.18e-3)).sum();
    let rings: f64 = ringing.map_or(0.0, |bands| {
        let nearest = (depth_m / bands.every_m).round().max(1.0);
        let amplitude = ratio(bands.first_db - (nearest - 1.0) * bands.loss_db);
        amplitude * bar(nearest * bands.every_m, 0.25e-3)
    });
    [(2.0 * bar(0.0, 0.25e-3) + rings) as f32, air as f32]
}
