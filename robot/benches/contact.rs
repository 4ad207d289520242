//! How long a tick of the contact takes: `cargo bench -p probepath-robot --bench contact`.

#![allow(clippy::expect_used, reason = "a bench stops at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use probepath_frames::nalgebra::Vector3;
use probepath_frames::{Span, Wrench};
use probepath_robot::{ContactLaw, ContactSettings, ContactWatch, Face};

const PERIOD: Span = Span::from_milliseconds(2);

/// A law that holds 5 N on a spring, and a sensor's noise of a simple kind.
fn contact(criterion: &mut Criterion) {
    let mut law = ContactLaw::new(ContactSettings::default(), PERIOD).expect("the default settings can be");
    let mut offset = 0.0;
    for _ in 0..5000 {
        offset = law.step(1000.0 * f64::max(offset, 0.0), 5.0);
    }
    let mut noise = 0.05;
    criterion.bench_function("contact law, a tick on the skin", |b| {
        b.iter(|| {
            noise = -noise;
            offset = law.step(black_box(1000.0 * offset + noise), 5.0);
            offset
        });
    });
    let mut watch = ContactWatch::new(Face::default(), Span::from_milliseconds(50), PERIOD);
    let wrench = Wrench::new(Vector3::new(0.2, -0.1, -5.0), Vector3::new(0.005, -0.01, 0.0));
    criterion.bench_function("pressure on the face, a tick", |b| b.iter(|| watch.step(black_box(&wrench))));
}

criterion_group!(benches, contact);
criterion_main!(benches);
