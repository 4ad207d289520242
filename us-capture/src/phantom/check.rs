//! Whether a phantom can be one.

use std::collections::HashMap;

use nalgebra::Vector3;
use probepath_frames::{Phantom, Point};

use super::error::{BadPhantom, Fault, Part};
use super::{Wire, WirePhantom, ZFiducial};

/// More wires, Zs or landmarks than this are no phantom's, and two in one place could not be looked for in good time.
const MOST: usize = 1000;
/// A phantom stands in a water bath and is written about a point near it.
const FARTHEST_MM: f64 = 2000.0;
/// A shorter wire is a point, or metres that were taken for millimetres.
const SHORTEST_MM: f64 = 1.0;
/// Two wires whose ends are nearer than this cannot both be there.
const SAME_PLACE_MM: f64 = 0.01;
/// Sides farther from parallel than this make no Z. A measured phantom's are off by tenths of a degree: 0.1 mm at
/// one end of 40 mm is 0.14 degrees.
const PARALLEL_DEG: f64 = 1.0;
/// How far a measured phantom's wires may be from the plane of their Z, and its diagonal outside of its sides.
const IN_PLANE_MM: f64 = 0.5;
/// Nearer sides make one dot.
const LEAST_WIDTH_MM: f64 = 1.0;

pub(super) fn check(phantom: &WirePhantom) -> Result<(), BadPhantom> {
    if phantom.name.trim().is_empty() {
        return Err(Fault::NoName.of(Part::Phantom));
    }
    counts(phantom.wires.len(), phantom.zs.len(), phantom.landmarks.len())?;
    if phantom.wires.len() < 3 {
        return Err(Fault::TooFewWires { found: phantom.wires.len() }.of(Part::Phantom));
    }
    names(phantom.wires.iter().map(|w| w.name.as_str()), Part::Wire)?;
    names(phantom.landmarks.iter().map(|l| l.name.as_str()), Part::Landmark)?;
    for (index, wire) in phantom.wires.iter().enumerate() {
        self::wire(wire).map_err(|fault| fault.of(Part::Wire(index, wire.name.clone())))?;
    }
    places(&phantom.wires)?;
    for (index, landmark) in phantom.landmarks.iter().enumerate() {
        coordinates(&landmark.at).map_err(|fault| fault.of(Part::Landmark(index, landmark.name.clone())))?;
    }
    for (index, z) in phantom.zs.iter().enumerate() {
        self::z(&phantom.wires, *z).map_err(|fault| fault.of(Part::Z(index)))?;
    }
    Ok(())
}

/// Whether there are as many parts as phantoms have; looked at before they are compared with each other.
pub(crate) fn counts(wires: usize, zs: usize, landmarks: usize) -> Result<(), BadPhantom> {
    for (what, found) in [("wires", wires), ("Zs", zs), ("landmarks", landmarks)] {
        if found > MOST {
            return Err(Fault::TooMany { what, found, most: MOST }.of(Part::Phantom));
        }
    }
    Ok(())
}

fn names<'a>(
    names: impl Iterator<Item = &'a str>,
    part: impl Fn(usize, String) -> Part,
) -> Result<(), BadPhantom> {
    let mut seen = HashMap::new();
    for (index, name) in names.enumerate() {
        if name.trim().is_empty() {
            return Err(Fault::NoName.of(part(index, name.into())));
        }
        if let Some(other) = seen.insert(name, index) {
            return Err(Fault::SameName { other: other + 1 }.of(part(index, name.into())));
        }
    }
    Ok(())
}

fn wire(wire: &Wire) -> Result<(), Fault> {
    coordinates(&wire.front)?;
    coordinates(&wire.back)?;
    let length_mm = wire.length_m() * 1e3;
    if length_mm < SHORTEST_MM {
        return Err(Fault::TooShort { length_mm, least_mm: SHORTEST_MM });
    }
    Ok(())
}

