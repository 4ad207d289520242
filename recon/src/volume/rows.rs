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
    ///
    /// World's origin and the grid's are brought to whole numbers one by one: grids whose origins are whole voxels apart
    /// then see the same places to the last bit.
    pub(super) fn of(slice: &Slice<'_>, grid: &Grid, half: bool) -> Option<Self> {
        let (first, zero) =
            (grid.in_voxels(slice.map.at(0.0, 0.0).vector()), grid.in_voxels(grid.origin.vector()));
        let (column, row) = (grid.in_voxels(slice.map.column_step()), grid.in_voxels(slice.map.row_step()));
        let (width, height) = (slice.width as f64, slice.height() as f64);
        let corners = [Vector3::zeros(), column * width, row * height, column * width + row * height];
        let near = |v: &Vector3<f64>| v.amax() < FARTHEST;
        if !(near(&first) && near(&zero) && corners.iter().all(|c| near(&(first - zero + c)))) {
            return None;
        }
        let (first, zero) = (fixed(first), fixed(zero));
        let shift = if half { 1 << (POINT - 1) } else { 0 };
        let origin = [0, 1, 2].map(|axis| first[axis] - zero[axis] + shift);
        Some(Self { origin, column: fixed(column), row: fixed(row) })
    }

    /// The voxels along an axis that an image of this size reaches, and one more on either side.
    pub(super) fn span(&self, axis: usize, width: usize, height: usize) -> Range<i64> {
        let (across, down) = (self.column[axis] * width as i64, self.row[axis] * height as i64);
        let corners = [0, across, down, across + down].map(|c| (self.origin[axis] + c) >> POINT);
        let [low, high] = [corners.iter().min(), corners.iter().max()].map(|end| end.copied().unwrap_or(0));
        low - 1..high + 3
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
    pub(super) fn within(&self, run: Range<usize>, voxels: &[Range<i64>; 3]) -> Range<usize> {
        let (mut low, mut high) = (run.start as i64, run.end as i64);
        for (axis, range) in voxels.iter().enumerate() {
            let (from, to) = self.columns(axis, range);
            low = low.max(from);
            high = high.min(to);
        }
        if low >= high { 0..0 } else { low as usize..high as usize }
    }

    /// Columns u with `start <= floor(at + u * step) < end` along one axis.
    fn columns(&self, axis: usize, range: &Range<i64>) -> (i64, i64) {
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

    /// The row from a column on, counted from the voxel `low`, which no column of the stretch lies below.
    pub(super) fn local(&self, column: usize, low: [i64; 3]) -> LocalRow {
        let at = [0, 1, 2].map(|axis| {
            let at = self.at[axis] + self.step[axis] * column as i64;
            (at - (low[axis] << POINT)).cast_unsigned()
        });
        LocalRow { at, step: self.step.map(i64::cast_unsigned) }
    }

    /// The voxel of a column.
    #[cfg(test)]
    fn voxel(&self, column: usize) -> [i64; 3] {
        [0, 1, 2].map(|axis| (self.at[axis] + self.step[axis] * column as i64) >> POINT)
    }
}

/// A stretch of a row inside a box of voxels, counted from the box's first: never below zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalRow {
    at: [u64; 3],
    step: [u64; 3],
}

impl LocalRow {
    /// The index of every pixel's voxel in the box's cells; `strides` are those of y and z.
    pub(super) fn indices(&self, strides: [usize; 2], out: &mut [u32]) {
        let [ny, nz] = strides.map(|s| u64::from(s as u32));
        let [mut x, mut y, mut z] = self.at;
        for index in out {
            *index = ((z >> POINT) * nz + (y >> POINT) * ny + (x >> POINT)) as u32;
            x = x.wrapping_add(self.step[0]);
            y = y.wrapping_add(self.step[1]);
            z = z.wrapping_add(self.step[2]);
        }
    }

    /// Where in its voxel every pixel lies, in 1024ths.
    pub(super) fn fractions<const N: usize>(&self, out: &mut [[u32; N]; 3], pixels: usize) {
        for (axis, out) in out.iter_mut().enumerate() {
            let mut at = self.at[axis];
            for fraction in &mut out[..pixels.min(N)] {
                *fraction = (at as u32) >> (POINT - 10);
                at = at.wrapping_add(self.step[axis]);
            }
        }
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
                .filter(|u| row.voxel(*u).iter().zip(&voxels).all(|(v, range)| range.contains(v)))
                .collect();
            let fast: Vec<usize> = row.within(run, &voxels).collect();
            assert_eq!(fast, slow);
        }
    }
}
