//! [`WireTank`]: a phantom of wires between two plates, in a container of water on the table.

mod config;
mod solid;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Direction, Flange, Phantom, Point, Pose, Probe, World};
use probepath_us_capture::phantom::{Wire, WirePhantom};

pub use config::WirePhantomConfig;
pub(crate) use config::refuse;
use solid::Solids;

use crate::cell::CellError;
use crate::random::Stream;
use crate::skin::HALF_FACE_X_M;
use crate::tissue::{Facet, Medium, Strand, Tissue};

/// Holes of one place are one hole (m).
const SAME_HOLE_M: f64 = 1e-6;
/// A level distance shorter than this shows no direction (m).
const LEVEL_M: f64 = 1e-3;
/// Parts of the face's length for which it is asked whether they are under water.
const WET_STEPS: u32 = 40;
/// The ball pointer's tip on the arm's flange, as its drawing has it (m).
const POINTER_TIP_M: [f64; 3] = [0.0, 0.0, 0.150];

/// What the drawing and a thermometer say of the tank: what the software may know.
#[derive(Clone, Debug, PartialEq)]
pub struct Bench {
    /// The phantom, as it was drawn.
    pub phantom: WirePhantom,
    /// Where it stands, as a tape measure finds it.
    pub world_from_phantom: Pose<World, Phantom>,
    /// How warm the water is (degrees Celsius).
    pub water_celsius: f64,
    /// Where the tip of the ball pointer is on the flange, as its drawing has it.
    pub pointer_tip: Point<Flange>,
}

impl Bench {
    pub(crate) fn new(config: &WirePhantomConfig) -> Result<Self, CellError> {
        let phantom = config.phantom()?;
        let world_from_phantom = config.stands(&phantom);
        let [x, y, z] = POINTER_TIP_M;
        Ok(Self {
            phantom,
            world_from_phantom,
            water_celsius: config.water_celsius,
            pointer_tip: Point::new(x, y, z),
        })
    }
}

/// The tank as it truly is: the wires where their holes were drilled, the phantom where it was put.
#[derive(Clone, Debug)]
pub struct WireTank {
    phantom: WirePhantom,
    world_from_phantom: Pose<World, Phantom>,
    pointer_tip: Point<Flange>,
    celsius: f64,
    surface_y: f64,
    strands: Vec<Strand>,
    facets: Vec<Facet>,
    solids: Solids,
}

impl WireTank {
    /// The tank of one seed.
    ///
    /// # Errors
    /// When there is no such phantom.
    pub fn new(config: &WirePhantomConfig, seed: u64) -> Result<Self, CellError> {
        let bench = Bench::new(config)?;
        let phantom = drilled(&bench.phantom, config, seed);
        let world_from_phantom = bench.world_from_phantom * misplaced(config, seed);
        let mut stream = Stream::new(seed, "ball pointer");
        let bent = stream.normal3().normalize() * config.pointer_error_mm * 1e-3;
        let axes = config.axes(&phantom);
        let solids = Solids::new(&phantom, &axes, config, world_from_phantom);
        let top = phantom.wires.iter().flat_map(|wire| [wire.front, wire.back]);
        let top_y = top.map(|end| (world_from_phantom * end).vector().y).fold(f64::INFINITY, f64::min);
        Ok(Self {
            strands: strands(&phantom, &world_from_phantom, config.wire_echo),
            facets: solids.facets(config),
            pointer_tip: Point::from_vector(bench.pointer_tip.vector() + bent),
            celsius: config.water_celsius,
            surface_y: top_y - config.water_above_mm * 1e-3,
            phantom,
            world_from_phantom,
            solids,
        })
    }

    /// The phantom as it was made.
    pub const fn phantom(&self) -> &WirePhantom {
        &self.phantom
    }

    /// Where it truly stands.
    pub const fn world_from_phantom(&self) -> &Pose<World, Phantom> {
        &self.world_from_phantom
    }

    /// Where the ball pointer's tip truly is.
    pub const fn pointer_tip(&self) -> Point<Flange> {
        self.pointer_tip
    }

    /// y of the water's surface in the World (m).
    pub const fn water_y(&self) -> f64 {
        self.surface_y
    }

    /// What part of the probe's face is under water: from and to along its x (m).
    pub(crate) fn wet(&self, world_from_probe: &Pose<World, Probe>) -> Option<(f64, f64)> {
        let step = 2.0 * HALF_FACE_X_M / f64::from(WET_STEPS);
        let at = |i: u32| -HALF_FACE_X_M + step * f64::from(i);
        let under = |i: &u32| (*world_from_probe * Point::new(at(*i), 0.0, 0.0)).vector().y > self.surface_y;
        let (first, last) = ((0..=WET_STEPS).find(under)?, (0..=WET_STEPS).rev().find(under)?);
        Some((at(first) - step / 2.0, at(last) + step / 2.0))
    }

    /// Signed distance to plates, bottom and the bed of wires (m), and the outward normal of the nearest.
    pub fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        self.solids.surface(point)
    }
}

impl Tissue for WireTank {
    fn artery(&self, _point: Point<World>) -> f64 {
        f64::INFINITY
    }

