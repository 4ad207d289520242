//! What a calibration costs from images on: the dots and labels of one image of 820 x 616 pixels, and a calibration of
//! 200 images with everything in it: `cargo bench -p probepath-us-capture --bench spatial`.
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::expect_used, reason = "a benchmark may stop at the first surprise")]

#[path = "../tests/support/calibration_truth.rs"]
mod calibration_truth;
#[path = "../tests/support/drawn.rs"]
mod drawn;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use probepath_us_capture::dots::{DotFinder, DotSettings, Mask};
use probepath_us_capture::label::{LabelOptions, Labeller};
use probepath_us_capture::spatial::Spatial;

fn from_images(c: &mut Criterion) {
    let (mut dice, truth) = drawn::truth(1, 200);
    let shots = drawn::shots(&mut dice, &truth, 6);
    let options = drawn::options(&mut dice, &truth);
    let pixels = shots.shots()[0].pixels.as_ref().expect("a picture");
    let settings = DotSettings::for_spacing(truth.spacing);
    let mut finder =
        DotFinder::new(settings, &Mask::whole(), drawn::SIZE.0, drawn::SIZE.1).expect("a finder");
    let labeller = Labeller::new(&truth.phantom, LabelOptions::default());
    c.bench_function("one image: dots, and wires without any prediction", |bench| {
        bench.iter(|| {
            let dots = finder.find(black_box(pixels)).expect("dots");
            labeller.candidates(&dots, truth.spacing)
        });
    });
    let dots = finder.find(pixels).expect("dots");
    let labels = labeller.candidates(&dots, truth.spacing).expect("labels").swap_remove(0);
    c.bench_function("one image: dots, and wires near a prediction", |bench| {
        bench.iter(|| {
            let dots = finder.find(black_box(pixels)).expect("dots");
            labeller.near(&dots, &labels.phantom_from_image, truth.spacing, 2.5e-3)
        });
    });
    c.bench_function("a calibration of 200 images", |bench| {
        bench.iter(|| Spatial::calibrate(&shots, &truth.phantom, &options, &|_| {}));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = from_images
}
criterion_main!(benches);
