//! Streams of random numbers: each named, all from one seed, so that switching one source of noise off leaves the
//! others as they were.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// One named stream.
#[derive(Clone, Debug)]
pub(crate) struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream called `name` of `seed`.
    pub(crate) fn new(seed: u64, name: &str) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(fnv(name));
        Self(generator)
    }

    /// Evenly in `low..high`.
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// From the normal distribution of mean 0 and standard deviation 1 (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform(f64::EPSILON, 1.0).ln()).sqrt();
        radius * self.uniform(0.0, TAU).cos()
    }

    /// Three independent normal numbers.
    pub(crate) fn normal3(&mut self) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::new(self.normal(), self.normal(), self.normal())
    }
}

/// FNV-1a of a name: a stream's number must be the same on every machine, which `std`'s hasher does not promise.
fn fnv(name: &str) -> u64 {
    name.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

/// A smooth random function of one variable: sines of several frequencies, of unit standard deviation together.
#[derive(Clone, Debug)]
pub(crate) struct Wander {
    sines: [(f64, f64); 4],
}

impl Wander {
    /// Frequencies (cycles per unit of the variable) drawn from `low..high`.
    pub(crate) fn new(stream: &mut Stream, low: f64, high: f64) -> Self {
        Self { sines: std::array::from_fn(|_| (stream.uniform(low, high) * TAU, stream.uniform(0.0, TAU))) }
    }

    /// The value at `x`: mean 0, standard deviation 1, never beyond 2.83.
    pub(crate) fn at(&self, x: f64) -> f64 {
        let sum: f64 = self.sines.iter().map(|(frequency, phase)| (frequency * x + phase).sin()).sum();
        sum * (2.0 / self.sines.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_mean_zero_and_deviation_one() {
        let mut stream = Stream::new(7, "noise");
        let n = 100_000;
        let all: Vec<f64> = (0..n).map(|_| stream.normal()).collect();
        let mean = all.iter().sum::<f64>() / f64::from(n);
        let square = all.iter().map(|x| x * x).sum::<f64>() / f64::from(n);
        assert!(mean.abs() < 0.02 && (square - 1.0).abs() < 0.03, "{mean} {square}");
    }

    #[test]
    fn streams_of_one_seed_differ_by_name_and_repeat() {
        let draw = |seed, name: &str| Stream::new(seed, name).uniform(0.0, 1.0).to_bits();
        assert_eq!(draw(1, "a"), draw(1, "a"));
        assert_ne!(draw(1, "a"), draw(1, "b"));
        assert_ne!(draw(1, "a"), draw(2, "a"));
    }

    #[test]
    fn a_wander_keeps_within_its_bound() {
        let wander = Wander::new(&mut Stream::new(3, "w"), 0.5, 2.0);
        let values: Vec<f64> = (0..20_000).map(|i| wander.at(f64::from(i) * 0.01)).collect();
        let square = values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64;
        assert!((square - 1.0).abs() < 0.15 && values.iter().all(|x| x.abs() < 2.83), "{square}");
    }
}
