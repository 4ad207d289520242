//! Volumes on disk: read back equal by us, by SimpleITK and by pynrrd; what is damaged is refused.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop at the first surprise")]

use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::volume::{
    Compounding, Grid, Holes, Layer, Slice, Sticks, Volume, VolumeSettings, Weights,
};
use probepath_us_capture::PixelMap;
use probepath_us_capture::sequence::{Format, Header, SequenceError};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use serde_json::json;
use sha2::{Digest, Sha256};

fn seeded(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

/// A small volume on a grid of odd numbers, partly seen, partly filled.
fn volume() -> impl Strategy<Value = Volume> {
    let size = [1_usize..9, 1_usize..7, 1_usize..6];
    let spacing = prop_oneof![Just([3e-4; 3]), [1e-4..2e-3, 1e-4..2e-3, 1e-4..2e-3]];
    let origin = [-0.3..0.3, -0.3..0.3, -2.0..2.0_f64];
    (size, spacing, origin, proptest::collection::vec(any::<u8>(), 20)).prop_map(
        |(size, spacing_m, origin, pixels)| {
            let grid = Grid { origin: Point::from_vector(Vector3::from(origin)), spacing_m, size };
            let first = Point::<World>::from_vector(grid.origin.vector() - Vector3::repeat(2e-4));
            let map = PixelMap::new(first, Vector3::new(7e-4, 1e-4, 2e-4), Vector3::new(-1e-4, 8e-4, 5e-4));
            let settings = VolumeSettings {
                grid: Some(grid),
                weights: Weights::Linear,
                compounding: Compounding::Mean,
                holes: Some(Holes::Sticks(Sticks { longest: 4, at_least: 1 })),
                ..VolumeSettings::every_mm(1.0)
            };
            Volume::build(&[Slice::new(&pixels, 5, map)], &settings).expect("a volume")
        },
    )
}

/// Files hold millimetres to 1e-9.
fn same_place(a: &Grid, b: &Grid) -> bool {
    let spacing = a.spacing_m.iter().zip(&b.spacing_m).all(|(a, b)| (a - b).abs() < 1e-12);
    a.size == b.size && a.origin.distance(&b.origin) < 2e-12 && spacing
}

fn assembled(bytes: &[u8]) -> Result<Volume, SequenceError> {
    let header = Header::parse(bytes)?;
    Volume::assemble(&header, bytes.get(header.payload_at..).unwrap_or_default(), 1 << 20)
}

proptest! {
    #![proptest_config(seeded(300))]

    #[test]
    fn volumes_come_back_equal(volume in volume()) {
        let marks: Vec<u8> = volume.marks().iter().map(|mark| *mark as u8).collect();
        for format in [Format::MetaImage, Format::Nrrd] {
            for (layer, voxels) in [(Layer::Grey, volume.grey()), (Layer::Marks, &marks[..])] {
                let bytes = volume.to_bytes(format, layer);
                let read = assembled(&bytes).expect("a volume");
                prop_assert_eq!(read.grey(), voxels);
                prop_assert!(same_place(read.grid(), volume.grid()), "{:?} {:?}", read.grid(), volume.grid());
                prop_assert!(read.to_bytes(format, Layer::Grey) == bytes, "written again it is the same file");
            }
        }
    }

    #[test]
    fn damaged_volumes_are_refused_or_whole(
        volume in volume(),
        nrrd in any::<bool>(),
        edits in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..4),
    ) {
        let format = if nrrd { Format::Nrrd } else { Format::MetaImage };
        let mut bytes = volume.to_bytes(format, Layer::Grey);
        for (at, byte, cut) in edits {
            let at = at.index(bytes.len());
            if cut { bytes.truncate(at.max(1)) } else { bytes[at] = byte }
        }
        if let Ok(read) = assembled(&bytes) {
            prop_assert_eq!(Some(read.grey().len()), read.grid().voxels());
        }
    }
}

