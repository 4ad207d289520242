//! What a calibration's fit costs: 200 images of nine dots, the lag among the unknowns.
//!
//! There is no peer in Rust: the crate `levenberg-marquardt` (0.15) is built on nalgebra 0.34. By hand, scipy's
//! `least_squares` on PLUS's freehand dots (same residuals, weights and prior, vectorised, one thread): 11 lags in
//! 3.7 s and a last fit in 0.45 s, where ours takes 0.1 s for 41 lags and all; it finds 0.434 s, 78.64 x 74.02
//! micrometres, and 0.452 / 0.249 mm on the held-out half (ours: 0.438 s, 78.64 x 74.04, 0.450 / 0.246).
#![allow(missing_docs, reason = "criterion_group! writes functions without documentation")]
#![expect(clippy::unwrap_used, reason = "a benchmark may stop at the first surprise")]

#[path = "../tests/support/calibration_truth.rs"]
mod calibration_truth;

use std::hint::black_box;

use calibration_truth::{Capture, Dice, captured, zs};
use criterion::{Criterion, criterion_group, criterion_main};
use probepath_us_capture::fit::{FitOptions, Information, Lag, PhantomPlace, fit, linear_start};

fn fits(criterion: &mut Criterion) {
    let mut dice = Dice::new(1);
    let phantom = zs(&mut dice, 3, 1);
    let capture = Capture { images: 200, dot_px: 0.5, tracker: (1e-4, 1e-3), ..Capture::default() };
    let truth = captured(&mut dice, phantom, &capture);
    let options = FitOptions::new(truth.spacing, PhantomPlace::prior(truth.world_from_phantom));
    let run =
        |options: &FitOptions| fit(&truth.phantom, &truth.sightings, &truth.track, options, None).unwrap();

    let mut group = criterion.benchmark_group("calibration, 200 images of 9 dots");
    group.sample_size(20);
    group.bench_function("everything, lag between -1 and 1 s", |b| b.iter(|| run(black_box(&options))));
    let known = FitOptions { lag: Lag::Known(run(&options).lag), ..options };
    group.bench_function("lag known", |b| b.iter(|| run(black_box(&known))));
    group.bench_function("the linear start alone, 41 lags", |b| {
        b.iter(|| linear_start(&truth.phantom, &truth.sightings, &truth.track, black_box(&options)).unwrap())
    });
    let start = truth.probe_from_image;
    group.bench_function("expected standard error of a plan", |b| {
        b.iter(|| {
            let said =
                Information::of(&truth.phantom, &truth.sightings, &truth.track, &options, start).unwrap();
            said.expected().unwrap().standard_error_map(820, 616)
        })
    });
    group.finish();
}

criterion_group!(benches, fits);
criterion_main!(benches);
