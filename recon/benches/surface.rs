//! From contours (300 x 64) to the closed surface, the centreline and 300 sections; and what a view costs while scanning.
//!
//! `benches/peers/surface.py` does the cutting alone with VTK, on a surface of the same size.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

use std::hint::black_box;
use std::path::PathBuf;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use probepath_frames::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Pose, Stamp};
use probepath_recon::{Contour, ImageLumen, LiveLumen, LumenFinder, LumenSettings, reconstruct_from};
use probepath_us_capture::{BScan, PixelSpacing, PlacedBScan, Setting};

const POINTS: usize = 64;
/// The vessel bends along an arc of this radius (m).
const ARC_M: f64 = 0.12;
const LENGTH_M: f64 = 0.15;

/// An image of four pixels: only its place and the size of its pixels (0.1 mm) are looked at.
fn image(number: u64, at: f64) -> PlacedBScan {
    let setting = Setting {
        depth_m: 0.06,
        focus_m: 0.03,
        window_top_m: 0.0,
        window_height_m: 0.06,
        window_width_m: 0.04,
        spacing: PixelSpacing { x_m: 1e-4, y_m: 1e-4 },
    };
    let bscan =
        BScan::new(number, (Stamp::ZERO, Stamp::ZERO), setting, (2, 2), vec![0; 4]).expect("four pixels");
    let (sin, cos) = (at / ARC_M).sin_cos();
    let place = Vector3::new(ARC_M * sin, 0.0, ARC_M * (1.0 - cos));
    // Columns along y, rows across the arc, the normal along it.
    let axes =
        Matrix3::from_columns(&[Vector3::y(), Vector3::new(-sin, 0.0, cos), Vector3::new(cos, 0.0, sin)]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    // FRAMES: the arc is drawn in the World, and the image lies across it.
    let world_from_image = Pose::assume(Isometry3::from_parts(Translation3::from(place), turn));
    // FRAMES: no probe takes part.
    let world_from_probe = Pose::assume(Isometry3::identity());
    PlacedBScan { bscan, world_from_probe, world_from_image, wrench: None }
}

/// A lumen with a stenosis of 75 % in its middle, its border off by 0.1 mm in a regular way.
fn lumen(image: &PlacedBScan, at: f64) -> ImageLumen {
    let off = (at - LENGTH_M / 2.0) / 0.01;
    let radius = 39.35 * (1.0 - 0.5 * (-off * off).exp());
    let point = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / POINTS as f64;
        let r = radius + (3.0 * angle + 1e4 * at).sin();
        (r * angle.cos(), r * angle.sin())
    };
    let lumen = Contour::new(image, (0..POINTS).map(point).collect(), vec![0.15; POINTS], 0.05);
    ImageLumen { number: image.bscan.number, lumen, others: Vec::new() }
}

fn sweep(count: usize) -> (Vec<PlacedBScan>, Vec<ImageLumen>) {
    let at = |i: usize| LENGTH_M * i as f64 / (count - 1) as f64;
    let images: Vec<PlacedBScan> = (0..count).map(|i| image(i as u64, at(i))).collect();
    let lumens = images.iter().enumerate().map(|(i, image)| lumen(image, at(i))).collect();
    (images, lumens)
}

/// The closed surface and the planes of 300 sections (centre and normal, mm), where the peers' script wants them.
fn write_for_peers() {
    let Some(folder) = std::env::var_os("PROBEPATH_BENCH_FILES").map(PathBuf::from) else { return };
    std::fs::create_dir_all(&folder).expect("a folder");
    let (_, lumens) = sweep(300);
    let found = reconstruct_from(&[], lumens, &LumenSettings::default()).expect("a vessel");
    found.closed_surface().write(&folder.join("lumen.ply")).expect("written");
    let planes = found.sections.iter().filter_map(|section| {
        let (c, n) = (section.centre.vector() * 1e3, section.normal.vector());
        let area = section.measure.as_ref()?.area_mm2;
        Some(format!("{},{},{},{},{},{},{area}\n", c.x, c.y, c.z, n.x, n.y, n.z))
    });
    std::fs::write(folder.join("planes.csv"), planes.collect::<String>()).expect("written");
}

fn surface(criterion: &mut Criterion) {
    write_for_peers();
    let mut group = criterion.benchmark_group("contours of 64 points to surface, centreline, 300 sections");
    group.sample_size(10);
    let settings = LumenSettings::default();
    for count in [300, 500, 1000, 2000, 4000] {
        let (_, lumens) = sweep(count);
        let made = |lumens: Vec<ImageLumen>| {
            let found = reconstruct_from(&[], lumens, &settings).expect("a vessel");
            (found.closed_surface(), found)
        };
        group.bench_with_input(BenchmarkId::from_parameter(count), &lumens, |bencher, lumens| {
            bencher.iter_batched(|| lumens.clone(), |lumens| made(black_box(lumens)), BatchSize::LargeInput);
        });
    }
    group.finish();
}

/// Gives the lumens that it was made with, one after another.
struct Known(std::vec::IntoIter<ImageLumen>);

impl LumenFinder for Known {
    fn find(&mut self, _: &PlacedBScan) -> ImageLumen {
        self.0.next().expect("as many as images")
    }
}

fn live(criterion: &mut Criterion) {
    let mut group =
        criterion.benchmark_group("the view after so many images, without the search for the lumen");
    group.sample_size(10);
    for count in [300, 1000, 4000] {
        let (images, lumens) = sweep(count);
        let known = Box::new(Known(lumens.into_iter()));
        let mut live = LiveLumen::with_finder(LumenSettings::default(), known).expect("settings");
        images.iter().for_each(|image| assert!(live.push(image).is_ok()));
        group.bench_function(BenchmarkId::from_parameter(count), |bencher| bencher.iter(|| live.view()));
    }
    group.finish();
}

criterion_group!(benches, surface, live);
criterion_main!(benches);
