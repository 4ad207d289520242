//! The first seed, when nobody gives one: something dark and round with a bright wall all round it.

use probepath_us_capture::BScan;

use super::NoLumen;
use crate::LumenSettings;
use crate::patch::{Patch, PowerOfGrey};

/// Directions in which a wall is looked for.
const SECTORS: usize = 12;
/// A circle whose surroundings are not this much brighter than its inside is no vessel (dB).
const LEAST_CONTRAST_DB: f64 = 9.0;

/// The centre of the most vessel-like circle (m, in the image), within `near` of a place when one is given.
pub(crate) fn find(
    bscan: &BScan,
    table: &PowerOfGrey,
    settings: &LumenSettings,
    near: Option<((f64, f64), f64)>,
) -> Result<(f64, f64), NoLumen> {
    let setting = &bscan.setting;
    let size = (bscan.width() as f64 * setting.spacing.x_m, bscan.height() as f64 * setting.spacing.y_m);
    let (from, to) = settings.depth_range_m;
    let nothing = NoLumen::NothingRound { from_mm: from * 1e3, to_mm: to * 1e3 };
    let centre = (size.0 / 2.0, size.1 / 2.0);
    let patch = Patch::around(bscan, table, centre, centre, (0.5e-3, 0.5e-3)).ok_or(nothing)?;
    let db: Vec<f64> = patch.smoothed((0.4e-3, 0.3e-3)).iter().map(|p| 10.0 * p.max(1e-9).log10()).collect();
    let mut best = (LEAST_CONTRAST_DB, None);
    for cell in 0..db.len() {
        let at = patch.place(cell);
        let allowed = near.is_none_or(|(place, reach)| (at.0 - place.0).hypot(at.1 - place.1) <= reach);
        if !allowed || !(from..to).contains(&(at.1 + setting.window_top_m)) {
            continue;
        }
        // A sonographer keeps the artery in the middle: a fifth of a decibel for every millimetre off it.
        let off = 200.0 * (at.0 - centre.0).abs();
        for radius in radii(settings.radius_range_m) {
            let score = contrast(&patch, &db, at, radius) - off;
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

/// How much brighter the darker quarter of the surroundings is than the inside (dB).
fn contrast(patch: &Patch, db: &[f64], at: (f64, f64), radius: f64) -> f64 {
    let look = |r: f64, sector: usize| {
        let (sin, cos) = (sector as f64 * std::f64::consts::TAU / SECTORS as f64).sin_cos();
        patch.cell_at((at.0 + r * cos, at.1 + r * sin)).map(|cell| db[cell])
    };
    let (mut inside, mut n) = (0.0, 0.0);
    let mut walls = [f64::NEG_INFINITY; SECTORS];
    for (sector, wall) in walls.iter_mut().enumerate() {
        for part in [0.25, 0.55] {
            let Some(value) = look(part * radius, sector) else { return f64::NEG_INFINITY };
            inside += value;
            n += 1.0;
        }
        for out in [0.2e-3, 0.7e-3, 1.2e-3] {
            *wall = wall.max(look(radius + out, sector).unwrap_or(f64::NEG_INFINITY));
        }
    }
    walls.sort_by(f64::total_cmp);
    walls[SECTORS / 4] - inside / n
}
