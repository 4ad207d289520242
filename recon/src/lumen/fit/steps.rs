//! A border as cells see it: a step that is smeared over a cell, and over the planes of the beam.

use super::Plane;
use super::lattice::BINS;

/// Directions and distances for which the step is tabulated.
const ROWS: usize = 24;
const COUNT: usize = 48;
/// Bins of the lattice that share a row.
const BINS_A_ROW: usize = BINS / ROWS;

/// A step from 0 to 1 and its derivative, by direction and distance outward from the border.
pub(super) struct Steps {
    reach: f32,
    per_m: f32,
    values: Vec<[f32; 2]>,
}

impl Steps {
    /// For these planes, seen by cells of a size (m).
    pub(super) fn new(planes: &[Plane], cell: (f64, f64)) -> Self {
        let moved = |p: &Plane| p.wider.abs() + p.shift.0.hypot(p.shift.1);
        let reach = planes.iter().map(moved).fold(0.0, f64::max) + 0.5 * (cell.0 + cell.1);
        let mut values = Vec::with_capacity(ROWS * (COUNT + 1));
        for row in 0..ROWS {
            let (sin, cos) = ((row as f64 + 0.5) * std::f64::consts::TAU / ROWS as f64).sin_cos();
            let half = 0.5 * (cell.0 * cos.abs() + cell.1 * sin.abs());
            for k in 0..=COUNT {
                let distance = reach * (2.0 * k as f64 / COUNT as f64 - 1.0);
                let (step, slope) = planes.iter().fold((0.0, 0.0), |sum, plane| {
                    let moved = plane.wider + plane.shift.0 * cos + plane.shift.1 * sin;
                    let (step, slope) = ramp(distance - moved, half);
                    (sum.0 + plane.weight * step, sum.1 + plane.weight * slope)
                });
                values.push([step as f32, slope as f32]);
            }
        }
        Self { reach: reach as f32, per_m: (COUNT as f64 / (2.0 * reach)) as f32, values }
    }

    /// The row of a bin.
    pub(super) const fn row(bin: usize) -> usize {
        bin / BINS_A_ROW * (COUNT + 1)
    }

    /// Step and slope (1/m) at a distance outward from the border (m).
    #[inline]
    pub(super) fn at(&self, row: usize, distance: f32) -> (f32, f32) {
        if distance <= -self.reach {
            return (0.0, 0.0);
        }
        let t = (distance + self.reach) * self.per_m;
        let k = t as usize;
        if k >= COUNT {
            return (1.0, 0.0);
        }
        let (Some(a), Some(b)) = (self.values.get(row + k), self.values.get(row + k + 1)) else {
            return (1.0, 0.0);
        };
        let t = t - k as f32;
        (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]))
    }
}

/// A step from 0 to 1 over a cell, and its derivative by the distance.
fn ramp(distance: f64, half: f64) -> (f64, f64) {
    if distance <= -half {
        (0.0, 0.0)
    } else if distance >= half {
        (1.0, 0.0)
    } else {
        (0.5 + distance / (2.0 * half), 1.0 / (2.0 * half))
    }
}

#[cfg(test)]
mod tests {
    use super::super::lattice::direction;
    use super::*;

    #[test]
    fn a_table_of_steps_is_the_mean_of_the_planes_ramps() {
        let planes = [
            Plane { weight: 0.3, shift: (0.2e-3, 0.0), wider: -0.5e-3 },
            Plane { weight: 0.7, shift: (0.0, -0.1e-3), wider: 0.3e-3 },
        ];
        let steps = Steps::new(&planes, (0.4e-3, 0.15e-3));
        for bin in (0..BINS).step_by(7) {
            let row = bin / BINS_A_ROW;
            let (sin, cos) = ((row as f64 + 0.5) * std::f64::consts::TAU / ROWS as f64).sin_cos();
            assert!((direction(bin) - (row as f64 + 0.5) * std::f64::consts::TAU / ROWS as f64).abs() < 0.13);
            let half = 0.5 * (0.4e-3 * cos.abs() + 0.15e-3 * sin.abs());
            for k in -30..=30 {
                let distance = 0.05e-3 * f64::from(k);
                let exact: f64 = planes
                    .iter()
                    .map(|p| p.weight * ramp(distance - p.wider - p.shift.0 * cos - p.shift.1 * sin, half).0)
                    .sum();
                let found = steps.at(Steps::row(bin), distance as f32).0;
                assert!((f64::from(found) - exact).abs() < 0.06, "{bin} {distance} {found} {exact}");
            }
        }
    }
}
