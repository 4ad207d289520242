//! The lumen by fast marching on grey-level statistics and gradients, as [P1] II.C.2 has it: a front that starts at
//! the seed runs where the grey level is likelier lumen than tissue, slows at edges and is stopped at the wall.
//!
//! Its border lies inside the wall (the wall's lateral skirt fills the lumen after log compression, FIELD.md
//! section 8): it says where the lumen is, and [`fit`](super::fit) says how large.

use std::cell::Cell;

use super::NoLumen;
use super::shadow::Shadows;
use crate::fast_marching::{MarchGrid, march};
use crate::patch::{Patch, decibel};

/// Directions in which a border is described.
pub(crate) const RAYS: usize = 72;

/// A seed that is not this much darker than its surroundings is in no lumen (dB): half of what speckle's holes reach
/// after smoothing.
const LEAST_CONTRAST_DB: f64 = 6.0;
/// A front is slow below this part of its full speed, and stands when it is so over about this many cells.
const SLOW: f64 = 0.15;
const STANDS_AFTER: f64 = 20.0;

/// What the front filled.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    /// Its centre of gravity (m, in the image).
    pub(crate) centre: (f64, f64),
    /// Distance of its border from there along each ray (m).
    pub(crate) radii: Vec<f64>,
    /// Its area over the area inside `radii`: well above 1 where it runs on into a branch.
    pub(crate) excess: f64,
    /// What shadows do to the picture there.
    pub(crate) shadows: Shadows,
}

/// What the front filled, as [`Region`] has it.
struct Filled {
    centre: (f64, f64),
    radii: Vec<f64>,
    excess: f64,
}

/// Decibels of lumen and tissue, as normal distributions.
struct Statistics {
    lumen: (f64, f64),
    tissue: (f64, f64),
}

/// Standard deviations of the smoothing, in widths of the point spread: speckle is as coarse as that is wide, and its
/// holes are as deep after it in every picture.
const SMOOTH: (f64, f64) = (0.18, 0.57);

/// Grows the region round `seed` (m, in the image), where a point is this wide (full widths along x and y, m); no front
/// runs through what `shadows` cover.
pub(crate) fn grow(
    mut patch: Patch,
    shadows: Shadows,
    seed: (f64, f64),
    widths: (f64, f64),
) -> Result<Region, NoLumen> {
    shadows.fill(&mut patch);
    let filled = grown_in(&patch, seed, widths)?;
    Ok(Region { centre: filled.centre, radii: filled.radii, excess: filled.excess, shadows })
}

fn grown_in(patch: &Patch, seed: (f64, f64), widths: (f64, f64)) -> Result<Filled, NoLumen> {
    let outside = NoLumen::OutsidePicture { x_mm: seed.0 * 1e3, y_mm: seed.1 * 1e3 };
    let smooth = patch.smoothed((SMOOTH.0 * widths.0, SMOOTH.1 * widths.1));
    let db: Vec<f32> = smooth.iter().map(|power| decibel(*power)).collect();
    let start = darkest_near(patch, &smooth, seed, 1.0e-3).ok_or(outside)?;
    let (lumen, tissue) = (lumen_round(patch, &db, start), tissue(&db));
    let contrast_db = tissue.0 - lumen.0;
    if contrast_db < LEAST_CONTRAST_DB {
        return Err(NoLumen::NoContrast { contrast_db });
    }
    // A front that finds no border has run out through a dark speckle in the wall: the wall is taken to be darker.
    let mut found = Err(NoLumen::Unsettled);
    for darker in [0.0, 0.2, 0.35] {
        let tissue = (tissue.0 - darker * contrast_db, tissue.1);
        found = grow_with(patch, &db, start, Statistics { lumen, tissue });
        if !matches!(found, Err(NoLumen::NoBorder { .. })) {
            break;
        }
    }
    found
}

