//! What an image costs on its way into a volume: 640 x 480 pixels of 0.1 mm into voxels of 0.3 mm.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::volume::{Compounding, Holes, Slice, Sticks, Volume, VolumeSettings, Weights};
use probepath_us_capture::PixelMap;

const IMAGES: usize = 60;

/// Images half a millimetre apart, slightly turned, of changing grey.
fn slices(pixels: &[u8]) -> Vec<Slice<'_>> {
    let map = |image: usize| {
        let turn = 0.002 * image as f64;
        let first = Point::<World>::from_vector(Vector3::new(0.0, 0.0, 5e-4 * image as f64));
        PixelMap::new(
            first,
            Vector3::new(1e-4 * turn.cos(), 0.0, 1e-4 * turn.sin()),
            Vector3::new(0.0, 1e-4, 0.0),
        )
    };
    (0..IMAGES).map(|image| Slice::new(pixels, 640, map(image))).collect()
}

fn volumes(criterion: &mut Criterion) {
    let pixels: Vec<u8> = (0..640 * 480_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let slices = slices(&pixels);
    let mut group = criterion.benchmark_group("volume of 640 x 480 images, 0.3 mm");
    group.sample_size(10).throughput(Throughput::Elements(IMAGES as u64));
    let plain = VolumeSettings::every_mm(0.3);
    let sticks = Some(Holes::Sticks(Sticks { longest: 9, at_least: 1 }));
    for (name, settings) in [
        (
            "nearest, latest",
            VolumeSettings { weights: Weights::Nearest, compounding: Compounding::Latest, ..plain.clone() },
        ),
        ("nearest, mean", VolumeSettings { weights: Weights::Nearest, ..plain.clone() }),
        ("linear, mean", plain.clone()),
        ("linear, mean, holes filled", VolumeSettings { holes: sticks, ..plain }),
    ] {
        let build = || Volume::build(black_box(&slices), &settings).expect("a volume");
        group.bench_function(name, |bencher| bencher.iter(build));
    }
    group.finish();
}

criterion_group!(benches, volumes);
criterion_main!(benches);
