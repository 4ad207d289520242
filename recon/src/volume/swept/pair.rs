//! Two images and what their pixels pass between them, in voxels.

use std::ops::Range;

use nalgebra::Vector3;
use probepath_frames::World;
use probepath_us_capture::PixelMap;

use super::super::clip::Clip;
use super::super::{Grid, Swept};
use super::passing::Turning;

/// Where an image's pixels are: `origin + u column + v row`, in voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) origin: Vector3<f64>,
    pub(super) column: Vector3<f64>,
    pub(super) row: Vector3<f64>,
}

/// Two neighbouring images.
#[derive(Clone, Debug)]
pub(in super::super) struct Pair {
    /// Of the first.
    pub(super) number: usize,
    pub(super) clip: usize,
    pub(super) first: Plane,
    second: Plane,
    pub(super) change: Plane,
    normals: [Vector3<f64>; 2],
    pub(super) turning: Turning,
    /// Voxels that may lie between them.
    voxels: [Range<i64>; 3],
}

impl Plane {
    fn of(map: &PixelMap<World>, grid: &Grid) -> Self {
        let origin = grid.in_voxels(map.at(0.0, 0.0).vector() - grid.origin.vector());
        let steps = [map.column_step(), map.row_step()].map(|step| grid.in_voxels(step));
        Self { origin, column: steps[0], row: steps[1] }
    }

    fn at(&self, column: f64, row: f64) -> Vector3<f64> {
        self.origin + self.column * column + self.row * row
    }

    pub(super) fn along(&self, change: &Self, t: f64) -> Self {
        let origin = self.origin + change.origin * t;
        Self { origin, column: self.column + change.column * t, row: self.row + change.row * t }
    }

    fn normal(&self) -> Vector3<f64> {
        self.column.cross(&self.row)
    }

    /// The pixel whose place is nearest to a point.
    pub(super) fn pixel(&self, point: &Vector3<f64>) -> Option<(f64, f64)> {
        let off = point - self.origin;
        let (cc, rr, cr) =
            (self.column.dot(&self.column), self.row.dot(&self.row), self.column.dot(&self.row));
        let (c, r, det) = (off.dot(&self.column), off.dot(&self.row), cc * rr - cr * cr);
        (det > 0.0).then(|| ((c * rr - r * cr) / det, (r * cc - c * cr) / det))
    }
}

impl Pair {
    /// `None` when nothing was swept: too far apart, nothing of them is used, or all outside the grid.
    pub(super) fn between(
        (number, own): (usize, usize),
        maps: [&PixelMap<World>; 2],
        clip: &Clip,
        grid: &Grid,
        swept: Swept,
    ) -> Option<Self> {
        let (columns, rows) = clip.bounds()?;
        // Pixels have a size: half of one beyond the outermost centres.
        let (left, right) = (columns.start as f64 - 0.5, columns.end as f64 - 0.5);
        let (top, bottom) = (rows.start as f64 - 0.5, rows.end as f64 - 0.5);
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
        let way = |(u, v): (f64, f64)| maps[0].at(u, v).distance(&maps[1].at(u, v));
        if !corners.iter().all(|corner| way(*corner) <= swept.longest_m) {
            return None;
        }
        let [first, second] = maps.map(|map| Plane::of(map, grid));
        let change = Plane {
            origin: second.origin - first.origin,
            column: second.column - first.column,
            row: second.row - first.row,
        };
        let ends = corners.iter().flat_map(|(u, v)| [first.at(*u, *v), second.at(*u, *v)]);
        let (low, high) = ends.fold(
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
            |(low, high), end| (low.inf(&end), high.sup(&end)),
        );
        let voxels = [0, 1, 2].map(|axis| {
            let most = grid.size[axis] as i64;
            (low[axis].ceil() as i64).clamp(0, most)
                ..(high[axis].floor() as i64).saturating_add(1).clamp(0, most)
        });
        let inside = voxels.iter().all(|range| !range.is_empty());
        let normals = [first.normal(), second.normal()];
        let turning = Turning::of(&first, &change);
        inside.then_some(Self { number, clip: own, first, second, change, normals, turning, voxels })
    }

    pub(super) fn touches(&self, layers: &Range<i64>) -> bool {
        self.voxels[2].start < layers.end && layers.start < self.voxels[2].end
    }

    /// The rows of voxels that may lie between the images: y, z, and the range of x.
    pub(super) fn rows(&self, layers: &Range<i64>, mut work: impl FnMut([i64; 2], Range<usize>)) {
        let [x, y, z] = &self.voxels;
        for z in z.start.max(layers.start)..z.end.min(layers.end) {
            for y in y.clone() {
                let columns = self.columns(x, y as f64, z as f64);
                if !columns.is_empty() {
                    work([y, z], columns);
                }
            }
        }
    }

    /// The voxels of a row between the two planes, and one more at either end.
    fn columns(&self, x: &Range<i64>, y: f64, z: f64) -> Range<usize> {
        let (low, high) = (x.start as f64, (x.end - 1) as f64);
        let [(a, b), (c, d)] = self.sides(y, z);
        let cut = |offset: f64, slope: f64| (-offset / slope).clamp(low, high);
        // Without a slope the cut is at an end, or nowhere (NaN), which `min` and `max` pass over.
        let cuts = [cut(a, b), cut(c, d)];
        let (from, to) = (cuts[0].min(cuts[1]).max(low), cuts[0].max(cuts[1]).min(high));
        let apart = |x: f64| (a + b * x) * (c + d * x) <= 0.0;
        let outside = (from > low && apart(0.5 * (low + from))) || (to < high && apart(0.5 * (to + high)));
        let between = apart(0.5 * (from + to)) || from >= to;
        match (outside, between) {
            (true, _) => x.start as usize..x.end as usize,
            (false, true) => {
                let (from, to) = (from.floor() as i64 - 1, to.ceil() as i64 + 2);
                from.max(x.start) as usize..to.min(x.end) as usize
            }
            (false, false) => 0..0,
        }
    }

    /// The signed volumes of a row's voxels with the two planes, as offset and slope along x.
    pub(super) fn sides(&self, y: f64, z: f64) -> [(f64, f64); 2] {
        let row = Vector3::new(0.0, y, z);
        let side = |plane: &Plane, normal: &Vector3<f64>| (normal.dot(&(row - plane.origin)), normal.x);
        [side(&self.first, &self.normals[0]), side(&self.second, &self.normals[1])]
    }
}
