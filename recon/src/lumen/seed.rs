//! The first seed, when nobody gives one: something dark and round with a bright wall all round it.

use probepath_us_capture::BScan;

use super::NoLumen;
use crate::LumenSettings;
use crate::patch::{Patch, PowerOfGrey, decibel};

/// Directions in which a wall is looked for.
const SECTORS: usize = 12;
/// A circle whose surroundings are not this much brighter than its inside is no vessel (dB).
const LEAST_CONTRAST_DB: f64 = 9.0;
/// How far outside a circle a wall is looked for (m).
const ROUND_M: [f64; 3] = [0.2e-3, 0.7e-3, 1.2e-3];

/// Opposite corners of a box in the image (m).
pub(crate) type Corners = [(f64, f64); 2];

/// The whole picture.
pub(crate) fn everywhere(bscan: &BScan) -> Corners {
    let spacing = bscan.setting.spacing;
    [(0.0, 0.0), (bscan.width() as f64 * spacing.x_m, bscan.height() as f64 * spacing.y_m)]
}

/// The centre of the most vessel-like circle (m, in the image), of the places within a box that are allowed.
pub(crate) fn find(
    bscan: &BScan,
    table: &PowerOfGrey,
    settings: &LumenSettings,
    within: Corners,
    allowed: impl Fn((f64, f64)) -> bool,
) -> Result<(f64, f64), NoLumen> {
    let setting = &bscan.setting;
    let middle = 0.5 * everywhere(bscan)[1].0;
    let (from, to) = settings.depth_range_m;
    let nothing = NoLumen::NothingRound { from_mm: from * 1e3, to_mm: to * 1e3 };
    let farthest = radii(settings.radius_range_m).fold(0.0, f64::max) + ROUND_M[2];
    let [low, high] = within;
    let centre = (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1));
    let half = (high.0 - centre.0 + farthest, high.1 - centre.1 + farthest);
    let patch = Patch::around(bscan, table, centre, half, (0.5e-3, 0.5e-3)).ok_or(nothing)?;
    let db: Vec<f32> = patch.smoothed((0.4e-3, 0.3e-3)).iter().map(|power| decibel(*power)).collect();
    let mut best = (LEAST_CONTRAST_DB, None);
    let circles: Vec<Circle> =
        radii(settings.radius_range_m).map(|radius| Circle::new(radius, patch.cell)).collect();
    let grid = Decibels { columns: patch.columns, rows: patch.rows, db: &db };
    for cell in 0..db.len() {
        let at = patch.place(cell);
        let inside = (low.0..=high.0).contains(&at.0) && (low.1..=high.1).contains(&at.1);
        if !inside || !(from..to).contains(&(at.1 + setting.window_top_m)) || !allowed(at) {
            continue;
        }
        // A sonographer keeps the artery in the middle: a fifth of a decibel for every millimetre off it.
        let off = 200.0 * (at.0 - middle).abs();
        let (column, row) = (cell % patch.columns, cell / patch.columns);
        for circle in &circles {
            if let Some(contrast) = circle.contrast(&grid, (column, row), best.0 + off) {
                best = (contrast - off, Some(at));
            }
        }
    }
    best.1.ok_or(nothing)
}

fn radii(range: (f64, f64)) -> impl Iterator<Item = f64> {
    (0..9).map(|k| 1.2e-3 + 0.6e-3 * f64::from(k)).filter(move |r| (range.0..range.1).contains(r))
}

/// A picture in decibels, row after row.
struct Decibels<'a> {
    columns: usize,
    rows: usize,
    db: &'a [f32],
}

impl Decibels<'_> {
    /// The value so many cells right of and below a cell; nothing outside the picture.
    fn beside(&self, (column, row): (usize, usize), (right, below): (isize, isize)) -> Option<f64> {
        let (column, row) = (column.checked_add_signed(right)?, row.checked_add_signed(below)?);
        if column >= self.columns || row >= self.rows {
            return None;
        }
        self.db.get(row * self.columns + column).map(|db| f64::from(*db))
    }
}

/// Where a circle is looked at, in cells from that of its centre: inside it, and round it in every direction.
struct Circle {
    inside: Vec<(isize, isize)>,
    round: [[(isize, isize); 3]; SECTORS],
}

impl Circle {
    fn new(radius: f64, cell: (f64, f64)) -> Self {
        let ray = |sector: usize| (sector as f64 * std::f64::consts::TAU / SECTORS as f64).sin_cos();
        let cells = |length: f64, cell: f64| (length / cell + 0.5).floor() as isize;
        let place =
            |sector: usize, r: f64| (cells(r * ray(sector).1, cell.0), cells(r * ray(sector).0, cell.1));
        let inside = |part: f64| (0..SECTORS).map(move |sector| place(sector, part * radius));
        Self {
            inside: inside(0.25).chain(inside(0.55)).collect(),
            round: std::array::from_fn(|sector| ROUND_M.map(|out| place(sector, radius + out))),
        }
    }

    /// How much brighter the darker quarter of the surroundings is than the inside (dB), where that is more than
    /// `least`.
    fn contrast(&self, grid: &Decibels<'_>, at: (usize, usize), least: f64) -> Option<f64> {
        let mut inside = 0.0;
        for by in &self.inside {
            inside += grid.beside(at, *by)? / self.inside.len() as f64;
        }
        let mut walls = [f64::NEG_INFINITY; SECTORS];
        let mut too_dark = 0;
        for (wall, round) in walls.iter_mut().zip(&self.round) {
            *wall = round.iter().filter_map(|by| grid.beside(at, *by)).fold(f64::NEG_INFINITY, f64::max);
            too_dark += usize::from(*wall - inside <= least);
            // More than the quarter that may be dark: most places are left after a few directions.
            if too_dark > SECTORS / 4 {
                return None;
            }
        }
        walls.sort_by(f64::total_cmp);
        Some(walls[SECTORS / 4] - inside)
    }
}