    fn strands(&self) -> &[Strand] {
        &self.strands
    }

    fn facets(&self) -> &[Facet] {
        &self.facets
    }

    fn medium(&self) -> Medium {
        Medium::Water { celsius: self.celsius }
    }
}

fn strands(phantom: &WirePhantom, world_from_phantom: &Pose<World, Phantom>, amplitude: f64) -> Vec<Strand> {
    let strand =
        |wire: &Wire| Strand { ends: [wire.front, wire.back].map(|p| *world_from_phantom * p), amplitude };
    phantom.wires.iter().map(strand).collect()
}

/// The phantom with its holes where the drill went, and its landmarks where the mill did. Wires that share a hole go
/// on sharing it.
fn drilled(drawn: &WirePhantom, config: &WirePhantomConfig, seed: u64) -> WirePhantom {
    let mut stream = Stream::new(seed, "drilled holes");
    let deviation = config.hole_error_mm * 1e-3;
    let along = config.axes(drawn).column(1).into_owned();
    let mut holes: Vec<(Point<Phantom>, Point<Phantom>)> = Vec::new();
    let mut hole = |drawn: Point<Phantom>| {
        if let Some((_, made)) = holes.iter().find(|(at, _)| at.distance(&drawn) < SAME_HOLE_M) {
            return *made;
        }
        let off = stream.normal3() * deviation;
        let made = Point::from_vector(drawn.vector() + off - along * along.dot(&off));
        holes.push((drawn, made));
        made
    };
    let mut made = drawn.clone();
    for wire in &mut made.wires {
        (wire.front, wire.back) = (hole(wire.front), hole(wire.back));
    }
    for landmark in &mut made.landmarks {
        landmark.at = Point::from_vector(landmark.at.vector() + stream.normal3() * deviation);
    }
    made
}

/// How far it stands from where it is thought to stand, in a direction from the seed.
fn misplaced(config: &WirePhantomConfig, seed: u64) -> Pose<Phantom, Phantom> {
    let mut stream = Stream::new(seed, "place of the phantom");
    let mut toward = |length: f64| stream.normal3().normalize() * length;
    let (off, turn) = (toward(config.place_error_mm * 1e-3), toward(config.place_error_deg.to_radians()));
    // FRAMES: the small motion from the told phantom to the true one, written in Phantom.
    Pose::assume(Isometry3::from_parts(off.into(), UnitQuaternion::from_scaled_axis(turn)))
}

impl WirePhantomConfig {
    /// Columns: across the wires, along them from the front plate to the back one, up; in the phantom's axes.
    pub(crate) fn axes(&self, phantom: &WirePhantom) -> Matrix3<f64> {
        let up = self.up.map_or_else(|| upward(phantom), Vector3::from).try_normalize(1e-9);
        let up = up.unwrap_or(Vector3::z());
        let level = |v: Vector3<f64>| v - up * up.dot(&v);
        let run = level(phantom.wires.iter().map(Wire::run).sum());
        // The plate runs from its one outermost hole to the other.
        let fronts: Vec<_> = phantom.wires.iter().map(|wire| level(wire.front.vector())).collect();
        let pairs = fronts.iter().flat_map(|a| fronts.iter().map(move |b| b - a));
        let across = pairs.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
        let along = up.cross(&across).try_normalize(LEVEL_M).map(|n| n * run.dot(&n).signum());
        // Holes that all lie over each other show no plate: the wires' own run does, or, where they stand upright, any.
        let other = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let along = along.or_else(|| run.try_normalize(LEVEL_M));
        let along = along.unwrap_or_else(|| up.cross(&other).normalize());
        Matrix3::from_columns(&[along.cross(&up), along, up])
    }

    /// Where it stands: the wires' middle over the table's origin, across them the World's x.
    fn stands(&self, phantom: &WirePhantom) -> Pose<World, Phantom> {
        let axes = self.axes(phantom);
        let world: Matrix3<f64> = Matrix3::from_columns(&[Vector3::x(), Vector3::z(), -Vector3::y()]);
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), self.turn_deg.to_radians());
        let turn = turn * Rotation3::from_matrix_unchecked(world * axes.transpose());
        let [low, high] = solid::extent(phantom, &axes);
        let mut middle = (low + high) / 2.0;
        middle.z = low.z - self.bottom_below_mm * 1e-3;
        let stand = Vector3::new(self.at_mm[0], -self.height_mm, self.at_mm[1]) * 1e-3;
        let place = stand - turn * (axes * middle);
        // FRAMES: Phantom's axes turned so that its up is World -y; the container's bottom `height_mm` over the table.
        Pose::assume(Isometry3::from_parts(
            Translation3::from(place),
            UnitQuaternion::from_rotation_matrix(&turn),
        ))
    }
}

/// Square to the plane of the phantom's first Z.
fn upward(phantom: &WirePhantom) -> Vector3<f64> {
    let wires = phantom.zs.first().and_then(|z| phantom.wires_of(*z));
    let Some([first, diagonal, _]) = wires else { return Vector3::z() };
    let square = first.run().cross(&diagonal.run());
    square * square.get(square.iamax()).copied().unwrap_or(1.0).signum()
}

#[cfg(test)]
mod tests;
