//! What is written is what was there: read back by us, and by SimpleITK and pynrrd.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop at the first surprise")]

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::Matrix4;
use probepath_us_capture::sequence::{
    Header, ReadOptions, Sequence, SequenceError, SequenceImage, Status, Tracked, TransformName,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use support::{pictures, poses, seeded};

fn assembled(bytes: &[u8]) -> Sequence {
    let header = Header::parse(bytes).expect("a header");
    Sequence::assemble(&header, &bytes[header.payload_at..], &ReadOptions::default()).expect("a sequence")
}

/// Lines of the header, all of them short enough for PLUS.
fn check_lines(bytes: &[u8]) -> Result<(), TestCaseError> {
    let header = Header::parse(bytes).expect("a header");
    for line in bytes[..header.payload_at].split(|b| *b == b'\n') {
        prop_assert!(line.len() <= 1000, "{}", String::from_utf8_lossy(line));
    }
    Ok(())
}

fn same(written: &Sequence, read: &Sequence) -> Result<(), TestCaseError> {
    prop_assert_eq!((read.width(), read.height()), (written.width(), written.height()));
    prop_assert_eq!(read.images(), written.images());
    prop_assert_eq!(read.fields(), written.fields());
    Ok(())
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

proptest! {
    #![proptest_config(seeded(400))]

    #[test]
    fn sequences_of_any_kind_come_back_equal(sequence in prop_oneof![3 => pictures(), 1 => poses()]) {
        for bytes in [sequence.to_mha().unwrap(), sequence.to_nrrd().unwrap()] {
            check_lines(&bytes)?;
            same(&sequence, &assembled(&bytes))?;
        }
    }
}

proptest! {
    #![proptest_config(seeded(40))]

    #[test]
    fn sequences_come_back_equal_from_disk(sequence in prop_oneof![3 => pictures(), 1 => poses()]) {
        let folder = folder("sequence-round-trips");
        for name in ["one.igs.mha", "two.igs.mhd", "three.igs.nrrd"] {
            sequence.write(&folder.join(name)).unwrap();
            same(&sequence, &Sequence::read(&folder.join(name), &ReadOptions::default()).unwrap())?;
        }
    }
}

fn two(change: impl FnOnce(&mut SequenceImage)) -> Sequence {
    let mut sequence = Sequence::new(3, 2);
    let mut second = SequenceImage { number: 1, pixels: Some([7; 6].into()), ..SequenceImage::default() };
    change(&mut second);
    let first = SequenceImage { pixels: Some([9; 6].into()), status: Status::Ok, ..SequenceImage::default() };
    sequence.push(first).unwrap();
    sequence.push(second).unwrap();
    sequence
}

fn with_matrix(name: TransformName, number: f64, status: Status) -> Sequence {
    let tracked = Tracked { matrix_mm: Matrix4::from_element(number), status };
    two(|image| drop(image.transforms.insert(name, tracked)))
}

fn with_field(key: &str, value: &str) -> Sequence {
    two(|image| drop(image.fields.insert(key.into(), value.into())))
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let probe = || TransformName::new("Probe", "Tracker");
    let mut own_size = Sequence::new(3, 2);
    own_size.set_field("DimSize", "1 1 1");
    let mut of_an_image = Sequence::new(3, 2);
    of_an_image.set_field("Seq_Frame0000_Note", "x");
    let mut twice = Sequence::new(3, 2);
    twice.set_field("Note", "x");
    twice.set_field("Note", "y");
    let mut same_number = Sequence::new(0, 0);
    same_number.push(SequenceImage::default()).unwrap();
    same_number.push(SequenceImage::default()).unwrap();
    let mut one_pixel = Sequence::new(1, 1);
    one_pixel.push(SequenceImage { pixels: Some([5].into()), ..SequenceImage::default() }).unwrap();
    let refused = [
        with_matrix(TransformName::new("ProbeToTip", "Tracker"), 0.0, Status::Ok),
        with_matrix(TransformName::new("probe", "tracker"), 0.0, Status::Ok),
        with_matrix(TransformName::new("", "Tracker"), 0.0, Status::Ok),
        with_matrix(TransformName::new("Pro:be", "Tracker"), 0.0, Status::Ok),
        with_matrix(probe(), f64::NAN, Status::Ok),
        with_matrix(probe(), f64::INFINITY, Status::Unsaid),
        with_matrix(probe(), 1.0, Status::Other("OK".into())),
        with_field("Timestamp", "1.0"),
        with_field("ImageStatus", "OK"),
        with_field("ProbeToTrackerTransform", "1"),
        with_field("a=b", "1"),
        with_field("", "1"),
        with_field("Note", " x"),
        with_field("Note", "a\nb"),
        with_field("Note", "a\0b"),
        with_field("Note", &"x".repeat(990)),
        two(|image| image.status = Status::Other(String::new())),
        own_size,
        of_an_image,
        twice,
        same_number,
        one_pixel,
    ];
    for (case, sequence) in refused.iter().enumerate() {
        for written in [sequence.to_mha(), sequence.to_nrrd()] {
            let right = matches!(
                written,
                Err(SequenceError::Unwritable { .. } | SequenceError::UnwritableField { .. })
            );
            assert!(right, "case {case}: {sequence:?}");
        }
    }
}

#[test]
fn a_lost_pose_is_written_as_zeros_and_stays_invalid() {
    let sequence = with_matrix(TransformName::new("Probe", "Tracker"), f64::NAN, Status::Invalid);
    let read = assembled(&sequence.to_mha().unwrap());
    let tracked = read.images()[1].transforms.values().next().unwrap();
    assert_eq!((tracked.matrix_mm, &tracked.status), (Matrix4::zeros(), &Status::Invalid));
}

#[test]
fn a_missing_picture_is_black_and_invalid_never_a_picture() {
    let read = assembled(&two(|image| image.pixels = None).to_nrrd().unwrap());
    assert_eq!(read.images()[1].pixels.as_deref(), Some(&[0; 6][..]));
    assert_eq!(read.images()[1].status, Status::Invalid);
    assert!(read.images()[1].picture().is_none() && read.images()[0].picture().is_some());
}

#[test]
fn a_header_that_could_not_name_its_payload_is_refused() {
    let sequence = two(|_| ());
    let folder = folder("sequence-names");
    for name in ["with blank.mhd", "50%d.mhd"] {
        let written = sequence.write(&folder.join(name));
        assert!(matches!(written, Err(SequenceError::DataFileName { .. })), "{name}");
    }
    assert!(matches!(sequence.write(&folder.join("a.png")), Err(SequenceError::UnknownEnding { .. })));
    sequence.write(&folder.join("with blank.mha")).unwrap();
}

/// What a stranger should find in a file, from the sequence itself.
fn expected(file: &str, sequence: &Sequence) -> Value {
    let images = sequence.images().iter().map(|image| {
        let transforms = image.transforms.iter().map(|(name, tracked)| {
            let rows: Vec<f64> = tracked.matrix_mm.transpose().iter().copied().collect();
            json!({ "from": name.from, "to": name.to, "rows": rows, "status": tracked.status.word() })
        });
        json!({
            "number": image.number,
            "status": image.status.word(),
            "stamp_ns": image.stamp.map(|s| s.nanoseconds().to_string()),
            "transforms": transforms.collect::<Vec<_>>(),
            "fields": image.fields,
        })
    });
    let pixels: Vec<u8> =
        sequence.images().iter().filter_map(|i| i.pixels.as_deref()).flatten().copied().collect();
    let sha256: String = Sha256::digest(&pixels).iter().map(|b| format!("{b:02x}")).collect();
    json!({
        "file": file,
        "size": [sequence.width(), sequence.height(), sequence.images().len()],
        "sha256": sha256,
        "images": images.collect::<Vec<_>>(),
        "fields": sequence.fields().iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
    })
}

#[test]
fn simpleitk_and_pynrrd_read_what_we_write() {
    let folder = folder("sequence-interop");
    let mut runner = TestRunner::new(seeded(1));
    let mut all = Vec::new();
    for case in 0..60 {
        let strategy = prop_oneof![4 => pictures(), 1 => poses()];
        let sequence = strategy.new_tree(&mut runner).unwrap().current();
        for ending in ["mha", "mhd", "nrrd"] {
            let name = format!("{case:02}.igs.{ending}");
            sequence.write(&folder.join(&name)).unwrap();
            all.push(expected(&name, &sequence));
        }
    }
    let wanted = folder.join("expected.json");
    std::fs::write(&wanted, json!({ "sequences": all }).to_string()).unwrap();
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!(
            "skipped: PROBEPATH_PYTHON names no Python with SimpleITK and pynrrd (tests/run installs one)"
        );
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/interop/sequences.py");
    let done = Command::new(python).arg(script).arg(&wanted).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    eprintln!("{said}");
}
