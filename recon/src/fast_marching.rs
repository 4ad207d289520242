//! First-order fast marching: when does a front that starts at a seed arrive (Sethian 1996).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A grid of `columns` x `rows` cells, row after row, with the distance between neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarchGrid {
    /// Cells along a row.
    pub columns: usize,
    /// Cells along a column.
    pub rows: usize,
    /// Distance of neighbours along a row.
    pub dx: f64,
    /// Distance of neighbours along a column.
    pub dy: f64,
}

/// A cell the front may reach next. The heap gives the earliest.
#[derive(PartialEq)]
struct Trial {
    arrival: f64,
    cell: usize,
}

impl Eq for Trial {}

impl Ord for Trial {
    fn cmp(&self, other: &Self) -> Ordering {
        other.arrival.total_cmp(&self.arrival).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Trial {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The arrival time of a front in every cell: `|grad T| F = 1`, `T = 0` at the seeds, with `speed(cell)` F, which is
/// asked only beside the front.
/// `go_on(cell, arrival)` is asked as each cell is accepted, in the order of arrival; the march ends when it says
/// false. Cells never accepted are infinite, as are those of no speed.
///
/// Seeds outside the grid are passed over.
pub fn march(
    grid: &MarchGrid,
    mut speed: impl FnMut(usize) -> f64,
    seeds: &[usize],
    mut go_on: impl FnMut(usize, f64) -> bool,
) -> Vec<f64> {
    let count = grid.columns * grid.rows;
    let mut arrival = vec![f64::INFINITY; count];
    let mut accepted = vec![false; count];
    let mut heap = BinaryHeap::new();
    for &cell in seeds.iter().filter(|&&cell| cell < count) {
        arrival[cell] = 0.0;
        heap.push(Trial { arrival: 0.0, cell });
    }
    while let Some(trial) = heap.pop() {
        if accepted[trial.cell] {
            continue;
        }
        accepted[trial.cell] = true;
        if !go_on(trial.cell, trial.arrival) {
            break;
        }
        for cell in neighbours(grid, trial.cell) {
            if accepted[cell] {
                continue;
            }
            let f = speed(cell);
            if f.is_nan() || f <= 0.0 {
                continue;
            }
            let time = update(grid, &arrival, &accepted, cell, 1.0 / f);
            if time < arrival[cell] {
                arrival[cell] = time;
                heap.push(Trial { arrival: time, cell });
            }
        }
    }
    for (time, accepted) in arrival.iter_mut().zip(accepted) {
        if !accepted {
            *time = f64::INFINITY;
        }
    }
    arrival
}

/// The up to four neighbours of a cell.
fn neighbours(grid: &MarchGrid, cell: usize) -> impl Iterator<Item = usize> + use<> {
    let (columns, rows) = (grid.columns, grid.rows);
    let (x, y) = (cell % columns, cell / columns);
    [
        (x > 0).then(|| cell - 1),
        (x + 1 < columns).then(|| cell + 1),
        (y > 0).then(|| cell - columns),
        (y + 1 < rows).then(|| cell + columns),
    ]
    .into_iter()
    .flatten()
}

/// The upwind solution of the quadratic `sum ((T - t_i) / d_i)^2 = slowness^2` in a cell.
fn update(grid: &MarchGrid, arrival: &[f64], accepted: &[bool], cell: usize, slowness: f64) -> f64 {
    let known = |cell: usize| if accepted[cell] { arrival[cell] } else { f64::INFINITY };
    let (x, y) = (cell % grid.columns, cell / grid.columns);
    let left = if x > 0 { known(cell - 1) } else { f64::INFINITY };
    let right = if x + 1 < grid.columns { known(cell + 1) } else { f64::INFINITY };
    let above = if y > 0 { known(cell - grid.columns) } else { f64::INFINITY };
    let below = if y + 1 < grid.rows { known(cell + grid.columns) } else { f64::INFINITY };
    let (a, b) = (left.min(right), above.min(below));
    let alone = (a + grid.dx * slowness).min(b + grid.dy * slowness);
    if a.is_infinite() || b.is_infinite() {
        return alone;
    }
    let (wx, wy) = (1.0 / (grid.dx * grid.dx), 1.0 / (grid.dy * grid.dy));
    let (sum, mean) = (wx + wy, wx * a + wy * b);
    let root = mean * mean - sum * (wx * a * a + wy * b * b - slowness * slowness);
    if root < 0.0 {
        return alone;
    }
    let both = (mean + root.sqrt()) / sum;
    if both >= a.max(b) { both } else { alone }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: MarchGrid = MarchGrid { columns: 81, rows: 61, dx: 0.5, dy: 0.25 };

    #[test]
    fn the_front_of_a_point_arrives_after_its_distance() {
        let seed = 30 * 81 + 40;
        let arrival = march(&GRID, |_| 2.0, &[seed], |_, _| true);
        let mut worst: f64 = 0.0;
        for (cell, time) in arrival.iter().enumerate() {
            let (x, y) = ((cell % 81) as f64 - 40.0, (cell / 81) as f64 - 30.0);
            let exact = (x * 0.5).hypot(y * 0.25) / 2.0;
            worst = worst.max((time - exact).abs());
        }
        // First order: the error of a point source grows with h log(1/h).
        assert!(worst < 0.45, "{worst}");
    }

    #[test]
    fn every_arrival_solves_the_upwind_equation() {
        // An independent road: Gauss-Seidel sweeps of the same scheme until nothing changes.
        let mut state = 7_u64;
        let speed: Vec<f64> = (0..81 * 61)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                0.1 + (state >> 40) as f64 / (1_u64 << 24) as f64
            })
            .collect();
        let arrival = march(&GRID, |cell| speed[cell], &[100, 3000], |_, _| true);
        let mut swept = vec![f64::INFINITY; speed.len()];
        (swept[100], swept[3000]) = (0.0, 0.0);
        let all = vec![true; speed.len()];
        for _ in 0..400 {
            for cell in (0..speed.len()).filter(|&cell| cell != 100 && cell != 3000) {
                swept[cell] = swept[cell].min(update(&GRID, &swept, &all, cell, 1.0 / speed[cell]));
            }
        }
        for (a, b) in arrival.iter().zip(&swept) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn the_march_ends_when_told_and_goes_round_walls() {
        let mut speed = vec![1.0; 81 * 61];
        for row in 1..61 {
            speed[row * 81 + 40] = 0.0;
        }
        let arrival = march(&GRID, |cell| speed[cell], &[30 * 81 + 39], |_, _| true);
        assert!(arrival[30 * 81 + 40].is_infinite());
        assert!(arrival[30 * 81 + 41] > 14.0, "{}", arrival[30 * 81 + 41]);
        let mut last = 0.0;
        let ended = march(
            &GRID,
            |cell| speed[cell],
            &[30 * 81 + 39],
            |_, time| {
                assert!(time >= last, "arrivals come in order");
                last = time;
                time < 3.0
            },
        );
        assert!(ended.iter().all(|&time| time <= last || time.is_infinite()));
    }

    #[test]
    fn a_seed_off_the_grid_and_a_speed_that_is_not_a_number_reach_nothing() {
        let arrival = march(&GRID, |_| f64::NAN, &[1_000_000, 5], |_, _| true);
        assert_eq!(arrival.iter().filter(|time| time.is_finite()).count(), 1);
    }
}
