//! The cells of a B-scan that the wall is fitted to: whole pixels, counted from the lumen's centre.

use probepath_us_capture::BScan;

use crate::lumen::shadow::Shadows;
use crate::patch::PowerOfGrey;

/// Directions that a cell may lie in; what changes round the vessel is tabulated for each.
pub(super) const BINS: usize = 144;

/// Cells of equal size round a centre, row after row. Those outside the picture have no weight.
pub(super) struct Lattice {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Size of a cell along x and y (m), and of a pixel.
    pub(super) cell: (f64, f64),
    pub(super) pixel: (f64, f64),
    /// Distance of each cell from the centre (m), and the direction it lies in.
    pub(super) r: Vec<f32>,
    pub(super) bin: Vec<u8>,
    /// Mean echo power.
    pub(super) power: Vec<f32>,
    /// 1 where the cell is looked at, 0 where not.
    pub(super) used: Vec<f32>,
}

/// What a lattice should be like (m).
pub(super) struct Wanted<'a> {
    pub(super) centre: (f64, f64),
    pub(super) half: (f64, f64),
    pub(super) cell: (f64, f64),
    /// What hides some of it.
    pub(super) shadows: &'a Shadows,
}

/// Cells along one axis.
struct Axis {
    /// First pixel, which may lie outside the picture.
    start: i64,
    /// Pixels a cell, and cells.
    pixels: usize,
    count: usize,
    /// Cells that lie in the picture whole.
    inside: std::ops::Range<usize>,
    /// Centre of the first cell, from the lattice's centre (m).
    first: f64,
}

impl Axis {
    fn new(centre: f64, half: f64, cell: f64, spacing: f64, picture: usize) -> Option<Self> {
        let pixels = (cell / spacing).round().clamp(1.0, 64.0);
        let beside = (half / (pixels * spacing)).ceil();
        if !(centre.is_finite() && beside < 400.0) {
            return None;
        }
        let start = (centre / spacing - (beside + 0.5) * pixels + 0.5).round() as i64;
        let (pixels, count) = (pixels as usize, 2 * beside as usize + 1);
        let first = (start as f64 + (pixels as f64 - 1.0) / 2.0) * spacing - centre;
        let low = (-start).max(0) as usize;
        let high = (picture as i64 - start).max(0) as usize;
        let inside = low.div_ceil(pixels).min(count)..(high / pixels).min(count);
        Some(Self { start, pixels, count, inside, first })
    }
}

impl Lattice {
    /// The cells round a centre; nothing when hardly any is in the picture.
    pub(super) fn new(bscan: &BScan, table: &PowerOfGrey, wanted: &Wanted<'_>) -> Option<Self> {
        let spacing = bscan.setting.spacing;
        let x = Axis::new(wanted.centre.0, wanted.half.0, wanted.cell.0, spacing.x_m, bscan.width())?;
        let y = Axis::new(wanted.centre.1, wanted.half.1, wanted.cell.1, spacing.y_m, bscan.height())?;
        if x.inside.len() < 4 || y.inside.len() < 4 {
            return None;
        }
        let count = x.count * y.count;
        let mut lattice = Self {
            columns: x.count,
            rows: y.count,
            cell: (x.pixels as f64 * spacing.x_m, y.pixels as f64 * spacing.y_m),
            pixel: (spacing.x_m, spacing.y_m),
            r: Vec::with_capacity(count),
            bin: Vec::with_capacity(count),
            power: vec![0.0; count],
            used: vec![0.0; count],
        };
        lattice.place(x.first, y.first);
        lattice.look(bscan, table, &x, &y)?;
        let (first, step) = (wanted.centre.0 + x.first, lattice.cell.0);
        lattice.out_of_shadows(|column| wanted.shadows.gain(first + column as f64 * step));
        Some(lattice)
    }

    /// Makes up for what columns have lost, and does not look at those that have lost all.
    fn out_of_shadows(&mut self, gain: impl Fn(usize) -> f32) {
        for column in 0..self.columns {
            let gain = gain(column);
            if gain >= 1.0 {
                continue;
            }
            let cells = self.power.iter_mut().zip(&mut self.used).skip(column).step_by(self.columns);
            for (power, used) in cells {
                (*power, *used) = if gain > 0.0 { (*power / gain, *used) } else { (*power, 0.0) };
            }
        }
    }

    /// Looks only at what is nearer to the centre than this (m), direction by direction.
    pub(super) fn limit(&mut self, farthest: impl Fn(usize) -> f64) {
        let farthest: [f32; BINS] = std::array::from_fn(|bin| farthest(bin) as f32);
        for ((r, bin), used) in self.r.iter().zip(&self.bin).zip(&mut self.used) {
            if *r >= farthest[usize::from(*bin)] {
                *used = 0.0;
            }
        }
    }

