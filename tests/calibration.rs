//! Calibration from end to end, by the command: real data of PLUS beside what PLUS found, and drawn sequences whose
//! truth is known.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

#[path = "common/drawn.rs"]
mod drawn;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use drawn::Drawn;
use nalgebra::Matrix4;
use probepath_frames::Probe;
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::sequence::{ReadOptions, Sequence};
use probepath_us_capture::{Calibration, PixelMap};
use serde_json::Value;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/plus");

/// Files of PLUS's test data; `None`, said aloud, where they are not there.
fn data<const N: usize>(names: [&str; N]) -> Option<[String; N]> {
    let paths = names.map(|name| format!("{DATA}/{name}"));
    match paths.iter().find(|path| !Path::new(path).is_file()) {
        Some(missing) => {
            eprintln!("skipped: {missing} is not there");
            None
        }
        None => Some(paths),
    }
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-calibration-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn probepath(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_probepath")).args(arguments).output().unwrap()
}

fn document(arguments: &[&str]) -> Value {
    let out = probepath(arguments);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

fn number(document: &Value, path: &str) -> f64 {
    document.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} in {document:#}"))
}

/// The dots of every image, as `--dots` prints them.
fn dots(section: &Value) -> Vec<Option<Vec<Option<[f64; 2]>>>> {
    serde_json::from_value(section["dots"].clone()).unwrap()
}

/// The dots that PLUS found, image by image, in the phantom's order of wires.
fn of_plus(results: &str, section: &str) -> Vec<(usize, Vec<[f64; 2]>)> {
    let text = std::fs::read_to_string(results).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let section = document.descendants().find(|node| node.has_tag_name(section)).unwrap();
    let frames = section.children().filter(|node| node.has_tag_name("Frame"));
    let frame = |node: roxmltree::Node<'_, '_>| {
        let segmented = node.children().filter(|child| child.has_tag_name("SegmentedPoints"));
        let points = segmented.flat_map(|list| list.children()).filter(|point| point.has_tag_name("Point"));
        let dots = points.map(|point| {
            let mut at = point.attribute("Position").unwrap().split_whitespace().map(|x| x.parse().unwrap());
            [at.next().unwrap(), at.next().unwrap()]
        });
        (node.attribute("Index").unwrap().parse().unwrap(), dots.collect())
    };
    frames.map(frame).collect()
}

/// Holds our dots against those of PLUS: none more than 10 pixels off, 1.3 pixels RMS.
fn beside_plus(ours: &Value, results: &str, section: &str) {
    let ours = dots(ours);
    let (mut squares, mut count, mut worst) = (0.0, 0, 0.0_f64);
    for (image, theirs) in of_plus(results, section) {
        let Some(Some(found)) = ours.get(image) else { continue };
        if theirs.len() != found.len() {
            continue;
        }
        for (ours, theirs) in found.iter().zip(theirs) {
            let Some([u, v]) = ours else { continue };
            let off = (u - theirs[0]).hypot(v - theirs[1]);
            squares += off * off;
            count += 1;
            worst = worst.max(off);
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    assert!(
        count > 500 && rms <= 1.3 && worst <= 10.0,
        "{section}: {count} dots, {rms} px RMS, {worst} px worst"
    );
}

#[test]
fn the_real_fcal_phantom_is_calibrated_better_than_plus_did() {
    let Some([images, held_out, config, results]) = data([
        "fCal_Test_Calibration_3NWires.igs.mha",
        "fCal_Test_Validation_3NWires.igs.mha",
        "PlusDeviceSet_fCal_Sim_SpatialCalibration_1.2.xml",
        "FreehandCalibration3NWires.results.xml",
    ]) else {
        return;
    };
    let found = document(&[
        "calibrate",
        "spatial",
        &images,
        "--phantom",
        &config,
        "--validate",
        &held_out,
        "--dots",
        "--json",
    ]);
    assert_eq!(
        (&found["calibration"]["images"], &found["calibration"]["labelled"]),
        (&188.into(), &188.into())
    );
    assert_eq!((&found["validation"]["images"], &found["validation"]["labelled"]), (&94.into(), &94.into()));
    // PLUS: 1.247 and 0.808 mm.
    assert!(number(&found, "/validation/mid_mean95_mm") <= 0.58, "{:#}", found["validation"]);
    assert!(number(&found, "/validation/line_rms_mm") <= 0.32, "{:#}", found["validation"]);
    assert!((number(&found, "/lag_s") - 0.43).abs() <= 0.06, "{}", found["lag_s"]);
    assert!(number(&found, "/standard_error_mm/mean") < number(&found, "/standard_error_mm/p95"));
    // Ten calibrations of a tenth each scatter, and less than the 1 mm that the whole one promises to err.
    assert_eq!(found["repeatability"]["calibrations"], 10);
    let repeats_mm = number(&found, "/repeatability/c_rms_mm");
    assert!(repeats_mm > 0.0 && repeats_mm < 1.0, "{repeats_mm}");
    assert_eq!(found["plus"]["ImageToProbe"].as_array().unwrap().len(), 16);
    assert_eq!(found["dots"], found["calibration"]["dots"]);
    beside_plus(&found["calibration"], &results, "CalibrationData");
    beside_plus(&found["validation"], &results, "ValidationData");
}

#[test]
fn the_real_stepper_is_calibrated_better_than_plus_did() {
    let Some([images, held_out, config, results]) = data([
        "USTC_3NWires_RandomStepperMotionCalibration.igs.mha",
        "USTC_3NWires_RandomStepperMotionValidation.igs.mha",
        "PlusDeviceSet_iCal_SonixTouch_BlackTargetGuideStepper_1.1.xml",
        "UsTemplateCalibration_3NWires.results.xml",
    ]) else {
        return;
    };
    let place = "-29.7239,-79.1055,0";
    let found = document(&[
        "calibrate",
        "spatial",
        &images,
        "--phantom",
        &config,
        "--validate",
        &held_out,
        "--poses",
        "ProbeToStepperHome",
        "--phantom-to-reference",
        place,
        "--dots",
        "--json",
    ]);
    assert!(number(&found, "/calibration/labelled") >= 207.0, "{:#}", found["calibration"]["refused"]);
    assert!(number(&found, "/validation/labelled") >= 103.0, "{:#}", found["validation"]["refused"]);
    // PLUS: 2.153 and 1.208 mm.
    assert!(
        number(&found, "/validation/mid_mean95_mm") <= 1.90,
        "{:#}",
        found["validation"]["mid_mean95_mm"]
    );
    assert!(number(&found, "/validation/line_rms_mm") <= 1.10, "{:#}", found["validation"]["line_rms_mm"]);
    beside_plus(&found["calibration"], &results, "CalibrationData");
    beside_plus(&found["validation"], &results, "ValidationData");
}

#[test]
fn the_real_freehand_images_are_calibrated_in_blocks_of_ten() {
    let Some([images, phantom]) = data(["NwirePhantomFreehand.igs.mha", "NwirePhantomFreehand_phantom.xml"])
    else {
        return;
    };
    let out = folder("blocks");
    let whole = Sequence::read(images.as_ref(), &ReadOptions::default()).unwrap();
    let halves = [0, 1].map(|odd| {
        let mut half = Sequence::new(whole.width(), whole.height());
        for image in whole.images().iter().filter(|image| image.number / 10 % 2 == odd) {
            half.push(image.clone()).unwrap();
        }
        let path = out.join(format!("half{odd}.igs.mha"));
        half.write(&path).unwrap();
        path.display().to_string()
    });
    let [fit, test] = &halves;
    let found = document(&["calibrate", "spatial", fit, "--phantom", &phantom, "--validate", test, "--json"]);
    let labelled = number(&found, "/calibration/labelled") + number(&found, "/validation/labelled");
    assert!(labelled >= 74.0, "{labelled}: {:#}", found["calibration"]["refused"]);
    assert!(number(&found, "/validation/mid_mean95_mm") <= 0.46, "{:#}", found["validation"]);
    assert!(number(&found, "/validation/line_rms_mm") <= 0.34, "{:#}", found["validation"]);
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn the_real_water_tank_tells_its_lag() {
    let Some([images, poses]) = data([
        "WaterTankBottomTranslationVideoBuffer.igs.mha",
        "WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha",
    ]) else {
        return;
    };
    let found = document(&["calibrate", "temporal", &images, &poses, "--json"]);
    assert!((number(&found, "/lag_s") + 0.063).abs() <= 0.006, "{found:#}");
    assert!((0.0..0.01).contains(&number(&found, "/standard_error_s")), "{found:#}");
}

/// The largest distance, over the image, of where `found` puts a pixel from where it truly is (mm).
fn worst_mm(found: &Value, drawn: &Drawn) -> f64 {
    let numbers: Vec<f64> = serde_json::from_value(found["plus"]["ImageToProbe"].clone()).unwrap();
    let map = PixelMap::<Probe>::from_matrix_mm(&Matrix4::from_row_slice(&numbers)).unwrap();
    let (right, bottom) = (drawn.size.0 as f64 - 1.0, drawn.size.1 as f64 - 1.0);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom), (right / 2.0, bottom / 2.0)];
    let off = |(u, v)| map.at(u, v).distance(&(drawn.probe_from_image * drawn.spacing.point(u, v)));
    corners.into_iter().map(off).fold(0.0, f64::max) * 1e3
}

#[test]
fn a_drawn_sequence_gives_back_the_truth_it_was_drawn_from() {
    let out = folder("drawn");
    let drawn = Drawn::over(WirePhantom::shipped("fcal-1.2").unwrap());
    let [images, held_out, stored] =
        ["a.igs.mha", "b.igs.mha", "found.toml"].map(|name| out.join(name).display().to_string());
    drawn.sequence(60, 0.0).write(images.as_ref()).unwrap();
    drawn.sequence(30, 20.0).write(held_out.as_ref()).unwrap();
    let pictures = out.join("pictures").display().to_string();
    // The place as measured: half a millimetre beside the true one.
    let mut place = drawn.phantom_to_reference();
    place[(0, 3)] += 0.4;
    let place: Vec<String> = place.transpose().iter().map(f64::to_string).collect();
    let found = document(&[
        "calibrate",
        "spatial",
        &images,
        "--phantom",
        "fcal-1.2",
        "--validate",
        &held_out,
        "--pixel-mm",
        "0.135",
        "--phantom-to-reference",
        &place.join(","),
        "--overlay",
        &pictures,
        "--out",
        &stored,
        "--dots",
        "--json",
    ]);
    assert_eq!(
        (&found["calibration"]["labelled"], &found["validation"]["labelled"]),
        (&60.into(), &30.into())
    );
    assert!(worst_mm(&found, &drawn) < 0.15, "{} mm: {:#}", worst_mm(&found, &drawn), found["plus"]);
    assert!((number(&found, "/lag_s") - drawn.lag_s).abs() < 0.002, "{}", found["lag_s"]);
    assert!(number(&found, "/validation/line_rms_mm") < 0.1, "{:#}", found["validation"]);
    // A picture of every image, and the map of the error.
    assert_eq!(std::fs::read_dir(&pictures).unwrap().count(), 60 + 30 + 1);
    let kept = Calibration::read(stored.as_ref()).unwrap();
    assert!(kept.error.held_out && kept.phantom == "fcal-1.2", "{kept:?}");
    assert!(kept.probe_from_image.distance(&drawn.probe_from_image).0 < 1.5e-4);
    std::fs::remove_dir_all(out).unwrap();
}
