//! What an image costs on its way into a volume (640 x 480 pixels of 0.1 mm into voxels of 0.3 mm), what filling the
//! holes of 131 million voxels costs, and what it costs to cut an image out. Peers: `benches/peers/volume.py`.
//!
//! `RAYON_NUM_THREADS=1 cargo bench -p probepath-recon --bench volume -- "640 x 480"` for figures of one core.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Image, Point, Pose, World};
use probepath_recon::volume::{
    Compounding, Grid, Holes, Interpolation, LiveVolume, Slice, Sticks, Swept, Volume, VolumeSettings,
    Weights,
};
use probepath_us_capture::{PixelMap, PixelSpacing};

const IMAGES: usize = 60;

fn pixels() -> Vec<u8> {
    (0..640 * 480_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

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

fn compounding(criterion: &mut Criterion) {
    let pixels = pixels();
    let slices = slices(&pixels);
    let mut group = criterion.benchmark_group("volume of 640 x 480 images, 0.3 mm");
    group.sample_size(10).throughput(Throughput::Elements(IMAGES as u64));
    let linear = VolumeSettings::every_mm(0.3);
    let nearest = VolumeSettings { weights: Weights::Nearest, ..linear.clone() };
    let sticks = Some(Holes::Sticks(Sticks { longest: 9, at_least: 1 }));
    let swept = Some(Holes::Swept(Swept { longest_m: 5e-3 }));
    for (name, settings) in [
        ("nearest, latest", VolumeSettings { compounding: Compounding::Latest, ..nearest.clone() }),
        ("nearest, mean", nearest.clone()),
        ("nearest, median", VolumeSettings { compounding: Compounding::Median, ..nearest.clone() }),
        ("linear, mean", linear.clone()),
        ("nearest, mean, holes swept", VolumeSettings { holes: swept, ..nearest.clone() }),
        ("nearest, mean, holes by sticks", VolumeSettings { holes: sticks, ..nearest.clone() }),
    ] {
        let build = || Volume::build(black_box(&slices), &settings).expect("a volume");
        group.bench_function(name, |bencher| bencher.iter(build));
    }
    group.bench_function("nearest, mean, live", |bencher| {
        bencher.iter(|| {
            let mut live = LiveVolume::new(&nearest).expect("a volume");
            slices.iter().for_each(|slice| live.insert(black_box(slice)).expect("inserted"));
            live
        });
    });
    group.finish();
}

/// 131 million voxels: 640 x 480 pixels at the voxels' own size, every third layer of 427.
fn filling(criterion: &mut Criterion) {
    let pixels = pixels();
    let map = |image: usize| {
        let turn = 0.0005 * (image % 20) as f64;
        let first = Point::<World>::from_vector(Vector3::new(0.0, 0.0, 3e-4 * image as f64));
        PixelMap::new(first, Vector3::new(turn.cos(), 0.0, turn.sin()) * 1e-4, Vector3::y() * 1e-4)
    };
    let slices: Vec<Slice<'_>> = (0..143).map(|image| Slice::new(&pixels, 640, map(image))).collect();
    let grid =
        Grid { origin: Point::from_vector(Vector3::zeros()), spacing_m: [1e-4; 3], size: [640, 480, 427] };
    let mut group = criterion.benchmark_group("131 million voxels, two of three unseen");
    group.sample_size(10);
    let swept = Some(Holes::Swept(Swept { longest_m: 2e-3 }));
    let sticks = Some(Holes::Sticks(Sticks { longest: 9, at_least: 1 }));
    for (name, holes) in [("left open", None), ("swept", swept), ("sticks", sticks)] {
        let nearest = VolumeSettings { weights: Weights::Nearest, ..VolumeSettings::every_mm(0.1) };
        let settings = VolumeSettings { grid: Some(grid.clone()), holes, ..nearest };
        let build = || Volume::build(black_box(&slices), &settings).expect("a volume");
        group.bench_function(name, |bencher| bencher.iter(build));
    }
    group.finish();
}

fn cutting(criterion: &mut Criterion) {
    let pixels = pixels();
    let volume = Volume::build(&slices(&pixels), &VolumeSettings::every_mm(0.3)).expect("a volume");
    let turned = Isometry3::new(Vector3::new(0.01, 0.0, 0.01), Vector3::new(0.4, 0.3, 0.2));
    // FRAMES: any plane through the volume will do.
    let pose = Pose::<World, Image>::assume(turned);
    let spacing = PixelSpacing { x_m: 1e-4, y_m: 1e-4 };
    let mut group = criterion.benchmark_group("640 x 480 pixels cut out");
    for (name, interpolation) in [("nearest", Interpolation::Nearest), ("linear", Interpolation::Linear)] {
        let cut = || volume.cut(black_box(&pose), spacing, (640, 480), interpolation).expect("a cut");
        group.bench_function(name, |bencher| bencher.iter(cut));
    }
    group.finish();
}

criterion_group!(benches, compounding, filling, cutting);
criterion_main!(benches);
