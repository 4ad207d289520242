mod plus;

use nalgebra::{Matrix2, Vector3};
use probepath_frames::Point;

use super::Labels;
use crate::dots::Dot;
use crate::phantom::{Wire, WirePhantom};

/// A dot that remembers in its mass which wire made it.
fn named_dot(at_px: [f64; 2], sd_px: f64, wire: Option<usize>) -> Dot {
    Dot {
        at_px,
        covariance_px2: Matrix2::identity() * sd_px * sd_px,
        spread_px2: Matrix2::identity() * 4.0,
        peak: 200.0,
        mass: wire.map_or(1e4, |w| w as f64),
        cut: false,
    }
}

/// How many wires were given the dot of another wire.
fn wrong_wires(labels: &Labels) -> usize {
    let wrong =
        |(wire, dot): (usize, &Option<Dot>)| dot.is_some_and(|d| d.mass < 1e4 && d.mass as usize != wire);
    labels.dots.iter().enumerate().filter(|w| wrong(*w)).count()
}

/// A phantom of wires given in millimetres: front, back.
fn phantom(name: &str, wires_mm: &[[f64; 6]]) -> WirePhantom {
    let wire = |(i, w): (usize, &[f64; 6])| Wire {
        name: format!("{}", i + 1),
        front: Point::from_vector(Vector3::new(w[0], w[1], w[2]) * 1e-3),
        back: Point::from_vector(Vector3::new(w[3], w[4], w[5]) * 1e-3),
    };
    let wires = wires_mm.iter().enumerate().map(wire).collect();
    WirePhantom { name: name.into(), wires, zs: Vec::new(), landmarks: Vec::new() }
}

/// PLUS's fCal 1.2: three Ns.
fn fcal_1_2() -> WirePhantom {
    let rows = [
        [20.0, 20.0, 40.0, 25.0, 45.0, 45.0, 10.0],
        [20.0, 20.0, 25.0, 45.0, 50.0, 50.0, 5.0],
        [20.0, 20.0, 45.0, 25.0, 50.0, 50.0, 0.0],
    ];
    let wires: Vec<[f64; 6]> =
        rows.iter().flat_map(|r| [0, 2, 4].map(|i| [r[i], 0.0, r[6], r[i + 1], 40.0, r[6]])).collect();
    phantom("fCal 1.2", &wires)
}

/// The three Ns of PLUS's stepper set.
fn stepper() -> WirePhantom {
    let rows = [
        [49.86, 49.86, 39.86, 19.86, 54.385],
        [49.86, 49.86, 19.86, 39.86, 34.385],
        [39.86, 39.86, 29.86, 19.86, 14.385],
    ];
    let wires: Vec<[f64; 6]> = rows
        .iter()
        .flat_map(|r| {
            [[r[0], r[1]], [r[2], r[3]], [9.86, 9.86]].map(|x| [x[0], r[4], 62.05, x[1], r[4], 142.05])
        })
        .collect();
    phantom("stepper", &wires)
}

#[allow(dead_code, reason = "used by the tests that follow")]
/// PLUS's fCal 1.0: two Ns, mapped onto itself by half turns.
fn fcal_1_0() -> WirePhantom {
    let rows = [[20.0, 20.0, 25.0, 45.0, 50.0, 50.0, 5.0], [20.0, 20.0, 45.0, 25.0, 50.0, 50.0, 0.0]];
    let wires: Vec<[f64; 6]> =
        rows.iter().flat_map(|r| [0, 2, 4].map(|i| [r[i], 0.0, r[6], r[i + 1], 40.0, r[6]])).collect();
    phantom("fCal 1.0", &wires)
}
