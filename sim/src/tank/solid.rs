//! What the probe can knock against: the plates, the container's bottom, the bed of wires.

use nalgebra::{Matrix3, Vector3};
use probepath_frames::{Direction, Phantom, Point, Pose, World};
use probepath_us_capture::phantom::WirePhantom;

use super::config::WirePhantomConfig;
use crate::tissue::Facet;

/// How thick the plates are, and how far they reach beside the outermost wire (m; [P1]: 9.53 mm, 110 mm wide).
const PLATE_M: f64 = 9.53e-3;
const BESIDE_M: f64 = 5e-3;
/// The container reaches this far beyond the plates (m).
const CONTAINER_M: f64 = 30e-3;
/// What of an echo is scattered: a drilled acrylic plate, a container's bottom.
const ROUGH: f64 = 0.25;

/// A box, in axes across the wires, along them, and up (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

/// All of them, and where they are.
#[derive(Clone, Debug)]
pub(super) struct Solids {
    axes: Matrix3<f64>,
    world_from_phantom: Pose<World, Phantom>,
    plates: [Solid; 2],
    bottom: Solid,
    wires: Solid,
}

/// The smallest box around the wires, in `axes`.
pub(super) fn extent(phantom: &WirePhantom, axes: &Matrix3<f64>) -> [Vector3<f64>; 2] {
    let ends = phantom.wires.iter().flat_map(|wire| [wire.front, wire.back]);
    let mut placed = ends.map(|end| axes.transpose() * end.vector());
    let first = placed.next().unwrap_or_default();
    placed.fold([first, first], |[low, high], p| [low.inf(&p), high.sup(&p)])
}

impl Solids {
    pub(super) fn new(
        phantom: &WirePhantom,
        axes: &Matrix3<f64>,
        config: &WirePhantomConfig,
        world_from_phantom: Pose<World, Phantom>,
    ) -> Self {
        let [low, high] = extent(phantom, axes);
        let floor = low.z - config.bottom_below_mm * 1e-3;
        let top = high.z + config.plates_above_mm * 1e-3;
        let plate = |inner: f64, outer: f64| Solid {
            low: Vector3::new(low.x - BESIDE_M, inner.min(outer), floor),
            high: Vector3::new(high.x + BESIDE_M, inner.max(outer), top),
        };
        let around = Vector3::new(BESIDE_M + CONTAINER_M, PLATE_M + CONTAINER_M, 0.0);
        let (mut under, mut over) = (low - around, high + around);
        (under.z, over.z) = (floor - 5e-3, floor);
        Self {
            axes: *axes,
            world_from_phantom,
            plates: [plate(low.y, low.y - PLATE_M), plate(high.y, high.y + PLATE_M)],
            bottom: Solid { low: under, high: over },
            wires: Solid { low, high },
        }
    }

    /// Signed distance (m) and outward normal of the nearest.
    pub(super) fn surface(&self, point: Point<World>) -> (f64, Direction<World>) {
        let p = self.axes.transpose() * (self.world_from_phantom.inverse() * point).vector();
        let all = [self.plates[0], self.plates[1], self.bottom, self.wires];
        let nearest = all.iter().map(|solid| solid.surface(&p)).min_by(|a, b| a.0.total_cmp(&b.0));
        let (distance, normal) = nearest.unwrap_or((f64::INFINITY, Vector3::z()));
        let outward = self.world_from_phantom.isometry().rotation * (self.axes * normal);
        (distance, Direction::of(outward).unwrap_or_else(|_| Direction::y().reversed()))
    }

    /// The plates' inner faces and upper edges, and the bottom.
    pub(super) fn facets(&self, config: &WirePhantomConfig) -> Vec<Facet> {
        let [front, back] = self.plates;
        let inner = |plate: &Solid, y: f64| {
            let corner = Vector3::new(plate.low.x, y, plate.low.z);
            let size = plate.high - plate.low;
            self.facet(corner, [Vector3::x() * size.x, Vector3::z() * size.z], config.plate_echo)
        };
        vec![
            inner(&front, front.high.y),
            inner(&back, back.low.y),
            self.lid(&front, config.plate_echo),
            self.lid(&back, config.plate_echo),
            self.lid(&self.bottom, config.bottom_echo),
        ]
    }

    /// The upper face of a box.
    fn lid(&self, solid: &Solid, amplitude: f64) -> Facet {
        let size = solid.high - solid.low;
        let corner = Vector3::new(solid.low.x, solid.low.y, solid.high.z);
        self.facet(corner, [Vector3::x() * size.x, Vector3::y() * size.y], amplitude)
    }

    fn facet(&self, corner: Vector3<f64>, edges: [Vector3<f64>; 2], amplitude: f64) -> Facet {
        let turn = self.world_from_phantom.isometry().rotation;
        Facet {
            corner: self.world_from_phantom * Point::from_vector(self.axes * corner),
            edges: edges.map(|edge| turn * (self.axes * edge)),
            amplitude,
            rough: ROUGH,
        }
    }
}

impl Solid {
    /// Signed distance (m) and outward normal.
    fn surface(&self, p: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let middle = (self.low + self.high) / 2.0;
        let from = p - middle;
        let beyond = from.abs() - (self.high - self.low) / 2.0;
        let out = beyond.map(|b| b.max(0.0));
        if out.norm() > 0.0 {
            return (out.norm(), out.zip_map(&from, |o, f| o * f.signum()).normalize());
        }
        let axis = beyond.imax();
        let mut normal = Vector3::zeros();
        normal[axis] = from[axis].signum();
        (beyond[axis], normal)
    }
}
