//! `PhantomDefinition`: patterns of wires, landmarks, and where old files keep the phantom's registration.

use nalgebra::Matrix4;
use probepath_frames::{Phantom, Point};
use roxmltree::Node;

use super::xml::{bad, finite, line, missing};
use super::{PlusError, PlusTransform};
use crate::phantom::{Landmark, Part, Wire, WirePhantom, ZFiducial, counts, same_place};

/// What the elements said, with the line of each part.
#[derive(Default)]
struct Parts {
    wires: Vec<Wire>,
    wire_lines: Vec<u32>,
    zs: Vec<ZFiducial>,
    z_lines: Vec<u32>,
    landmarks: Vec<Landmark>,
    landmark_lines: Vec<u32>,
}

pub(super) fn parse(definition: Node<'_, '_>) -> Result<WirePhantom, PlusError> {
    let geometry = child(definition, "Geometry")
        .ok_or_else(|| PlusError::MissingElement { line: line(definition), element: "Geometry" })?;
    let of = |name| geometry.descendants().filter(|n| n.has_tag_name(name)).count();
    // Every pattern makes one Z at most, of wires that were counted.
    counts(of("Wire"), 0, of("Landmark")).map_err(|bad| PlusError::Phantom(Box::new(bad)))?;
    let mut parts = Parts::default();
    for node in geometry.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "NWire" => parts.pattern(node, true)?,
            "Pattern" => parts.pattern(node, is_n_wire(node))?,
            "Wire" => drop(parts.wire(node)?),
            "Landmarks" => parts.landmarks(node)?,
            _ => {}
        }
    }
    let lines = (parts.wire_lines, parts.z_lines, parts.landmark_lines);
    let made = WirePhantom::new(name(definition), parts.wires, parts.zs, parts.landmarks);
    made.map_err(|bad| {
        let line_of = |part: &Part| match part {
            Part::Phantom => Some(line(geometry)),
            Part::Wire(index, _) => lines.0.get(*index).copied(),
            Part::Z(index) => lines.1.get(*index).copied(),
            Part::Landmark(index, _) => lines.2.get(*index).copied(),
        };
        PlusError::Phantom(Box::new(bad.at(|part| line_of(part).and_then(|line| line.try_into().ok()))))
    })
}

/// The registration that files before PLUS 2.1 keep with the phantom: `PhantomToPhantomReference` and 16 numbers.
pub(super) fn registration(definition: Node<'_, '_>) -> Result<Option<PlusTransform>, PlusError> {
    let Some(node) = definition.descendants().find(|n| n.has_tag_name("Registration")) else {
        return Ok(None);
    };
    let numbers = finite(node, "MatrixValue", 16)?.ok_or_else(|| missing(node, "MatrixValue"))?;
    let name = node.attribute("MatrixName").unwrap_or("PhantomToReference");
    let (from, to) =
        name.split_once("To").ok_or_else(|| bad(node, "MatrixName", "it is written PhantomToReference"))?;
    Ok(Some(PlusTransform {
        from: from.into(),
        to: to.into(),
        matrix_mm: Matrix4::from_row_iterator(numbers),
        // PLUS writes -1 for an error that it does not know.
        error_mm: node.attribute("Error").and_then(|e| e.trim().parse().ok()).filter(|e| *e >= 0.0),
        date: node.attribute("Date").map(str::to_owned),
    }))
}

impl Parts {
    /// Wires that belong together. Three of an N are side, diagonal, side; PLUS compares the type without its case.
    fn pattern(&mut self, node: Node<'_, '_>, n_wire: bool) -> Result<(), PlusError> {
        let wires = node.children().filter(|n| n.has_tag_name("Wire"));
        let wires = wires.map(|n| self.wire(n)).collect::<Result<Vec<_>, _>>()?;
        match wires.as_slice() {
            &[first, diagonal, last] if n_wire => {
                self.zs.push(ZFiducial { first, diagonal, last });
                self.z_lines.push(line(node));
            }
            _ if n_wire => {
                let why =
                    format!("an NWire has three wires (side, diagonal, side), this one {}", wires.len());
                return Err(bad(node, "Type", why));
            }
            _ => {}
        }
        Ok(())
    }

    /// The index of a wire. One that neighbouring patterns share is listed by both of them, and is one wire.
    fn wire(&mut self, node: Node<'_, '_>) -> Result<usize, PlusError> {
        let wire = Wire {
            name: self.wire_name(node),
            front: point(node, "EndPointFront")?,
            back: point(node, "EndPointBack")?,
        };
        if let Some(shared) = self.wires.iter().position(|other| same_place(&wire, other)) {
            return Ok(shared);
        }
        self.wires.push(wire);
        self.wire_lines.push(line(node));
        Ok(self.wires.len() - 1)
    }

    /// PLUS does not ask for names, nor for different ones.
    fn wire_name(&self, node: Node<'_, '_>) -> String {
        let number = self.wires.len() + 1;
        let name = node.attribute("Name").or(node.attribute("Id")).map(str::trim).filter(|n| !n.is_empty());
        distinct(name, number, |name| self.wires.iter().any(|wire| wire.name == name))
    }

    fn landmarks(&mut self, node: Node<'_, '_>) -> Result<(), PlusError> {
        for node in node.children().filter(|n| n.has_tag_name("Landmark")) {
            let number = self.landmarks.len() + 1;
            let name = node.attribute("Name").map(str::trim).filter(|n| !n.is_empty());
            let name = distinct(name, number, |name| self.landmarks.iter().any(|l| l.name == name));
            self.landmarks.push(Landmark { name, at: point(node, "Position")? });
            self.landmark_lines.push(line(node));
        }
        Ok(())
    }
}

/// A name that no other has: its own, or its own with its number.
fn distinct(name: Option<&str>, number: usize, taken: impl Fn(&str) -> bool) -> String {
    let own = name.map_or_else(|| number.to_string(), str::to_owned);
    if !taken(&own) {
        return own;
    }
    let numbered = (number..).map(|n| format!("{own} ({n})"));
    numbered.into_iter().find(|name| !taken(name)).unwrap_or(own)
}

fn is_n_wire(node: Node<'_, '_>) -> bool {
    node.attribute("Type").is_some_and(|kind| kind.trim().eq_ignore_ascii_case("NWire"))
}

fn point(node: Node<'_, '_>, attribute: &'static str) -> Result<Point<Phantom>, PlusError> {
    match finite(node, attribute, 3)?.as_deref() {
        Some(&[x, y, z]) => Ok(Point::new(x / 1e3, y / 1e3, z / 1e3)),
        _ => Err(missing(node, attribute)),
    }
}

/// `Description`'s name and version: `fCAL 1.2`.
fn name(definition: Node<'_, '_>) -> String {
    let description = child(definition, "Description");
    let word = |attribute| description.and_then(|d| d.attribute(attribute)).unwrap_or_default().trim();
    let name = format!("{} {}", word("Name"), word("Version"));
    if name.trim().is_empty() { "unnamed PLUS phantom".into() } else { name.trim().into() }
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|n| n.has_tag_name(name))
}
