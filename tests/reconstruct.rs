//! `probepath reconstruct` on tracked sequences: a simulated vessel whose lumen is known, and input that is not one.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

#[path = "reconstruct/bad.rs"]
mod bad;
#[path = "reconstruct/finder.rs"]
mod finder;
#[path = "common/sweep.rs"]
mod sweep;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use probepath_recon::{Fit, Mesh, compare};
use probepath_sim::settings;
use serde_json::Value;
use sweep::Sweep;

/// A folder of this test, empty.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("probepath-reconstruct-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn probepath(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_probepath")).args(arguments).output().unwrap()
}

/// `reconstruct SEQUENCE --calibration FILE --out DIR/made --json` and what more is asked for.
fn reconstruct(out: &Path, sequence: &str, calibration: &str, more: &[&str]) -> Output {
    let [sequence, calibration, made] =
        [sequence, calibration, "made"].map(|name| out.join(name).display().to_string());
    let mut arguments =
        vec!["reconstruct", &sequence, "--calibration", &calibration, "--out", &made, "--json"];
    arguments.extend(more);
    probepath(&arguments)
}

fn document(out: &Output) -> Value {
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

fn path(document: &Value, field: &str) -> PathBuf {
    PathBuf::from(document[field].as_str().unwrap_or_else(|| panic!("no {field} in {document:#}")))
}

/// Rows of a table of ours, by the names in its first line.
fn column(table: &Path, name: &str) -> Vec<Option<f64>> {
    let text = fs::read_to_string(table).unwrap();
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|field| field == name).unwrap();
    lines.map(|line| line.split(',').nth(at).unwrap().parse().ok()).collect()
}

/// The first stenosis of the phantom (80 % of the area at 49.8 mm) and the normal lumen before it.
const FROM_M: f64 = 0.024;
const UNTIL_M: f64 = 0.068;

#[test]
fn a_tracked_sweep_and_its_calibration_become_surface_centreline_sections_and_the_stenosis() {
    let out = folder("sweep");
    let sweep = Sweep::new(settings::zoomed(0.07, 0.045, 0.03, 0.034), 3);
    sweep.sequence(FROM_M, UNTIL_M, 0.5e-3).write(&out.join("sweep.igs.mha")).unwrap();
    sweep.calibration().write(&out.join("calibration.toml")).unwrap();
    fs::write(out.join("plus.xml"), sweep.plus_configuration()).unwrap();
    let made = document(&reconstruct(&out, "sweep.igs.mha", "calibration.toml", &["--volume"]));
    assert_eq!(made["images"]["total"], 89);
    let used = made["images"]["used"].as_u64().unwrap();
    let refused: u64 =
        made["images"]["refused"].as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum();
    assert!(used >= 85 && used + refused == 89, "{made:#}");
    near_the_truth(&sweep, &made, 0.25);
    sections_as_they_are(&sweep, &made);
    for stage in ["reading", "lumen", "surface", "report", "volume", "total"] {
        assert!(made["timing_s"][stage].as_f64().unwrap() > 0.0, "{stage} in {made:#}");
    }
    assert!(fs::metadata(made["volume"]["file"].as_str().unwrap()).unwrap().len() > 1000);
    // A PLUS configuration says no depth of the window and no focus: the lateral width is a guess.
    let made = document(&reconstruct(&out, "sweep.igs.mha", "plus.xml", &[]));
    near_the_truth(&sweep, &made, 0.30);
    fs::remove_dir_all(out).unwrap();
}

fn near_the_truth(sweep: &Sweep, made: &Value, most_mm: f64) {
    let surface = Mesh::read(&path(made, "surface")).unwrap();
    let gold = sweep.gold(FROM_M - 0.015, UNTIL_M + 0.015);
    let beside = compare(&surface, &gold, Fit::None).unwrap();
    assert!(beside.error.mean_mm < most_mm, "{:?}", beside.error);
    let stenoses = made["stenoses"].as_array().unwrap();
    assert_eq!(stenoses.len(), 1, "{made:#}");
    let percent = stenoses[0]["percent_area"].as_f64().unwrap();
    assert!((percent - 80.0).abs() < 4.0, "{percent}");
}

/// Places along the true vessel, areas beside the true ones.
fn sections_as_they_are(sweep: &Sweep, made: &Value) {
    let (sections, centreline) = (path(made, "sections"), path(made, "centreline"));
    let [x, y, z] = ["x_mm", "y_mm", "z_mm"].map(|name| column(&sections, name));
    assert_eq!(column(&centreline, "z_mm"), z);
    let areas = column(&sections, "area_mm2");
    let vessel = sweep.phantom.vessel();
    let (mut ratios, mut off) = (Vec::new(), Vec::new());
    for i in 0..areas.len() {
        let at = [&x, &y, &z].map(|column| column[i].unwrap() * 1e-3);
        let place = probepath_frames::Point::new(at[0], at[1], at[2]);
        let s = vessel.nearest(place);
        off.push(vessel.centre(s).distance(&place) * 1e3);
        ratios.extend(areas[i].map(|area| area * 1e-6 / vessel.area(s)));
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!(ratios.len() >= 80 && (mean(&ratios) - 1.0).abs() < 0.05, "{} {}", ratios.len(), mean(&ratios));
    assert!(mean(&off) < 0.1, "{}", mean(&off));
}