fn coordinates(point: &Point<Phantom>) -> Result<(), Fault> {
    let mm = point.vector() * 1e3;
    if mm.iter().any(|x| !x.is_finite()) {
        return Err(Fault::NotFinite);
    }
    match mm.iter().find(|x| x.abs() > FARTHEST_MM) {
        Some(&found_mm) => Err(Fault::Far { found_mm, most_mm: FARTHEST_MM }),
        None => Ok(()),
    }
}

fn places(wires: &[Wire]) -> Result<(), BadPhantom> {
    for (index, wire) in wires.iter().enumerate() {
        if let Some(other) = wires.iter().take(index).find(|other| same_place(wire, other)) {
            let fault = Fault::SamePlace { other: other.name.clone() };
            return Err(fault.of(Part::Wire(index, wire.name.clone())));
        }
    }
    Ok(())
}

/// Whether two wires have the same ends, either way round.
pub(crate) fn same_place(a: &Wire, b: &Wire) -> bool {
    let same = |p: &Point<Phantom>, q: &Point<Phantom>| p.distance(q) * 1e3 < SAME_PLACE_MM;
    (same(&a.front, &b.front) && same(&a.back, &b.back))
        || (same(&a.front, &b.back) && same(&a.back, &b.front))
}

fn z(wires: &[Wire], z: ZFiducial) -> Result<(), Fault> {
    let get = |index: usize| wires.get(index).ok_or(Fault::NoSuchIndex { index, wires: wires.len() });
    let (first, diagonal, last) = (get(z.first)?, get(z.diagonal)?, get(z.last)?);
    if z.first == z.diagonal || z.diagonal == z.last || z.first == z.last {
        return Err(Fault::SameWire);
    }
    let across = across(first, last)?;
    let angle_deg = angle_deg(first, diagonal);
    if angle_deg < PARALLEL_DEG {
        return Err(Fault::CrossesNeither { name: diagonal.name.clone(), angle_deg });
    }
    between(first, diagonal, across)
}

/// From the first side square to the last (mm).
fn across(first: &Wire, last: &Wire) -> Result<Vector3<f64>, Fault> {
    let angle_deg = angle_deg(first, last);
    if angle_deg > PARALLEL_DEG {
        return Err(Fault::SidesNotParallel { angle_deg, most_deg: PARALLEL_DEG });
    }
    let along = first.run().normalize();
    // Between the middles of the sides, so that what they are off parallel cancels.
    let middle = |wire: &Wire| (wire.front.vector() + wire.back.vector()) * 500.0;
    let between = middle(last) - middle(first);
    let across = between - along * between.dot(&along);
    let apart_mm = across.norm();
    if apart_mm < LEAST_WIDTH_MM {
        return Err(Fault::SidesTogether { apart_mm, least_mm: LEAST_WIDTH_MM });
    }
    Ok(across)
}

/// Whether the diagonal runs in the plane of the sides, and between them.
fn between(first: &Wire, diagonal: &Wire, across: Vector3<f64>) -> Result<(), Fault> {
    let width_mm = across.norm();
    let across = across / width_mm;
    let normal = first.run().normalize().cross(&across);
    for end in [diagonal.front, diagonal.back] {
        let from_first_mm = (end.vector() - first.front.vector()) * 1e3;
        let off_mm = from_first_mm.dot(&normal).abs();
        if off_mm > IN_PLANE_MM {
            return Err(Fault::NotInOnePlane { off_mm, most_mm: IN_PLANE_MM });
        }
        let at_mm = from_first_mm.dot(&across);
        let out_mm = (-at_mm).max(at_mm - width_mm);
        if out_mm > IN_PLANE_MM {
            return Err(Fault::NotBetween { name: diagonal.name.clone(), out_mm });
        }
    }
    Ok(())
}

/// Angle between two wires as lines (degrees), whichever way round each is written.
fn angle_deg(a: &Wire, b: &Wire) -> f64 {
    let (a, b) = (a.run(), b.run());
    a.cross(&b).norm().atan2(a.dot(&b).abs()).to_degrees()
}
