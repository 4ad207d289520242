//! The command line: exit codes, one JSON document on standard output, Ctrl-C in the middle of a scan.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use probepath_us_capture::exam::{Ending, Exam};

fn probepath(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_probepath")).args(arguments).output().unwrap()
}

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-command-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn done_is_zero_failed_is_one_and_wrong_usage_is_two() {
    assert_eq!(probepath(&["arm", "ur5e"]).status.code(), Some(0));
    let failed = probepath(&["arm", "no-such.urdf"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("no-such.urdf"));
    assert_eq!(probepath(&["arm"]).status.code(), Some(2));
    assert_eq!(probepath(&["validate", "table9"]).status.code(), Some(2));
}

#[test]
fn json_is_one_document_on_standard_output() {
    let out = probepath(&["arm", "ur5e", "--joints-deg", "0,-90,90,-90,-90,0", "--json"]);
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(document["joints"].as_array().unwrap().len(), 6);
    // The reference of the field: tool0 at (+0.492, +0.133, 0.488) for (0, -1.57, 1.57, -1.57, -1.57, 0).
    let x = document["forward"]["position_mm"][0].as_f64().unwrap();
    assert!((x - 492.0).abs() < 1.0, "{x}");
}

#[test]
fn a_sequence_without_a_calibration_is_answered_with_the_option_it_needs() {
    let out = folder("sequence");
    std::fs::write(out.join("x.igs.mha"), "ObjectType = Image\n").unwrap();
    let input = out.join("x.igs.mha");
    let failed = probepath(&["reconstruct", input.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("--calibration"));
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn nothing_is_converted_between_things_of_different_kinds() {
    let failed = probepath(&["convert", "a.stl", "b.nrrd"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("no way from a.stl to b.nrrd"));
}

#[test]
fn a_wish_of_a_calibration_that_cannot_be_is_wrong_usage() {
    let wrong = [
        ("--region", "1,2,3", "27,27,766,562"),
        ("--pixel-mm", "0.000078", "0.078"),
        ("--phantom-to-reference", "1,2", "x,y,z"),
        ("--place", "somewhere", "unknown"),
        ("--scale", "big", "estimated"),
        ("--fan", "1,2,3,4,5", "six numbers"),
        ("--orientation", "XX", "MF"),
    ];
    for (option, value, said) in wrong {
        let asked = ["calibrate", "spatial", "x.igs.mha", "--phantom", "fcal-1.2", option, value];
        let out = probepath(&asked);
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(2) && text.contains(said), "{option}: {text}");
    }
    assert_eq!(probepath(&["calibrate", "spatial", "x.igs.mha"]).status.code(), Some(2));
}

#[test]
fn a_calibration_that_fails_says_so_in_one_document() {
    let out = probepath(&["calibrate", "spatial", "no-such.igs.mha", "--phantom", "fcal-1.2", "--json"]);
    assert_eq!(out.status.code(), Some(1));
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(document["error"].as_str().unwrap().contains("no-such.igs.mha"), "{document}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_in_the_middle_of_a_scan_leaves_the_arm_at_rest_and_the_exam_readable() {
    let out = folder("ctrl-c");
    let mut scan = Command::new(env!("CARGO_BIN_EXE_probepath"))
        .args(["scan", "--out", out.to_str().unwrap()])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(scan.stderr.take().unwrap()).lines();
    // "Planned …": the replay begins now.
    assert!(said.by_ref().map_while(Result::ok).any(|line| line.starts_with("Planned")));
    assert!(Command::new("kill").args(["-INT", &scan.id().to_string()]).status().unwrap().success());
    let rest: Vec<String> = said.map_while(Result::ok).collect();
    assert_eq!(scan.wait().unwrap().code(), Some(1), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("stopped by the operator")), "{rest:?}");
    let exam = Exam::open(&out.join("exam.mcap")).unwrap();
    assert_eq!(exam.ending, Ending::Complete);
    let last: Vec<_> = exam.ticks.iter().rev().take(3).map(|tick| tick.commanded).collect();
    assert!(last.iter().all(|commanded| *commanded == last[0]), "{last:?}");
    std::fs::remove_dir_all(out).unwrap();
}

#[test]
fn the_real_spine_becomes_a_volume() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/plus");
    let sequence = format!("{data}/SpinePhantomFreehand.igs.mha");
    if !std::path::Path::new(&sequence).is_file() {
        eprintln!("skipped: {sequence} is not there");
        return;
    }
    let config = format!("{data}/PlusDeviceSet_VolumeReconstructionOnly_SonixRP_TRUS_D70mm_NN_LATE.xml");
    let out = folder("spine");
    let made = probepath(&[
        "reconstruct",
        &sequence,
        "--calibration",
        &config,
        "--volume",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
    let document: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
    assert_eq!(document["images"]["total"], 21);
    let ours = probepath_recon::volume::Volume::read(&out.join("volume.mha"), 1 << 30).unwrap();
    let reference = format!("{data}/vtkVolumeReconstructorTestNNLATEvolumeRef.mha");
    let theirs = probepath_recon::volume::Volume::read(reference.as_ref(), 1 << 30).unwrap();
    assert_eq!(ours.grid().size, theirs.grid().size);
    let found = ours.correlation(&theirs).unwrap();
    assert!(found.pearson.unwrap() >= 0.985, "{found:?}");
    std::fs::remove_dir_all(out).unwrap();
}
