//! A phantom as a file: our TOML, every length with its unit in the key.

use std::fs;
use std::path::Path;

use probepath_frames::{Phantom, Point};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::check;
use super::error::{BadPhantom, Fault, Part};
use super::{Landmark, Wire, WirePhantom, ZFiducial};

/// A phantom file is a page; this is a library.
const MOST_BYTES: u64 = 16 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Layout {
    name: String,
    #[serde(default)]
    wire: Vec<Spanned<WireMm>>,
    #[serde(default)]
    z: Vec<Spanned<ZNames>>,
    #[serde(default)]
    landmark: Vec<Spanned<LandmarkMm>>,
}

/// The same, as it is written.
#[derive(Serialize)]
struct Written<'a> {
    name: &'a str,
    wire: Vec<WireMm>,
    z: Vec<ZNames>,
    landmark: Vec<LandmarkMm>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WireMm {
    name: String,
    front_mm: [f64; 3],
    back_mm: [f64; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ZNames {
    wires: [String; 3],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LandmarkMm {
    name: String,
    at_mm: [f64; 3],
}

pub(super) fn read(path: &Path) -> Result<WirePhantom, BadPhantom> {
    let text = text(path).map_err(|source| BadPhantom::Disk { path: path.into(), source })?;
    if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
        WirePhantom::from_plus_xml(&text)
    } else {
        WirePhantom::from_toml(&text)
    }
}

fn text(path: &Path) -> std::io::Result<String> {
    let found = fs::metadata(path)?.len();
    if found > MOST_BYTES {
        let why = format!("it has {found} bytes, more than {MOST_BYTES}: this is no phantom file");
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidData, why));
    }
    fs::read_to_string(path)
}

pub(super) fn from_toml(text: &str) -> Result<WirePhantom, BadPhantom> {
    let layout: Layout = toml::from_str(text).map_err(|error| BadPhantom::Toml { why: error.to_string() })?;
    check::counts(layout.wire.len(), layout.z.len(), layout.landmark.len())?;
    // Where every part begins, kept before the parts are taken.
    let starts = Starts::of(&layout);
    let at = |bad: BadPhantom| bad.at(|part| starts.line(text, part));
    let wires: Vec<Wire> = layout.wire.into_iter().map(|w| w.into_inner().metres()).collect();
    let zs = layout
        .z
        .into_iter()
        .enumerate()
        .map(|(index, z)| z.into_inner().indices(&wires).map_err(|fault| at(fault.of(Part::Z(index)))));
    let zs = zs.collect::<Result<_, _>>()?;
    let landmarks = layout.landmark.into_iter().map(|l| l.into_inner().metres()).collect();
    WirePhantom::new(layout.name, wires, zs, landmarks).map_err(at)
}

pub(super) fn to_toml(phantom: &WirePhantom) -> Result<String, BadPhantom> {
    let name = |index: usize| phantom.wires.get(index).map(|w| w.name.clone()).unwrap_or_default();
    let written = Written {
        name: &phantom.name,
        wire: phantom.wires.iter().map(WireMm::of).collect(),
        z: phantom.zs.iter().map(|z| ZNames { wires: [z.first, z.diagonal, z.last].map(name) }).collect(),
        landmark: phantom.landmarks.iter().map(LandmarkMm::of).collect(),
    };
    toml::to_string(&written).map_err(|error| BadPhantom::Toml { why: error.to_string() })
}

/// At which byte of the text the parts begin.
struct Starts {
    wires: Vec<usize>,
    zs: Vec<usize>,
    landmarks: Vec<usize>,
}

impl Starts {
    fn of(layout: &Layout) -> Self {
        fn starts<T>(parts: &[Spanned<T>]) -> Vec<usize> {
            parts.iter().map(|part| part.span().start).collect()
        }
        Self { wires: starts(&layout.wire), zs: starts(&layout.z), landmarks: starts(&layout.landmark) }
    }

    fn line(&self, text: &str, part: &Part) -> Option<usize> {
        let start = match part {
            Part::Phantom => None,
            Part::Wire(index, _) => self.wires.get(*index),
            Part::Z(index) => self.zs.get(*index),
            Part::Landmark(index, _) => self.landmarks.get(*index),
        };
        let before = text.as_bytes().get(..*start?)?;
        Some(1 + before.iter().filter(|byte| **byte == b'\n').count())
    }
}

impl WireMm {
    fn of(wire: &Wire) -> Self {
        Self { name: wire.name.clone(), front_mm: mm(&wire.front), back_mm: mm(&wire.back) }
    }

    fn metres(self) -> Wire {
        Wire { name: self.name, front: point(self.front_mm), back: point(self.back_mm) }
    }
}

impl ZNames {
    fn indices(self, wires: &[Wire]) -> Result<ZFiducial, Fault> {
        let index = |name: String| {
            let index = wires.iter().position(|wire| wire.name == name);
            index.ok_or(Fault::NoSuchWire { name })
        };
        let [first, diagonal, last] = self.wires;
        Ok(ZFiducial { first: index(first)?, diagonal: index(diagonal)?, last: index(last)? })
    }
}

impl LandmarkMm {
    fn of(landmark: &Landmark) -> Self {
        Self { name: landmark.name.clone(), at_mm: mm(&landmark.at) }
    }

    fn metres(self) -> Landmark {
        Landmark { name: self.name, at: point(self.at_mm) }
    }
}

fn point(mm: [f64; 3]) -> Point<Phantom> {
    let [x, y, z] = mm.map(|x| x / 1e3);
    Point::new(x, y, z)
}

/// Millimetres that read back to the same metres where any double does.
fn mm(point: &Point<Phantom>) -> [f64; 3] {
    let v = point.vector();
    [v.x, v.y, v.z].map(crate::calibration::mm)
}
