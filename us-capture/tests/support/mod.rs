//! Random sequences, seeded.

#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use std::collections::BTreeMap;

use nalgebra::Matrix4;
use probepath_frames::Stamp;
use probepath_us_capture::sequence::{Sequence, SequenceImage, Status, Tracked, TransformName};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

/// So many cases, the same ones every time.
pub fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

fn status() -> impl Strategy<Value = Status> {
    prop_oneof![
        4 => Just(Status::Ok),
        2 => Just(Status::Invalid),
        1 => Just(Status::Other("OUT_OF_VIEW".into())),
        1 => Just(Status::Unsaid),
    ]
}

/// Numbers as trackers give them, and the ends of what a double can hold.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -300.0..300.0,
        2 => Just(0.0),
        1 => Just(-0.0),
        1 => -1e-80..1e-80,
        1 => Just(f64::MAX),
        1 => Just(5e-324),
    ]
}

fn tracked() -> impl Strategy<Value = Tracked> {
    (vec(number(), 16), status())
        .prop_map(|(numbers, status)| Tracked { matrix_mm: Matrix4::from_row_iterator(numbers), status })
}

fn transform_name() -> impl Strategy<Value = TransformName> {
    let system =
        || prop_oneof![Just("Probe"), Just("Tracker"), Just("Tool"), Just("StylusTip"), Just("Reference")];
    (system(), system()).prop_map(|(from, to)| TransformName::new(from, to))
}

fn stamp() -> impl Strategy<Value = Stamp> {
    prop_oneof![
        3 => (0..10_000_000_000_i64).prop_map(|us| us * 1000),
        2 => 1_600_000_000_000_000_000..1_800_000_000_000_000_000_i64,
        1 => -5_000_000_000..0_i64,
    ]
    .prop_map(Stamp::from_nanoseconds)
}

/// One line of anything, without blanks around it. ITK 2.5.7 takes `=`, `:` and what is not ASCII off its beginning.
fn value() -> impl Strategy<Value = String> {
    prop_oneof![3 => "[!-9;<>-~]([ -~]{0,40}[!-~])?", 1 => "[0-9]{1,6}", 1 => "[a-z]é[a-z]{1,6}"]
}

fn fields() -> impl Strategy<Value = BTreeMap<String, String>> {
    let key = prop_oneof![Just("FrameNumber".to_owned()), "My[A-Z][a-z0-9.-]{0,12}", "Force_[xyz]"];
    btree_map(key, value(), 0..4)
}

fn image(pixels: usize) -> impl Strategy<Value = SequenceImage> {
    let pixels = vec(any::<u8>(), pixels);
    let transforms = btree_map(transform_name(), tracked(), 0..4);
    (pixels, status(), option::of(stamp()), transforms, fields()).prop_map(
        |(pixels, status, stamp, transforms, fields)| SequenceImage {
            number: 0,
            pixels: Some(pixels.into()),
            status,
            stamp,
            transforms,
            fields,
        },
    )
}

fn with_fields(mut sequence: Sequence, fields: BTreeMap<String, String>) -> Sequence {
    for (key, value) in fields {
        sequence.set_field(key, value);
    }
    sequence
}

/// Pictures of any size.
pub fn pictures() -> impl Strategy<Value = Sequence> {
    let size = (1_usize..30, 1_usize..20).prop_filter("more than one pixel", |(w, h)| w * h > 1);
    let all = size.prop_flat_map(|(w, h)| (Just((w, h)), vec(image(w * h), 1..7), fields()));
    all.prop_map(|((width, height), images, fields)| {
        let mut sequence = Sequence::new(width, height);
        for (number, image) in (0..).zip(images) {
            sequence.push(SequenceImage { number, ..image }).expect("pixels of that size");
        }
        with_fields(sequence, fields)
    })
}

/// Poses without pictures, their numbers with gaps.
pub fn poses() -> impl Strategy<Value = Sequence> {
    (vec((image(0), 1_u64..4), 1..9), fields()).prop_map(|(images, fields)| {
        let (mut sequence, mut number) = (Sequence::new(0, 0), 0);
        for (image, step) in images {
            number += step;
            let stamp = image.stamp.or(Some(Stamp::ZERO));
            sequence.push(SequenceImage { number, pixels: None, stamp, ..image }).expect("no pixels");
        }
        with_fields(sequence, fields)
    })
}