    /// The mean power between two distances from the centre (m), direction by direction; very little where there is
    /// no cell.
    pub(super) fn mean(&self, between: impl Fn(usize) -> (f64, f64)) -> f64 {
        let limits: [(f32, f32); BINS] = std::array::from_fn(|bin| {
            let (from, to) = between(bin);
            (from as f32, to as f32)
        });
        let (mut sum, mut count) = (1e-12, 1e-9);
        for ((r, bin), (power, used)) in self.r.iter().zip(&self.bin).zip(self.power.iter().zip(&self.used)) {
            let (from, to) = limits[usize::from(*bin)];
            if *used > 0.0 && (from..to).contains(r) {
                (sum, count) = (sum + f64::from(*power), count + 1.0);
            }
        }
        sum / count
    }

    fn place(&mut self, first_x: f64, first_y: f64) {
        for row in 0..self.rows {
            let dy = (first_y + row as f64 * self.cell.1) as f32;
            for column in 0..self.columns {
                let dx = (first_x + column as f64 * self.cell.0) as f32;
                self.r.push((dx * dx + dy * dy).sqrt());
                self.bin.push(((turn(dx, dy) * BINS as f32) as usize).min(BINS - 1) as u8);
            }
        }
    }

    /// Sums the pixels of each cell.
    fn look(&mut self, bscan: &BScan, table: &PowerOfGrey, x: &Axis, y: &Axis) -> Option<()> {
        let scale = 1.0 / (x.pixels * y.pixels) as f32;
        let left = (x.start + (x.inside.start * x.pixels) as i64) as usize;
        for row in y.inside.clone() {
            let out = row * self.columns + x.inside.start..row * self.columns + x.inside.end;
            let top = (y.start + (row * y.pixels) as i64) as usize;
            for line in top..top + y.pixels {
                let from = line * bscan.width() + left;
                let pixels = bscan.pixels().get(from..from + x.inside.len() * x.pixels)?;
                let cells = self.power[out.clone()].iter_mut();
                for (sum, pixels) in cells.zip(pixels.chunks_exact(x.pixels)) {
                    *sum += pixels.iter().map(|&grey| table.single(grey)).sum::<f32>() * scale;
                }
            }
            self.used[out].fill(1.0);
        }
        Some(())
    }
}

/// The direction of a bin's middle.
pub(super) fn direction(bin: usize) -> f64 {
    (bin as f64 + 0.5) * std::f64::consts::TAU / BINS as f64
}

/// The angle of a direction as a part of a whole turn, 0 to 1; good to 0.0002 rad (Hastings' arctangent).
fn turn(x: f32, y: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, PI, TAU};
    let (ax, ay) = (x.abs(), y.abs());
    let a = ax.min(ay) / ax.max(ay).max(1e-20);
    let s = a * a;
    let angle = ((-0.046_496_475 * s + 0.159_314_22) * s - 0.327_622_76) * s * a + a;
    let angle = if ay > ax { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    (if y < 0.0 { TAU - angle } else { angle }) / TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_the_angle_of_its_direction() {
        for k in 0..1000 {
            let angle = (f64::from(k) + 0.3) * std::f64::consts::TAU / 1000.0;
            let found = turn((3.0 * angle.cos()) as f32, (3.0 * angle.sin()) as f32);
            assert!((f64::from(found) * std::f64::consts::TAU - angle).abs() < 3e-4, "{angle}");
        }
        assert!(turn(0.0, 0.0).abs() < 1e-6);
    }

    #[test]
    fn an_axis_that_runs_off_the_picture_keeps_the_cells_inside() {
        let axis = Axis::new(1e-3, 3e-3, 0.3e-3, 0.1e-3, 40).expect("an axis");
        assert_eq!((axis.pixels, axis.count), (3, 21));
        let first_inside = axis.start + (axis.inside.start * axis.pixels) as i64;
        assert!((0..3).contains(&first_inside), "{first_inside}");
        let end = axis.start + (axis.inside.end * axis.pixels) as i64;
        assert!(end <= 40 && (end > 37 || axis.inside.end == axis.count), "{end}");
        let middle = axis.first + 10.0 * 0.3e-3;
        assert!(middle.abs() <= 0.05e-3 + 1e-12, "{middle}");
        assert!(Axis::new(f64::NAN, 3e-3, 0.3e-3, 0.1e-3, 40).is_none());
    }
}