fn grow_with(patch: &Patch, db: &[f32], start: usize, mut statistics: Statistics) -> Result<Filled, NoLumen> {
    statistics.sharpen();
    let first = fill(patch, db, start, &statistics);
    // Learned again from what was filled, unless that has run out of the lumen.
    if describe(patch, &first).is_ok() {
        statistics.lumen = moments(first.iter().map(|&cell| f64::from(db[cell])));
        statistics.sharpen();
    }
    describe(patch, &fill(patch, db, start, &statistics))
}

impl Statistics {
    /// The probability that a cell is lumen, divided by what the gradient there is worth.
    fn speed(&self, grid: &MarchGrid, db: &[f32], cell: usize) -> f32 {
        let (lumen, tissue) = (self.lumen, self.tissue);
        // Darker than lumen is lumen, brighter than tissue is tissue.
        let away = |from: (f64, f64), value: f64| -0.5 * ((value - from.0) / from.1).powi(2) - from.1.ln();
        let value = f64::from(db[cell]).clamp(lumen.0, tissue.0.max(lumen.0));
        let odds = away(tissue, value) - away(lumen, value);
        let slope = |a: usize, b: usize, d: f64| f64::from(db[a] - db[b]) / (2.0 * d);
        let (x, y) = (cell % grid.columns, cell / grid.columns);
        let right = if x + 1 < grid.columns { cell + 1 } else { cell };
        let below = if y + 1 < grid.rows { cell + grid.columns } else { cell };
        let gx = slope(right, if x > 0 { cell - 1 } else { cell }, grid.dx);
        let gy = slope(below, if y > 0 { cell - grid.columns } else { cell }, grid.dy);
        // 20 dB a millimetre is an edge; speckle has half of it.
        let edge = (gx * gx + gy * gy) / 4e8;
        (1.0 / ((1.0 + odds.exp()) * (1.0 + edge)) + 1e-4) as f32
    }

    /// Where the two overlap widely, the front would run through speckle: neither is wider than a third of what
    /// lies between them.
    fn sharpen(&mut self) {
        let widest = ((self.tissue.0 - self.lumen.0) / 3.0).max(1.0);
        self.lumen.1 = self.lumen.1.min(widest);
        self.tissue.1 = self.tissue.1.min(widest);
    }
}

/// The cell within `reach` of a place round which it is darkest: wide enough that a speckle's hole is not taken for
/// the lumen.
fn darkest_near(patch: &Patch, power: &[f32], place: (f64, f64), reach: f64) -> Option<usize> {
    patch.cell_at(place)?;
    let round = |cell: usize| {
        let (sum, count) = patch
            .within(patch.place(cell), 0.55e-3)
            .fold((0.0, 0.0), |(sum, count), near| (sum + power[near], count + 1.0));
        sum / count
    };
    let means = patch.within(place, reach).map(|cell| (cell, round(cell)));
    means.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(cell, _)| cell)
}

/// What the lumen looks like, learned round the seed.
fn lumen_round(patch: &Patch, db: &[f32], start: usize) -> (f64, f64) {
    moments(patch.within(patch.place(start), 0.5e-3).map(|cell| f64::from(db[cell])))
}

/// What surrounds it looks like: the brighter half of the window, of which every third cell is asked.
fn tissue(db: &[f32]) -> (f64, f64) {
    let mut some: Vec<f32> = db.iter().copied().step_by(3).collect();
    let middle = some.len() / 2;
    let (_, median, brighter) = some.select_nth_unstable_by(middle, f32::total_cmp);
    moments(std::iter::once(&*median).chain(&*brighter).map(|db| f64::from(*db)))
}

/// Mean and standard deviation; the latter at least 2.5 dB, what averaged speckle leaves.
fn moments(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for value in values {
        n += 1.0;
        sum += value;
        squares += value * value;
    }
    let mean = sum / f64::max(n, 1.0);
    (mean, (squares / f64::max(n, 1.0) - mean * mean).max(0.0).sqrt().max(2.5))
}

