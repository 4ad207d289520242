//! Signed distances as VTK has them.

use std::path::PathBuf;
use std::process::Command;

use nalgebra::Vector3;
use probepath_frames::{Point, World};
use probepath_recon::{Fit, Mesh, compare};

/// A closed, bent tube with a narrowing; `off` is added to the radius by row and place around (m).
fn tube(rows: usize, around: usize, off: impl Fn(usize, usize) -> f64) -> Mesh {
    let point = |row: usize, k: usize| -> Point<World> {
        let z = 0.1 * row as f64 / (rows - 1) as f64;
        let angle = std::f64::consts::TAU * k as f64 / around as f64;
        let r = 0.004 - 0.002 * (-((z - 0.04) / 0.006_f64).powi(2)).exp() + off(row, k);
        Point::from_vector(Vector3::new(r * angle.cos() + 0.01 * (z / 0.03).sin(), r * angle.sin(), z))
    };
    let points: Vec<_> =
        (0..rows).flat_map(|row| (0..around).map(move |k| (row, k))).map(|(r, k)| point(r, k)).collect();
    Mesh::tube(&points, (rows, around))
}

#[test]
fn vtk_has_the_same_distances_and_the_same_signs() {
    let Some(python) = std::env::var_os("PROBEPATH_PYTHON") else {
        eprintln!("skipped: PROBEPATH_PYTHON names no Python with vtk (tests/run installs one)");
        return;
    };
    let gold = tube(60, 30, |_, _| 0.0);
    let rough = |row: usize, k: usize| 1e-3 * ((row * 37 + k * 101) % 97) as f64 / 97.0 - 0.5e-3;
    let surface = tube(170, 24, rough);
    let found = compare(&surface, &gold, Fit::None).unwrap();
    let signed = found.signed_mm.unwrap();
    assert!(signed.iter().any(|d| *d < 0.0) && signed.iter().any(|d| *d > 0.0));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let paths = ["distances-gold.vtp", "distances-points.vtp"].map(|name| folder.join(name));
    gold.write(&paths[0]).unwrap();
    surface.with_scalars("signed_distance_mm", signed).write(&paths[1]).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/interop/distances.py");
    let done = Command::new(python).arg(script).args(paths).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    eprintln!("{said}");
}
