//! What the lumen of a 640 x 480 image costs on one core: image by image as the tracker does it, and the whole sweep at
//! once, as `segment` does it, by image.
//!
//! With PROBEPATH_LUMEN_IMAGES=FOLDER it also writes the images (PGM) and the true areas (truth.csv) there, for
//! `benches/peers/lumen.py`.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use probepath_recon::{ImageLumen, LumenFinder, LumenSettings, Tracker, segment};
use probepath_us_capture::PlacedBScan;

#[path = "../src/phantom_images.rs"]
#[allow(dead_code, reason = "the tests' phantom has more than is drawn here")]
mod phantom_images;
use phantom_images::Phantom;

const IMAGES: u32 = 24;

/// A stenosis of 75 %, images a millimetre apart.
fn phantom() -> Phantom {
    Phantom { pixels: (640, 480), stenoses: vec![(12.0, 18.0, 0.75)], seed: 7, ..Phantom::default() }
}

fn true_area(phantom: &Phantom, image: &PlacedBScan) -> f64 {
    std::f64::consts::PI * phantom.radius_at(image.world_from_image.origin().vector().x * 1e3).powi(2)
}

fn write_for_peers(folder: &Path, images: &[PlacedBScan]) {
    std::fs::create_dir_all(folder).expect("the folder can be made");
    let (mut table, settings) = (String::from("image,true_area_mm2,column,row\n"), phantom().setting());
    for (number, image) in images.iter().enumerate() {
        let bscan = &image.bscan;
        let mut file = format!("P5\n{} {}\n255\n", bscan.width(), bscan.height()).into_bytes();
        file.extend_from_slice(bscan.pixels());
        std::fs::write(folder.join(format!("{number:03}.pgm")), file).expect("an image can be written");
        let row = (phantom().depth * 1e-3 - settings.window_top_m) / settings.spacing.y_m;
        let area = true_area(&phantom(), image);
        writeln!(table, "{number:03}.pgm,{area:.4},{},{row:.1}", bscan.width() / 2)
            .expect("memory is enough");
    }
    let spacing = settings.spacing;
    writeln!(table, "spacing_mm,{},{},", spacing.x_m * 1e3, spacing.y_m * 1e3).expect("memory is enough");
    std::fs::write(folder.join("truth.csv"), table).expect("the table can be written");
}

/// Mean error of the area (%), said beside the time: a fast answer that loses a third of the lumen is none.
fn area_error(images: &[PlacedBScan], found: &[ImageLumen]) -> f64 {
    let each = images.iter().zip(found).filter_map(|(image, found)| {
        Some(found.lumen.as_ref().ok()?.area_mm2 / true_area(&phantom(), image) - 1.0)
    });
    let errors: Vec<f64> = each.collect();
    100.0 * errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

fn lumens(criterion: &mut Criterion) {
    let images: Vec<PlacedBScan> = (0..IMAGES).map(|i| phantom().bscan(u64::from(i), f64::from(i))).collect();
    if let Ok(folder) = std::env::var("PROBEPATH_LUMEN_IMAGES") {
        write_for_peers(Path::new(&folder), &images);
    }
    let settings = LumenSettings::default();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let tracked = || -> Vec<ImageLumen> {
        let mut tracker = Tracker::new(settings.clone());
        images.iter().map(|image| tracker.find(black_box(image))).collect()
    };
    let swept = || one.install(|| segment(black_box(&images), &settings));
    let (live, batch) = (area_error(&images, &tracked()), area_error(&images, &swept()));
    let mut group = criterion.benchmark_group("lumens of 24 images of 640 x 480, one core");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(IMAGES)));
    group.bench_function(format!("tracker (mean area {live:+.1} %)"), |bencher| bencher.iter(tracked));
    group.bench_function(format!("whole sweep (mean area {batch:+.1} %)"), |bencher| bencher.iter(swept));
    group.finish();
}

criterion_group!(benches, lumens);
criterion_main!(benches);
