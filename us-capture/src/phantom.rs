//! [`WirePhantom`]: the wires a spatial calibration looks at, as data.
//!
//! Any wires in any layout: the paper's 19 Zs in five rows, PLUS's N-wires, single wires. Everything is written in the
//! [`Phantom`] system, in metres.

use nalgebra::Vector3;
use probepath_frames::{Phantom, Point};

/// A straight wire between two plates. Beyond its ends there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Wire {
    /// Its name, as the phantom's file has it.
    pub name: String,
    /// Where it leaves the front plate.
    pub front: Point<Phantom>,
    /// Where it enters the back plate.
    pub back: Point<Phantom>,
}

/// Two side wires and the one that crosses between them, in one plane: the paper's Z-fiducial ([P1] eq. 2-4), PLUS's
/// N-wire. Indices into the phantom's wires; neighbouring Zs may share a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZFiducial {
    /// The first side.
    pub first: usize,
    /// The wire that crosses.
    pub diagonal: usize,
    /// The other side.
    pub last: usize,
}

/// A place on the phantom that a pointer can touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    /// Its name.
    pub name: String,
    /// Where the pointer's tip (a ball pointer: its centre) comes to rest.
    pub at: Point<Phantom>,
}

/// A phantom of wires.
#[derive(Clone, Debug, PartialEq)]
pub struct WirePhantom {
    /// Its name; a calibration is stored with it.
    pub name: String,
    /// Its wires, in the order in which dots are listed.
    pub wires: Vec<Wire>,
    /// Its Z-fiducials; empty for single wires.
    pub zs: Vec<ZFiducial>,
    /// Its landmarks.
    pub landmarks: Vec<Landmark>,
}

impl Wire {
    /// From the front plate to the back (m, in the phantom's axes).
    pub fn run(&self) -> Vector3<f64> {
        self.back.vector() - self.front.vector()
    }

    /// Its length (m).
    pub fn length_m(&self) -> f64 {
        self.front.distance(&self.back)
    }
}
