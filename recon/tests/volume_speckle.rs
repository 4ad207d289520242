//! Speckle of repeated sweeps averages out, as independent speckle does: by the square root of their number.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::volume::{Mark, Slice, SpeckleSettings, SpeckleVolume, Volume, VolumeSettings, Weights};
use probepath_us_capture::PixelMap;

const WIDTH: usize = 180;
const HEIGHT: usize = 120;
const IMAGES: usize = 6;
const DYNAMIC_RANGE_DB: f64 = 60.0;
/// The amplitudes of the tissue and of the lesion on its right: 12 dB apart.
const TISSUE: f64 = 0.1;
const LESION: f64 = 0.025;

/// Normal numbers by their seed.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// One part of complex white noise, smoothed along columns to a grain of a few pixels.
fn smooth(noise: &mut Noise, grain: usize) -> Vec<f64> {
    let row = |noise: &mut Noise| {
        let white: Vec<f64> = (0..WIDTH + grain).map(|_| noise.normal()).collect();
        let sums: Vec<f64> =
            white.windows(grain).map(|w| w.iter().sum::<f64>() / (grain as f64).sqrt()).collect();
        sums[..WIDTH].to_vec()
    };
    (0..HEIGHT).flat_map(|_| row(noise)).collect()
}

/// A log-compressed image of fully developed speckle: the lesion in its right half.
fn image(noise: &mut Noise, grain: usize) -> Vec<u8> {
    let (real, imaginary) = (smooth(noise, grain), smooth(noise, grain));
    let pixel = |at: usize| {
        let level = if at % WIDTH < WIDTH / 2 { TISSUE } else { LESION };
        // The mean of the modulus of two normal numbers is sqrt(pi / 2).
        let amplitude = level * real[at].hypot(imaginary[at]) / (std::f64::consts::PI / 2.0).sqrt();
        (255.0 * (1.0 + 20.0 * amplitude.log10() / DYNAMIC_RANGE_DB)).round().clamp(0.0, 255.0) as u8
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

fn sweep(seed: u64, grain: usize) -> Vec<Vec<u8>> {
    let mut noise = Noise(seed);
    (0..IMAGES).map(|_| image(&mut noise, grain)).collect()
}

/// Pixels of 0.1 mm, images every 0.3 mm: a voxel of 0.3 mm takes nine pixels of one image.
fn slices(images: &[Vec<u8>]) -> Vec<Slice<'_>> {
    let map = |number: usize| {
        let first = Point::<World>::new(1e-5, 1e-5, 3e-4 * number as f64);
        PixelMap::new(first, Vector3::x() * 1e-4, Vector3::y() * 1e-4)
    };
    images.iter().enumerate().map(|(number, pixels)| Slice::new(pixels, WIDTH, map(number))).collect()
}

fn settings() -> VolumeSettings {
    VolumeSettings { weights: Weights::Nearest, ..VolumeSettings::every_mm(0.3) }
}

fn compound(sweeps: &[Vec<Vec<u8>>]) -> SpeckleVolume {
    let slices: Vec<Vec<Slice<'_>>> = sweeps.iter().map(|images| slices(images)).collect();
    let sweeps: Vec<&[Slice<'_>]> = slices.iter().map(Vec::as_slice).collect();
    SpeckleVolume::build(&sweeps, &settings(), &SpeckleSettings::default()).expect("a volume")
}

/// Amplitudes of the voxels of tissue and of lesion, away from the borders.
fn regions(volume: &Volume) -> [Vec<f64>; 2] {
    let [nx, ny, nz] = volume.grid().size;
    let mut regions = [Vec::new(), Vec::new()];
    for index in 0..nx * ny * nz {
        let (x, y) = (index % nx, index / nx % ny);
        let side = if x > nx / 2 + 2 { 1 } else { 0 };
        let inside = x > 2 && x < nx - 3 && x.abs_diff(nx / 2) > 2 && y > 2 && y < ny - 3;
        if inside && volume.marks()[index] == Mark::Seen {
            let db = (f64::from(volume.grey()[index]) / 255.0 - 1.0) * DYNAMIC_RANGE_DB;
            regions[side].push(10.0_f64.powf(db / 20.0));
        }
    }
    regions
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64;
    (mean, variance.sqrt())
}

/// Contrast-to-noise ratio of the lesion, and signal-to-noise ratio of the tissue's speckle.
fn ratios(volume: &Volume) -> (f64, f64) {
    let [(tissue, noise), (lesion, less)] = regions(volume).map(|region| mean_and_sd(&region));
    ((tissue - lesion) / noise.hypot(less), tissue / noise)
}

#[test]
fn independent_sweeps_gain_by_the_square_root_of_their_number() {
    let sweeps: Vec<Vec<Vec<u8>>> = (1..=9).map(|seed| sweep(seed, 3)).collect();
    let one = compound(&sweeps[..1]);
    let (contrast, speckle) = ratios(&one.volume);
    for count in [2, 4, 9] {
        let several = compound(&sweeps[..count]);
        let ((more_contrast, more_speckle), root) = (ratios(&several.volume), (count as f64).sqrt());
        eprintln!(
            "{count} sweeps: CNR {contrast:.2} to {more_contrast:.2}, speckle SNR {speckle:.2} to {more_speckle:.2}, \
             looks {:.1} to {:.1}",
            one.mean_looks, several.mean_looks
        );
        assert!((more_contrast / contrast / root - 1.0).abs() < 0.08, "{count}: {contrast} {more_contrast}");
        assert!((more_speckle / speckle / root - 1.0).abs() < 0.08, "{count}: {speckle} {more_speckle}");
        assert!((several.mean_looks / one.mean_looks / count as f64 - 1.0).abs() < 0.05);
    }
}

#[test]
fn the_mean_amplitude_is_the_tissues_which_the_mean_of_grey_levels_is_not() {
    let sweeps: Vec<Vec<Vec<u8>>> = (1..=4).map(|seed| sweep(seed, 3)).collect();
    let [(tissue, _), (lesion, _)] = regions(&compound(&sweeps).volume).map(|region| mean_and_sd(&region));
    assert!(
        (tissue / TISSUE - 1.0).abs() < 0.02 && (lesion / LESION - 1.0).abs() < 0.02,
        "{tissue} {lesion}"
    );
    let all: Vec<Slice<'_>> = sweeps.iter().flat_map(|images| slices(images)).collect();
    let grey = Volume::build(&all, &settings()).expect("a volume");
    let [(grey, _), _] = regions(&grey).map(|region| mean_and_sd(&region));
    // The mean logarithm of fully developed speckle lies 1.46 dB below the logarithm of its mean amplitude.
    assert!((20.0 * (grey / TISSUE).log10() + 1.46).abs() < 0.2, "{grey}");
}

#[test]
fn one_sweep_given_four_times_gains_nothing() {
    let once = compound(&[sweep(3, 3)]);
    let again = compound(&vec![sweep(3, 3); 4]);
    let ((contrast, speckle), (same_contrast, same_speckle)) = (ratios(&once.volume), ratios(&again.volume));
    assert!((same_contrast / contrast - 1.0).abs() < 0.01 && (same_speckle / speckle - 1.0).abs() < 0.01);
}

#[test]
fn the_grain_is_read_from_the_images() {
    for grain in [1, 3, 6] {
        let found = compound(&[sweep(5, grain)]).grains_px[0];
        // A grain of n boxes: correlations of the amplitude sum to about two thirds of n.
        let wanted = if grain == 1 { 1.0 } else { 0.67 * grain as f64 };
        assert!((found[0] / wanted - 1.0).abs() < 0.25, "{grain}: {found:?}");
        assert!((found[1] - 1.0).abs() < 0.05 && (found[2] - 1.0).abs() < 0.05, "{grain}: {found:?}");
    }
}

#[test]
fn a_sweep_in_shadow_counts_less_than_the_others() {
    let mut sweeps: Vec<Vec<Vec<u8>>> = (1..=5).map(|seed| sweep(seed, 1)).collect();
    let clear = compound(&sweeps[1..]);
    // 12 dB, which takes three quarters of the amplitude.
    sweeps[0].iter_mut().flatten().for_each(|grey| *grey = grey.saturating_sub(51));
    let shadowed = compound(&sweeps);
    let level = |volume: &SpeckleVolume| mean_and_sd(&regions(&volume.volume)[0]).0;
    let lost = 1.0 - level(&shadowed) / level(&clear);
    // Counted like the others it would take 15 %.
    assert!((-0.01..0.075).contains(&lost), "{lost}");
}
