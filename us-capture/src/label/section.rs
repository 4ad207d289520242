//! The phantom as its cross-sections show it: wires along the main direction stay where they are, the others slide.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::phantom::WirePhantom;

/// Wires closer to the main direction than this (rad) count as parallel to it.
const PARALLEL_RAD: f64 = 0.012;

/// The wires, and the axes of the sections across most of them.
#[derive(Clone, Debug)]
pub(super) struct Section {
    /// Rows: the section's two axes and the main direction, right-handed: takes phantom vectors to section vectors.
    pub axes: Matrix3<f64>,
    /// Every wire of the phantom, in its order.
    pub strands: Vec<Strand>,
    /// The wires that run along the main direction.
    pub straight: Vec<usize>,
    /// First and last place along the main direction where there is any wire (m).
    pub reach: (f64, f64),
}

/// A wire in the axes of the section.
#[derive(Clone, Debug)]
pub(super) struct Strand {
    /// Its front end (m).
    pub front: Vector3<f64>,
    /// Unit vector from front to back.
    pub direction: Vector3<f64>,
    /// Two unit vectors across it.
    pub across: [Vector3<f64>; 2],
    /// Its length (m).
    pub length: f64,
}

impl Section {
    pub fn of(phantom: &WirePhantom) -> Self {
        let along = main_direction(phantom);
        let (a, b) = basis(along);
        let axes = Matrix3::from_rows(&[a.transpose(), b.transpose(), along.transpose()]);
        let strands: Vec<_> = phantom
            .wires
            .iter()
            .map(|w| Strand::new(axes * w.front.vector(), axes * w.back.vector()))
            .collect();
        let straight = (0..strands.len()).filter(|&i| strands[i].lean() < PARALLEL_RAD).collect();
        let ends = || strands.iter().flat_map(|s| [s.front.z, s.back().z]);
        let reach = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));
        Self { axes, strands, straight, reach }
    }

    /// Where the wires cross the section at `z`: for those that do.
    pub fn at(&self, z: f64) -> Vec<(usize, Vector2<f64>)> {
        self.strands.iter().enumerate().filter_map(|(i, s)| Some((i, s.at(z)?))).collect()
    }
}

impl Strand {
    fn new(front: Vector3<f64>, back: Vector3<f64>) -> Self {
        let run = back - front;
        let length = run.norm();
        let direction = run / length.max(f64::MIN_POSITIVE);
        let (a, b) = basis(direction);
        Self { front, direction, across: [a, b], length }
    }

    fn back(&self) -> Vector3<f64> {
        self.front + self.direction * self.length
    }

    /// Angle to the main direction (rad).
    fn lean(&self) -> f64 {
        self.direction.xy().norm().atan2(self.direction.z.abs())
    }

    /// Where it crosses the section at `z`, within a millimetre of its ends.
    pub fn at(&self, z: f64) -> Option<Vector2<f64>> {
        let along = (z - self.front.z) / self.direction.z;
        let crosses = self.direction.z.abs() > 0.2 && along > -1e-3 && along < self.length + 1e-3;
        crosses.then(|| (self.front + self.direction * along).xy())
    }

    /// Of a wire that slides from section to section: the place along the main direction where it is nearest to
    /// `place`, and how far from it (m).
    pub fn slid_to(&self, place: Vector2<f64>) -> Option<(f64, f64)> {
        let slope = self.direction.xy() / self.direction.z;
        if self.direction.z.abs() < 0.2 || self.lean() < PARALLEL_RAD {
            return None;
        }
        let off = place - self.front.xy();
        let z = off.dot(&slope) / slope.norm_squared();
        Some((self.front.z + z, (off - slope * z).norm()))
    }

    /// Whether `z` lies between its ends, `margin` beyond them included.
    pub fn reaches(&self, z: f64, margin: f64) -> bool {
        let (a, b) = (self.front.z.min(self.back().z), self.front.z.max(self.back().z));
        (a - margin..=b + margin).contains(&z)
    }
}

/// The direction that most wires share (the first of them, where several do).
fn main_direction(phantom: &WirePhantom) -> Vector3<f64> {
    let runs: Vec<_> = phantom.wires.iter().map(|w| w.run().normalize()).collect();
    let parallel = |d: &Vector3<f64>| runs.iter().filter(|r| r.cross(d).norm() < PARALLEL_RAD).count();
    let most = runs.iter().map(parallel).max().unwrap_or(0);
    if most >= 2 {
        return runs.iter().find(|d| parallel(d) == most).copied().unwrap_or_else(Vector3::z);
    }
    let lined = |r: &Vector3<f64>| r * r.dot(&runs[0]).signum();
    runs.iter().map(lined).sum::<Vector3<f64>>().try_normalize(1e-9).unwrap_or_else(Vector3::z)
}

/// Two unit vectors that make a right-handed system with a unit vector as the third.
fn basis(third: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let least = third.iamin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    let a = (other - third * third.dot(&other)).normalize();
    (a, third.cross(&a))
}
