//! The first seed, when nobody gives one: something dark and round with a bright wall all round it.

use probepath_us_capture::BScan;

use super::NoLumen;
use crate::LumenSettings;
use crate::patch::{Patch, PowerOfGrey, decibel};

/// Directions in which a wall is looked for.
const SECTORS: usize = 12;
/// A circle whose surroundings are not this much brighter than its inside is no vessel (dB).
const LEAST_CONTRAST_DB: f64 = 9.0;

/// The centre of the most vessel-like circle (m, in the image), of the places that are allowed.
pub(crate) fn find(
    bscan: &BScan,
    table: &PowerOfGrey,
    settings: &LumenSettings,
    allowed: impl Fn((f64, f64)) -> bool,
) -> Result<(f64, f64), NoLumen> {
    let setting = &bscan.setting;
    let size = (bscan.width() as f64 * setting.spacing.x_m, bscan.height() as f64 * setting.spacing.y_m);
    let (from, to) = settings.depth_range_m;
    let nothing = NoLumen::NothingRound { from_mm: from * 1e3, to_mm: to * 1e3 };
    let centre = (size.0 / 2.0, size.1 / 2.0);
    let patch = Patch::around(bscan, table, centre, centre, (0.5e-3, 0.5e-3)).ok_or(nothing)?;
    let db: Vec<f32> = patch.smoothed((0.4e-3, 0.3e-3)).iter().map(|power| decibel(*power)).collect();
    let mut best = (LEAST_CONTRAST_DB, None);
    let circles: Vec<Circle> = radii(settings.radius_range_m).map(Circle::new).collect();
    for cell in 0..db.len() {
        let at = patch.place(cell);
        if !allowed(at) || !(from..to).contains(&(at.1 + setting.window_top_m)) {
            continue;
        }
        // A sonographer keeps the artery in the middle: a fifth of a decibel for every millimetre off it.
        let off = 200.0 * (at.0 - centre.0).abs();
        for circle in &circles {
            let score = circle.contrast(&patch, &db, at) - off;
            if score > best.0 {
                best = (score, Some(at));
            }
        }
    }
    best.1.ok_or(nothing)
}

fn radii(range: (f64, f64)) -> impl Iterator<Item = f64> {
    (0..9).map(|k| 1.2e-3 + 0.6e-3 * f64::from(k)).filter(move |r| (range.0..range.1).contains(r))
}

/// Where a circle is looked at, from its centre (m): inside it, and round it in every direction.
struct Circle {
    inside: Vec<(f64, f64)>,
    round: [[(f64, f64); 3]; SECTORS],
}

impl Circle {
    fn new(radius: f64) -> Self {
        let ray = |sector: usize| (sector as f64 * std::f64::consts::TAU / SECTORS as f64).sin_cos();
        let place = |sector: usize, r: f64| (r * ray(sector).1, r * ray(sector).0);
        let inside = |part: f64| (0..SECTORS).map(move |sector| place(sector, part * radius));
        Self {
            inside: inside(0.25).chain(inside(0.55)).collect(),
            round: std::array::from_fn(|sector| {
                [0.2e-3, 0.7e-3, 1.2e-3].map(|out| place(sector, radius + out))
            }),
        }
    }

    /// How much brighter the darker quarter of the surroundings is than the inside (dB).
    fn contrast(&self, patch: &Patch, db: &[f32], at: (f64, f64)) -> f64 {
        let look =
            |by: &(f64, f64)| patch.cell_at((at.0 + by.0, at.1 + by.1)).map(|cell| f64::from(db[cell]));
        let mut inside = 0.0;
        for by in &self.inside {
            let Some(value) = look(by) else { return f64::NEG_INFINITY };
            inside += value / self.inside.len() as f64;
        }
        let mut walls = [f64::NEG_INFINITY; SECTORS];
        for (wall, round) in walls.iter_mut().zip(&self.round) {
            *wall = round.iter().filter_map(look).fold(f64::NEG_INFINITY, f64::max);
        }
        walls.sort_by(f64::total_cmp);
        walls[SECTORS / 4] - inside
    }
}
