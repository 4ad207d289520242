//! What finding the dots of an image costs: nine wires in 820 x 616 pixels, beside the plain way (one threshold,
//! connected pieces, their centroids): `cargo bench -p probepath-us-capture --bench dots`.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use probepath_us_capture::dots::{DotFinder, DotSettings, Mask};

const WIDTH: usize = 820;
const HEIGHT: usize = 616;

/// Nine smeared wires; `noise` is the grey level of the noise's median.
fn image(noise: f64) -> Vec<u8> {
    let mut state = 1_u32;
    let mut level = |at: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let uniform = (f64::from(state >> 8) + 0.5) / f64::from(1 << 24);
        let noise = noise + noise.min(1.0) * 42.5 * (-uniform.ln()).log10();
        echo(at % WIDTH, at / WIDTH).max(noise).clamp(0.0, 255.0) as u8
    };
    (0..WIDTH * HEIGHT).map(&mut level).collect()
}

fn echo(u: usize, v: usize) -> f64 {
    let off = |at: usize, step: usize, spread: f64| ((at % step) as f64 - step as f64 / 2.0) / spread;
    let (x, y) = (off(u, WIDTH / 3, 8.0), off(v, HEIGHT / 3, 3.0));
    240.0 * (-0.5 * (x * x + y * y)).exp()
}

/// The peer: every pixel over a tenth of the brightest, connected pieces, centroids.
fn plain(pixels: &[u8]) -> Vec<[f64; 2]> {
    let level = pixels.iter().max().map_or(0, |p| p / 10);
    let mut open: Vec<bool> = pixels.iter().map(|p| *p > level).collect();
    let mut centres = Vec::new();
    let mut stack = Vec::new();
    for start in 0..pixels.len() {
        if std::mem::take(&mut open[start]) {
            stack.push(start);
            centres.push(centroid(pixels, &mut open, &mut stack));
        }
    }
    centres
}

fn centroid(pixels: &[u8], open: &mut [bool], stack: &mut Vec<usize>) -> [f64; 2] {
    let (mut mass, mut x, mut y) = (0.0, 0.0, 0.0);
    while let Some(at) = stack.pop() {
        let weight = f64::from(pixels[at]);
        (mass, x, y) = (mass + weight, x + weight * (at % WIDTH) as f64, y + weight * (at / WIDTH) as f64);
        for near in [at.wrapping_sub(1), at + 1, at.wrapping_sub(WIDTH), at + WIDTH] {
            if open.get_mut(near).is_some_and(std::mem::take) {
                stack.push(near);
            }
        }
    }
    [x / mass, y / mass]
}

fn dots(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dots of 820 x 616 pixels");
    group.sample_size(20);
    for (name, noise) in [("dark water", 0.0), ("noisy water", 40.0)] {
        let image = image(noise);
        let mut finder =
            DotFinder::new(DotSettings::default(), &Mask::whole(), WIDTH, HEIGHT).expect("a finder");
        group.bench_function(name, |bencher| {
            bencher.iter(|| finder.find(black_box(&image)).expect("dots").len());
        });
        let peer = format!("{name}, threshold and pieces");
        group.bench_function(peer, |bencher| bencher.iter(|| plain(black_box(&image)).len()));
    }
    group.finish();
}

criterion_group!(benches, dots);
criterion_main!(benches);