/// The cells the front reaches before it stands.
fn fill(patch: &Patch, db: &[f32], start: usize, statistics: &Statistics) -> Vec<usize> {
    let grid = MarchGrid { columns: patch.columns, rows: patch.rows, dx: patch.cell.0, dy: patch.cell.1 };
    let speeds: Vec<Cell<f32>> = vec![Cell::new(f32::NAN); db.len()];
    let speed = |cell: usize| {
        let known = speeds[cell].get();
        let found = if known.is_nan() { statistics.speed(&grid, db, cell) } else { known };
        speeds[cell].set(found);
        f64::from(found)
    };
    // The front stands when what it takes in is slow on the average: it has met the wall nearly everywhere.
    let mut recent = 1.0;
    let mut cells = Vec::new();
    march(&grid, speed, &[start], |cell, _| {
        recent += (speed(cell) - recent) / STANDS_AFTER;
        cells.push(cell);
        recent > SLOW
    });
    cells.retain(|&cell| speed(cell) > SLOW);
    cells
}

/// Centre and border of the filled cells.
fn describe(patch: &Patch, cells: &[usize]) -> Result<Filled, NoLumen> {
    let area = cells.len() as f64 * patch.cell.0 * patch.cell.1;
    let mut filled = vec![false; patch.power.len()];
    cells.iter().for_each(|&cell| filled[cell] = true);
    let at_edge = cells.iter().filter(|&&cell| on_edge(patch, cell)).count();
    if at_edge > (patch.columns + patch.rows) / 4 || 2 * cells.len() > patch.power.len() {
        return Err(NoLumen::NoBorder { area_mm2: area * 1e6 });
    }
    if cells.len() < 4 {
        return Err(NoLumen::Radius { radius_mm: (area / std::f64::consts::PI).sqrt() * 1e3 });
    }
    let n = cells.len() as f64;
    let sum = cells.iter().map(|&cell| patch.place(cell)).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    let centre = (sum.0 / n, sum.1 / n);
    let raw: Vec<f64> = (0..RAYS).map(|ray| border(patch, &filled, centre, ray)).collect();
    let mut sorted = raw.clone();
    sorted.sort_by(f64::total_cmp);
    // A leak through a weak piece of wall, or a branch, reaches far in few directions.
    let median = sorted[RAYS / 2];
    // Cells that lie round their centre are those of a lumen, a heap of speckle's holes has none there.
    if median <= 0.0 {
        return Err(NoLumen::Radius { radius_mm: 0.0 });
    }
    let far = 1.6 * median;
    let radii: Vec<f64> = (0..RAYS).map(|ray| median_round(&raw, ray).min(far)).collect();
    let inside: f64 = radii.iter().map(|r| r * r).sum::<f64>() * std::f64::consts::PI / RAYS as f64;
    Ok(Filled { centre, radii, excess: area / inside.max(1e-12) })
}

fn on_edge(patch: &Patch, cell: usize) -> bool {
    let (x, y) = (cell % patch.columns, cell / patch.columns);
    x == 0 || y == 0 || x + 1 == patch.columns || y + 1 == patch.rows
}

/// The direction of a ray.
pub(crate) fn angle(ray: usize) -> f64 {
    ray as f64 * std::f64::consts::TAU / RAYS as f64
}

/// How far the filled cells go along a ray; a hole of less than 0.3 mm is speckle.
fn border(patch: &Patch, filled: &[bool], centre: (f64, f64), ray: usize) -> f64 {
    let (sin, cos) = angle(ray).sin_cos();
    let step = 0.5 * patch.cell.0.min(patch.cell.1);
    let (mut last, mut r) = (0.0, 0.0);
    while r - last < 0.3e-3 {
        match patch.cell_at((centre.0 + r * cos, centre.1 + r * sin)) {
            Some(cell) if filled[cell] => last = r,
            Some(_) => {}
            None => break,
        }
        r += step;
    }
    last
}

fn median_round(radii: &[f64], ray: usize) -> f64 {
    let mut near: Vec<f64> = (0..5).map(|k| radii[(ray + RAYS + k - 2) % RAYS]).collect();
    near.sort_by(f64::total_cmp);
    near[2]
}
