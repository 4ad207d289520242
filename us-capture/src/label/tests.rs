mod plus;
mod sequences;
mod truth;

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

fn shipped(name: &str) -> WirePhantom {
    WirePhantom::shipped(name).unwrap()
}
