use std::path::PathBuf;

use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, open_file};
use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Point, Pose, Stamp};
use probepath_recon::Mesh;
use probepath_us_capture::{BScan, PixelSpacing, PlacedBScan, Setting};

use super::*;
use crate::report::StenosisRow;

const SIZE: (usize, usize) = (41, 33);

fn bscan(number: u64, spacing: PixelSpacing) -> PlacedBScan {
    let setting = Setting {
        depth_m: 0.07,
        focus_m: 0.045,
        window_top_m: 0.02,
        window_height_m: 0.03,
        window_width_m: 0.04,
        spacing,
    };
    let formed = Stamp::from_nanoseconds(50_000_000 * number as i64 + 1_250_000 * (number as i64 % 3));
    let pixels: Vec<u8> = (0..SIZE.0 * SIZE.1).map(|i| (i as u64 * 7 + number * 13) as u8).collect();
    let place = Isometry3::new(Vector3::new(0.0, 0.0, 1e-3 * number as f64), Vector3::zeros());
    PlacedBScan {
        bscan: BScan::new(number, (formed, formed), setting, SIZE, pixels).expect("as many pixels as said"),
        // FRAMES: made up for the test.
        world_from_probe: Pose::assume(place),
        // FRAMES: the same.
        world_from_image: Pose::assume(place),
        wrench: None,
    }
}

fn images() -> Vec<PlacedBScan> {
    (0..5).map(|number| bscan(number, PixelSpacing { x_m: 1e-4, y_m: 0.9e-4 })).collect()
}

fn study(images: &[PlacedBScan]) -> Study {
    Study::of("LEG-007", "left", Date::of_day("2026-11-23"), images)
}

fn findings() -> Vec<Finding> {
    let stenosis = StenosisRow {
        name: "S1".into(),
        segment: "SFA proximal".into(),
        percent_area: 79.5,
        percent_area_interval: [77.0, 82.0],
        percent_diameter: 54.7,
        percent_diameter_interval: [52.0, 57.6],
        grade: "50-99 %".into(),
        at_mm: 61.25,
        force_n: Some(5.0),
        length_mm: 18.5,
        min_area_mm2: 9.9,
        min_diameter_mm: 3.55,
        reference_area_mm2: 48.3,
        reference: "proximal normal segment, 40 to 50 mm".into(),
        ..StenosisRow::default()
    };
    vec![Finding { stenosis, place_mm: Some([1.5, 34.0, -61.25]) }]
}

/// A closed tube, a millimetre thick.
fn mesh() -> Mesh {
    let ring = |z: f64| {
        (0..7).map(move |k| {
            let angle = std::f64::consts::TAU * f64::from(k) / 7.0;
            Point::new(1e-3 * angle.cos(), 1e-3 * angle.sin(), z)
        })
    };
    let points: Vec<_> = ring(0.0).chain(ring(0.01)).collect();
    Mesh::tube(&points, (2, 7))
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("probepath-dicom-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the test");
    folder
}

fn text(file: &DefaultDicomObject, tag: dicom_core::Tag) -> String {
    file.element(tag).expect("there").to_str().expect("text").into_owned()
}

/// Writes one of each kind.
fn written(folder: &Path) -> [PathBuf; 3] {
    let (images, paths) = (images(), ["us.dcm", "stl.dcm", "sr.dcm"].map(|name| folder.join(name)));
    let study = study(&images);
    let frames = multi_frame(&images, &study, Some(false), &paths[0]).expect("written");
    assert_eq!((frames.count, frames.size, frames.notes.len()), (5, SIZE, 0));
    encapsulated_stl(&mesh(), &study, &paths[1]).expect("written");
    structured_report(&findings(), &["mind the gap".into()], &study, &paths[2]).expect("written");
    paths
}

