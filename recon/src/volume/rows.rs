//! A row of pixels on its way through the voxels, in fixed point: the same bits on every machine, and bounds that are
//! exact, so that the inner loops check none.

use std::ops::Range;

use nalgebra::Vector3;

use super::{Grid, Slice};

/// Bits behind the point. A row of 2^12 pixels is off by 2^-21 of a voxel at its end.
const POINT: u32 = 32;
/// Coordinates stay below 2^29 voxels, so that products and differences stay within 63 bits.
const FARTHEST: f64 = 536_870_912.0;

/// A slice's pixels in voxels, fixed point.
#[derive(Clone, Copy, Debug)]
pub(super) struct FixedMap {
    origin: [i64; 3],
    column: [i64; 3],
    row: [i64; 3],
}

/// One row: where its column 0 is, and the step to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct FixedRow {
    at: [i64; 3],
    step: [i64; 3],
}

impl FixedMap {
    /// `None` when a corner is too far away. `half` adds half a voxel, so that flooring rounds.
    pub(super) fn of(slice: &Slice<'_>, grid: &Grid, half: bool) -> Option<Self> {
        let first = grid.in_voxels(slice.map.at(0.0, 0.0).vector() - grid.origin.vector());
        let (column, row) = (grid.in_voxels(slice.map.column_step()), grid.in_voxels(slice.map.row_step()));
        let (width, height) = (slice.width as f64, slice.height() as f64);
        let corners =
            [first, first + column * width, first + row * height, first + column * width + row * height];
        if !corners.iter().all(|c| c.amax() < FARTHEST) {
            return None;
        }
        let shift = if half { Vector3::repeat(0.5) } else { Vector3::zeros() };
        Some(Self { origin: fixed(first + shift), column: fixed(column), row: fixed(row) })
    }

    pub(super) fn row(&self, row: usize) -> FixedRow {
        let row = row as i64;
        let at = [0, 1, 2].map(|axis| self.origin[axis] + self.row[axis] * row);
        FixedRow { at, step: self.column }
    }
}

fn fixed(vector: Vector3<f64>) -> [i64; 3] {
    [vector.x, vector.y, vector.z].map(|x| (x * f64::from(2.0_f32).powi(POINT as i32)).round() as i64)
}

impl FixedRow {
    /// The columns of `run` whose voxel lies in the box, exactly.
    pub(super) fn within(&self, run: Range<usize>, voxels: [Range<i64>; 3]) -> Range<usize> {
        let (mut low, mut high) = (run.start as i64, run.end as i64);
        for (axis, range) in voxels.into_iter().enumerate() {
            let (from, to) = self.columns(axis, range);
            low = low.max(from);
            high = high.min(to);
        }
        if low >= high { 0..0 } else { low as usize..high as usize }
    }

    /// Columns u with `start <= floor(at + u * step) < end` along one axis.
    fn columns(&self, axis: usize, range: Range<i64>) -> (i64, i64) {
        let (at, step) = (self.at[axis], self.step[axis]);
        let (from, to) = ((range.start << POINT) - at, (range.end << POINT) - at);
        let ceil = |a: i64, b: i64| -((-a).div_euclid(b));
        match step {
            0 if from <= 0 && 0 < to => (i64::MIN, i64::MAX),
            0 => (0, 0),
            1.. => (ceil(from, step), ceil(to, step)),
            _ => ((-to).div_euclid(-step) + 1, (-from).div_euclid(-step) + 1),
        }
    }

    /// The voxel of a column, and its place inside as 10-bit fractions.
    pub(super) fn voxel(&self, column: usize) -> ([i64; 3], [u64; 3]) {
        let at = [0, 1, 2].map(|axis| self.at[axis] + self.step[axis] * column as i64);
        (at.map(|x| x >> POINT), at.map(|x| (x >> (POINT - 10)) as u64 & 1023))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_agree_with_asking_every_column() {
        let mut seed = 7_u64;
        let mut next = |span: i64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as i64 % (2 * span + 1) - span
        };
        for _ in 0..20_000 {
            let at = [0; 3].map(|_| next(6) * (1 << 29) + next(3));
            let step = [0; 3].map(|_| next(3) * (1 << 30) + next(2));
            let row = FixedRow { at, step };
            let voxels = [0; 3].map(|_| {
                let low = next(4);
                low..low + 3 + next(3)
            });
            let run = 2..14;
            let slow: Vec<usize> = run
                .clone()
                .filter(|u| row.voxel(*u).0.iter().zip(&voxels).all(|(v, range)| range.contains(v)))
                .collect();
            let fast: Vec<usize> = row.within(run, voxels).collect();
            assert_eq!(fast, slow);
        }
    }
}
