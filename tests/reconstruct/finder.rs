//! Another program in the place of the lumen finder: one that works, and those that do not.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use probepath_scripts::offline::{FinderWish, ReconstructWish, reconstruct};

use crate::bad::{IMAGES, drawn, sequence, wish};

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/examples/find_lumen.py");

/// Reads images and answers each with `ANSWER`, a Python expression of `number`.
const PROGRAM: &str = "
import json, math, sys, time
source = sys.stdin.buffer
assert json.loads(source.readline())['probepath_lumen'] == 1
def contour(turns):
    angles = [2 * math.pi * k * turns / 24 for k in range(24)]
    return [[320 + 60 * math.sin(a), 240 + 60 * math.cos(2 * a if turns == 1.5 else a)] for a in angles]
while line := source.readline():
    head = json.loads(line)
    number = head['number']
    assert len(source.read(head['bytes'])) == head['columns'] * head['rows']
    print(ANSWER, flush=True)
";

/// Whether there is a Python; where not, that is said.
fn python() -> bool {
    let name = std::env::var_os("PROBEPATH_PYTHON").unwrap_or_else(|| "python3".into());
    let there = Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success());
    if !there {
        eprintln!("skipped: there is no python3");
    }
    there
}

/// A wish with that program as finder.
fn with(name: &str, program: &str, seconds: f64) -> (PathBuf, ReconstructWish) {
    let (out, wish) = wish(name, &sequence(|_, pose, pixels| Some((pose, pixels))));
    fs::write(out.join("finder.py"), program).unwrap();
    let finder = FinderWish { program: out.join("finder.py"), seconds };
    (out, ReconstructWish { lumen: Some(finder), ..wish })
}

fn refused(name: &str, program: &str, seconds: f64) -> String {
    let (out, wish) = with(name, program, seconds);
    let error = reconstruct(&wish, &()).expect_err("no finder").to_string();
    fs::remove_dir_all(out).unwrap();
    error
}

#[test]
fn the_example_takes_the_finders_place_and_finds_the_open_lumen() {
    if !python() {
        return;
    }
    let (out, wish) = with("example", &fs::read_to_string(EXAMPLE).unwrap(), 60.0);
    let made = reconstruct(&wish, &()).unwrap();
    assert!(made.images.used >= IMAGES as usize - 2, "{made}");
    let report = made.report.unwrap();
    let areas: Vec<f64> = report.area_curve.iter().filter_map(|point| point.area_mm2).collect();
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    let truth = drawn().0.phantom.vessel().area(0.03) * 1e6;
    assert!((mean / truth - 1.0).abs() < 0.15, "{mean} instead of {truth}");
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn its_own_reasons_are_in_the_count_of_images() {
    if !python() {
        return;
    }
    let answer = "json.dumps({'number': number, 'none': 'too dark'} if number < 5 else {'number': number, \
                  'contours': [{'pixels': contour(1)}]})";
    let (out, wish) = with("reasons", &PROGRAM.replace("ANSWER", answer), 30.0);
    let made = reconstruct(&wish, &()).unwrap();
    assert_eq!(made.images.refused.get("too dark"), Some(&5), "{made}");
    assert_eq!(made.images.used, IMAGES as usize - 5);
    fs::remove_dir_all(out).unwrap();
}

#[test]
fn contours_that_cross_themselves_are_refused_image_by_image() {
    if !python() {
        return;
    }
    let answer = "json.dumps({'number': number, 'contours': [{'pixels': contour(1.5)}]})";
    let error = refused("crossed", &PROGRAM.replace("ANSWER", answer), 30.0);
    assert!(error.contains("0 of 18") && error.contains("no closed contour"), "{error}");
}

#[test]
fn what_is_no_answer_is_shown_with_what_is_wrong_with_it() {
    if !python() {
        return;
    }
    for (answer, word) in [
        ("'hello'", "expected value"),
        ("json.dumps({'number': number + 1, 'none': 'x'})", "it is for image 1"),
        ("json.dumps({'number': number})", "neither"),
        ("json.dumps({'number': number, 'contours': [{'pixels': contour(1)}] * 2})", "same vessel"),
        ("json.dumps({'number': number, 'lumen': []})", "unknown field"),
    ] {
        let error = refused("nonsense", &PROGRAM.replace("ANSWER", answer), 30.0);
        assert!(error.contains("finder.py") && error.contains("image 0") && error.contains(word), "{error}");
    }
}

#[test]
fn a_finder_that_dies_is_quoted_and_one_that_hangs_is_ended() {
    if !python() {
        return;
    }
    let error = refused("dies", "import sys\nsys.exit('no network: weights.bin is missing')", 30.0);
    assert!(error.contains("ended before it answered image 0"), "{error}");
    assert!(error.contains("weights.bin is missing") && error.contains("exit status: 1"), "{error}");
    let error = refused("hangs", &PROGRAM.replace("ANSWER", "time.sleep(600)"), 1.5);
    assert!(error.contains("within 1.5 s") && error.contains("--lumen-seconds"), "{error}");
    let error = refused("never", "", 0.0);
    assert!(error.contains("more than zero"), "{error}");
}

#[test]
fn a_finder_that_is_not_there_is_named() {
    let (out, wish) = with("absent", "", 30.0);
    let finder = FinderWish { program: out.join("no-such-finder"), seconds: 1.0 };
    let error = reconstruct(&ReconstructWish { lumen: Some(finder), ..wish }, &()).unwrap_err().to_string();
    assert!(error.contains("no-such-finder") && error.contains("cannot be started"), "{error}");
    fs::remove_dir_all(out).unwrap();
}