#[test]
fn frames_regions_and_times_come_back_as_they_went_in() {
    let folder = folder("frames");
    let [us, ..] = written(&folder);
    let file = open_file(&us).expect("a DICOM file");
    assert_eq!(text(&file, tags::NUMBER_OF_FRAMES), "5");
    assert_eq!(text(&file, tags::BURNED_IN_ANNOTATION), "NO");
    assert_eq!(text(&file, tags::PATIENT_IDENTITY_REMOVED), "YES");
    let times = file.element(tags::FRAME_TIME_VECTOR).expect("there").to_multi_float64().expect("numbers");
    for (time, wanted) in times.iter().zip([0.0, 51.25, 51.25, 47.5, 51.25]) {
        assert!((time - wanted).abs() < 1e-9, "{times:?}");
    }
    let regions = file.element(tags::SEQUENCE_OF_ULTRASOUND_REGIONS).expect("there").items().expect("items");
    let delta = |tag| regions[0].element(tag).expect("there").to_float64().expect("a number");
    assert!((delta(tags::PHYSICAL_DELTA_X) - 0.01).abs() < 1e-12, "cm");
    assert!((delta(tags::PHYSICAL_DELTA_Y) - 0.009).abs() < 1e-12, "cm");
    assert!((delta(tags::REFERENCE_PIXEL_PHYSICAL_VALUE_Y) - 2.0).abs() < 1e-12, "cm");
    let pixels = file.element(tags::PIXEL_DATA).expect("there").to_bytes().expect("bytes");
    let all: Vec<u8> = images().iter().flat_map(|image| image.bscan.pixels().to_vec()).collect();
    assert_eq!(&pixels[..all.len()], &all[..]);
    assert_eq!(pixels.len(), all.len().next_multiple_of(2));
    std::fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn the_same_exam_gives_the_same_bytes_and_another_other_uids() {
    let (one, other) = (folder("same-1"), folder("same-2"));
    let (a, b) = (written(&one), written(&other));
    for (a, b) in a.iter().zip(&b) {
        assert!(std::fs::read(a).expect("there") == std::fs::read(b).expect("there"), "{}", a.display());
    }
    let uids: Vec<String> =
        a.iter().map(|path| text(&open_file(path).expect("a file"), tags::STUDY_INSTANCE_UID)).collect();
    assert!(uids.iter().all(|uid| uid == &uids[0]), "{uids:?}");
    let mut changed = images();
    changed[2].bscan.number = 77;
    assert_ne!(study(&changed).uid("study", &[]), uids[0]);
    [one, other].iter().for_each(|folder| std::fs::remove_dir_all(folder).expect("removed"));
}

#[test]
fn a_uid_is_a_uuid_of_our_own_kind_in_decimal() {
    let images = images();
    let study = study(&images);
    for i in 0..1000_u32 {
        let uid = study.uid("kind", &i.to_le_bytes());
        let number: u128 = uid.strip_prefix("2.25.").expect("the arc").parse().expect("a decimal number");
        assert!(uid.len() <= 64 && (number >> 76) & 0xf == 8 && (number >> 62) & 0x3 == 2, "{uid}");
    }
}

#[test]
fn two_settings_are_no_one_image_and_no_date_is_no_report() {
    let folder = folder("refused");
    let mut mixed = images();
    mixed.push(bscan(5, PixelSpacing { x_m: 2e-4, y_m: 0.9e-4 }));
    let path = folder.join("x.dcm");
    let refused = multi_frame(&mixed, &study(&mixed), None, &path);
    assert!(matches!(refused, Err(DicomError::Mixed { number: 5, .. })), "{refused:?}");
    assert!(matches!(multi_frame(&[], &study(&[]), None, &path), Err(DicomError::NoImages)));
    let undated = Study::of("LEG-007", "left", None, &images());
    assert!(matches!(structured_report(&[], &[], &undated, &path), Err(DicomError::NoDate)));
    let unknown = multi_frame(&images(), &undated, None, &path).expect("written");
    assert!(unknown.notes[0].contains("look for names"), "{:?}", unknown.notes);
    assert!(open_file(&path).expect("a file").element(tags::BURNED_IN_ANNOTATION).is_err());
    std::fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn decimal_strings_are_short_enough_for_dicom() {
    let values =
        [(0.0, "0"), (51.25, "51.25"), (-0.00001, "0"), (100.0, "100"), (1e12 / 3.0, "3.33333333e11")];
    for (value, wanted) in values {
        assert_eq!(decimal(value), wanted);
    }
    assert!(decimal(-f64::MAX).len() <= 16);
}

#[test]
fn pydicom_reads_what_was_written() {
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!("skipped: PROBEPATH_PYTHON names no Python with pydicom (tests/run installs one)");
        return;
    };
    let folder = folder("strangers");
    let paths = written(&folder);
    mesh().write(&folder.join("lumen.stl")).expect("written");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/interop/dicom.py");
    let done = std::process::Command::new(python).arg(script).args(paths).output().expect("a process");
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    eprintln!("{said}");
    std::fs::remove_dir_all(folder).expect("removed");
}