fn changed(format: Format, from: &str, to: &str) -> SequenceError {
    let grid = Grid { origin: Point::from_vector(Vector3::zeros()), spacing_m: [5e-4; 3], size: [4, 3, 2] };
    let settings = VolumeSettings { grid: Some(grid), ..VolumeSettings::every_mm(1.0) };
    let map = PixelMap::<World>::new(
        Point::from_vector(Vector3::zeros()),
        Vector3::x() * 5e-4,
        Vector3::y() * 5e-4,
    );
    let bytes =
        Volume::build(&[Slice::new(&[9; 12], 4, map)], &settings).unwrap().to_bytes(format, Layer::Grey);
    let header = Header::parse(&bytes).unwrap();
    let text = std::str::from_utf8(&bytes[..header.payload_at]).unwrap();
    assert!(text.contains(from), "{text}");
    let changed = [text.replacen(from, to, 1).as_bytes(), &bytes[header.payload_at..]].concat();
    assembled(&changed).expect_err(to)
}

#[test]
fn volumes_of_another_kind_are_refused_with_the_key() {
    let meta = [
        ("DimSize = 4 3 2", "DimSize = 10000 10000 10000"),
        ("DimSize = 4 3 2", "DimSize = 18446744073709551615 3 2"),
        ("DimSize = 4 3 2", "DimSize = 4 3 0"),
        ("DimSize = 4 3 2", "DimSize = 4 3"),
        ("ElementType = MET_UCHAR", "ElementType = MET_SHORT"),
        ("ElementType = MET_UCHAR\n", ""),
        ("ElementSpacing = 0.5 0.5 0.5", "ElementSpacing = 0.5 nan 0.5"),
        ("ElementSpacing = 0.5 0.5 0.5", "ElementSpacing = 0.5 -0.5 0.5"),
        ("ElementSpacing = 0.5 0.5 0.5\n", ""),
        ("Offset = 0 0 0\n", ""),
        ("TransformMatrix = 1 0 0 0 1 0 0 0 1", "TransformMatrix = 0 1 0 1 0 0 0 0 1"),
        ("TransformMatrix = 1 0 0 0 1 0 0 0 1", "Rotation = 0 1 0 1 0 0 0 0 1"),
        ("domain domain domain", "domain domain list"),
        ("CompressedDataSize = ", "CompressedDataSize = 1"),
    ];
    let nrrd = [
        ("space: left-posterior-superior\n", ""),
        ("space: left-posterior-superior", "space: right-anterior-superior"),
        ("(0.5,0,0)", "(0.5,0.1,0)"),
        ("\"mm\" \"mm\" \"mm\"", "\"m\" \"m\" \"m\""),
        ("type: uint8", "type: short"),
        ("sizes: 4 3 2", "sizes: 4 3 3"),
        ("encoding: gzip", "encoding: bzip2"),
    ];
    for (from, to) in meta {
        eprintln!("{from:?} -> {to:?}: {}", changed(Format::MetaImage, from, to));
    }
    for (from, to) in nrrd {
        eprintln!("{from:?} -> {to:?}: {}", changed(Format::Nrrd, from, to));
    }
}

fn expected(file: &str, voxels: &[u8], grid: &Grid) -> serde_json::Value {
    let sha256: String = Sha256::digest(voxels).iter().map(|b| format!("{b:02x}")).collect();
    json!({
        "file": file,
        "size": grid.size,
        "sha256": sha256,
        "spacing_mm": grid.spacing_m.map(|s| s * 1e3),
        "origin_mm": grid.origin.vector().iter().map(|x| x * 1e3).collect::<Vec<_>>(),
    })
}

#[test]
fn simpleitk_and_pynrrd_read_our_volumes() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("volume-interop");
    std::fs::create_dir_all(&folder).unwrap();
    let mut runner = TestRunner::new(seeded(1));
    let mut all = Vec::new();
    for case in 0..30 {
        let volume = volume().new_tree(&mut runner).unwrap().current();
        let marks: Vec<u8> = volume.marks().iter().map(|mark| *mark as u8).collect();
        for ending in ["mha", "nrrd"] {
            let (grey, worth) = (format!("{case:02}.{ending}"), format!("{case:02}-marks.{ending}"));
            volume.write(&folder.join(&grey), Layer::Grey).unwrap();
            volume.write(&folder.join(&worth), Layer::Marks).unwrap();
            all.push(expected(&grey, volume.grey(), volume.grid()));
            all.push(expected(&worth, &marks, volume.grid()));
            let read = Volume::read(&folder.join(&grey), 1 << 20).unwrap();
            assert_eq!(read.grey(), volume.grey());
        }
    }
    let wanted: PathBuf = folder.join("expected.json");
    std::fs::write(&wanted, json!({ "volumes": all }).to_string()).unwrap();
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
