//! When and as which pixel two images pass the voxels of a row.

use nalgebra::Vector3;

use super::pair::{Pair, Plane};

/// A place is found to this part of a voxel.
const CLOSE: f64 = 1e-3;
/// Newton's steps, each kept inside the bracket; turns between neighbours are small, so one or two do.
const MOST_STEPS: usize = 12;

/// The signed volume `(C x R) . (p - O)` is a cubic in t; its coefficients, without those that a voxel's place changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning {
    /// Those of the normal `C x R`, a square in t.
    normals: [Vector3<f64>; 3],
    /// Those of `(C x R) . (O(t) - O(0))`.
    moved: [f64; 3],
    /// The signed volume of a voxel that is close enough, squared.
    close: f64,
}

/// One row of voxels, along x.
pub(super) struct Passing<'p> {
    first: &'p Plane,
    change: &'p Plane,
    turning: &'p Turning,
    row: Vector3<f64>,
    /// Signed volumes with the two planes, as offset and slope along x: of one plane the same bits on both of its sides,
    /// so that no voxel falls between two pairs.
    sides: [(f64, f64); 2],
    /// The cubic at x = 0.
    cubic: [f64; 4],
}

impl Turning {
    pub(super) fn of(first: &Plane, change: &Plane) -> Self {
        let (c, r, dc, dr) = (first.column, first.row, change.column, change.row);
        let normals = [c.cross(&r), dc.cross(&r) + c.cross(&dr), dc.cross(&dr)];
        let moved = normals.map(|normal| normal.dot(&change.origin));
        let last = (c + dc).cross(&(r + dr));
        let close = CLOSE * CLOSE * normals[0].norm_squared().min(last.norm_squared());
        Self { normals, moved, close }
    }
}

impl Pair {
    /// The row of voxels at y and z.
    pub(super) fn passing(&self, y: f64, z: f64) -> Passing<'_> {
        let row = Vector3::new(0.0, y, z);
        let (off, turning) = (row - self.first.origin, &self.turning);
        let [a, b, c] = turning.normals.map(|normal| normal.dot(&off));
        let moved = turning.moved;
        let cubic = [a, b - moved[0], c - moved[1], -moved[2]];
        Passing { first: &self.first, change: &self.change, turning, row, sides: self.sides(y, z), cubic }
    }
}

impl Passing<'_> {
    /// Of the row's voxel at x: t from 0 to 1, column, row.
    #[inline]
    pub(super) fn at(&self, x: f64) -> Option<(f64, f64, f64)> {
        let [before, after] = self.sides.map(|(offset, slope)| offset + slope * x);
        if before * after > 0.0 {
            return None;
        }
        let t = self.root(x, before, after)?;
        let plane = self.first.along(self.change, t);
        let (u, v) = plane.pixel(&Vector3::new(x, self.row.y, self.row.z))?;
        Some((t, u, v))
    }

    /// When the plane between the two leads through the voxel.
    fn root(&self, x: f64, before: f64, after: f64) -> Option<f64> {
        let [n0, n1, n2] = &self.turning.normals;
        let [a, b, c, d] = self.cubic;
        let (a, b, c) = (a + n0.x * x, b + n1.x * x, c + n2.x * x);
        let (mut low, mut high) = (0.0, 1.0);
        let mut t = before / (before - after);
        if !t.is_finite() {
            // In both planes at once.
            t = 0.0;
        }
        for _ in 0..MOST_STEPS {
            let side = ((d * t + c) * t + b) * t + a;
            if side * side <= self.turning.close {
                return Some(t);
            }
            if side * before > 0.0 {
                low = t
            } else {
                high = t
            }
            let next = t - side / ((3.0 * d * t + 2.0 * c) * t + b);
            t = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        None
    }
}
