//! [`WirePhantom`]: the wires a spatial calibration looks at, as data.
//!
//! ```
//! use probepath_us_capture::phantom::WirePhantom;
//!
//! let phantom = WirePhantom::from_toml(r#"
//!     name = "one Z"
//!     wire = [
//!         { name = "left", front_mm = [0.0, 0.0, 0.0], back_mm = [0.0, 40.0, 0.0] },
//!         { name = "across", front_mm = [5.0, 0.0, 0.0], back_mm = [25.0, 40.0, 0.0] },
//!         { name = "right", front_mm = [30.0, 0.0, 0.0], back_mm = [30.0, 40.0, 0.0] },
//!     ]
//!     z = [{ wires = ["left", "across", "right"] }]
//! "#).unwrap();
//! assert!((phantom.wires[1].length_m() - 0.044721).abs() < 1e-6);
//! ```
//!
//! Any wires in any layout: the paper's 19 Zs in five rows, PLUS's N-wires, single wires. A [`Wire`] runs between two
//! plates, a [`ZFiducial`] is three of them in one plane, a [`Landmark`] can be touched. Everything is written in the
//! [`Phantom`](probepath_frames::Phantom) system, in metres. Phantoms come from our TOML, from the `PhantomDefinition`
//! of PLUS's XML, or ship with the project ([`WirePhantom::shipped`]).
//!
//! What it does not do: say where the phantom stands.

mod check;
mod error;
mod file;
mod shipped;

use std::path::Path;

use nalgebra::Vector3;
use probepath_frames::{Phantom, Point};

use crate::plus;
pub(crate) use check::{counts, same_place};
pub use error::{BadPhantom, Fault, Part};

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

impl WirePhantom {
    /// A phantom that can be one: every other way to a phantom ends here.
    ///
    /// # Errors
    /// With the part and what is wrong with it: fewer than three wires, a wire of no length, a number that is not
    /// finite or no phantom's, a name that is missing or there twice, two wires in one place; a Z whose wires are
    /// not three of the phantom's, not in one plane, whose sides are not parallel, or whose diagonal does not cross
    /// between them.
    pub fn new(
        name: impl Into<String>,
        wires: Vec<Wire>,
        zs: Vec<ZFiducial>,
        landmarks: Vec<Landmark>,
    ) -> Result<Self, BadPhantom> {
        let phantom = Self { name: name.into(), wires, zs, landmarks };
        check::check(&phantom)?;
        Ok(phantom)
    }

    /// Reads our TOML.
    ///
    /// # Errors
    /// When it is not one (a key missing, unknown or without its unit, a value of the wrong kind) or no phantom can
    /// be like that; with the line.
    pub fn from_toml(text: &str) -> Result<Self, BadPhantom> {
        file::from_toml(text)
    }

    /// The TOML text that [`WirePhantom::from_toml`] reads back.
    ///
    /// # Errors
    /// When its parts were changed into something that is no phantom.
    pub fn to_toml(&self) -> Result<String, BadPhantom> {
        check::check(self)?;
        file::to_toml(self)
    }

    /// Reads the `PhantomDefinition` of a PLUS configuration, or one that stands alone. The rest of the configuration
    /// may hold anything.
    ///
    /// # Errors
    /// When it is no XML, holds no phantom, or no phantom can be like that; with the line.
    pub fn from_plus_xml(text: &str) -> Result<Self, BadPhantom> {
        Ok(plus::phantom_of(text)?)
    }

    /// Reads a phantom file: our TOML or PLUS's XML, known by what is in it.
    ///
    /// # Errors
    /// When the disk refuses, it is no text, or neither kind holds a phantom.
    pub fn read(path: &Path) -> Result<Self, BadPhantom> {
        file::read(path)
    }

    /// The phantom of this name that ships with the project; [`WirePhantom::shipped_names`] lists them.
    pub fn shipped(name: &str) -> Option<Self> {
        shipped::text(name).and_then(|text| Self::from_toml(text).ok())
    }

    /// The names of the phantoms that ship with the project.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        shipped::names()
    }

    /// The wires of a Z: first side, diagonal, last side. `None` where it is not one of this phantom's.
    pub fn wires_of(&self, z: ZFiducial) -> Option<[&Wire; 3]> {
        Some([self.wires.get(z.first)?, self.wires.get(z.diagonal)?, self.wires.get(z.last)?])
    }
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

#[cfg(test)]
mod tests;
