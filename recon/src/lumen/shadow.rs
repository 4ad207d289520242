//! Shadows: columns of the picture under which next to nothing echoes, because plaque, bone, gas or lost contact keeps the
//! sound away. What lies in one is neither lumen nor wall; it is not asked.

use probepath_us_capture::BScan;

use crate::patch::{Patch, PowerOfGrey};

/// A column is in a shadow when it is this much darker than most (as a part of their power) in nearly every band of
/// depth from the lumen's middle down: a vein or a cyst under the lumen is dark in some of them.
const DARK: f32 = 0.2;
const BANDS_DARK: f64 = 0.85;
/// How high a band is, and how far columns are averaged (m): several speckles together.
const BAND_M: f64 = 2e-3;
const ACROSS_M: f64 = 0.8e-3;
/// Fewer bands say nothing.
const LEAST_BANDS: usize = 3;
/// How far beside a shadow's edge the beam still meets it, in full widths: the picture is darker there by more than a
/// tenth.
const BESIDE: f64 = 0.6;
/// Pixels that are asked: one in so many along x and y.
const STEP: (usize, usize) = (2, 3);

/// Which columns of a picture are in a shadow at some depth.
#[derive(Clone, Debug)]
pub(crate) struct Shadows {
    step_m: f64,
    dark: Vec<bool>,
}

impl Shadows {
    /// From the picture below a depth in it (m), where the beam is this wide (full width, m).
    pub(crate) fn below(bscan: &BScan, table: &PowerOfGrey, depth_m: f64, width_m: f64) -> Self {
        let spacing = bscan.setting.spacing;
        let step_m = spacing.x_m * STEP.0 as f64;
        let first = (depth_m / spacing.y_m).clamp(0.0, bscan.height() as f64) as usize;
        let band = ((BAND_M / spacing.y_m).round() as usize).max(STEP.1);
        let rows: Vec<&[u8]> = bscan.pixels().chunks_exact(bscan.width()).skip(first).collect();
        let bands: Vec<Vec<bool>> = rows
            .chunks_exact(band)
            .map(|rows| darker_columns(rows, table, (ACROSS_M / step_m / 2.0).round() as usize))
            .collect();
        let columns = bscan.width().div_ceil(STEP.0);
        if bands.len() < LEAST_BANDS {
            return Self { step_m, dark: vec![false; columns] };
        }
        let needed = (BANDS_DARK * bands.len() as f64).ceil() as usize;
        let dark = |column: usize| bands.iter().filter(|band| band[column]).count() >= needed;
        let core: Vec<bool> = (0..columns).map(dark).collect();
        let beside = (BESIDE * width_m / step_m).round() as usize;
        let near = |column: usize| {
            core[column.saturating_sub(beside)..(column + beside + 1).min(columns)].contains(&true)
        };
        Self { step_m, dark: (0..columns).map(near).collect() }
    }

    /// Whether a place lies in a shadow (m along x, from the middle of the first column).
    pub(crate) fn cover(&self, x_m: f64) -> bool {
        let column = (x_m / self.step_m).round();
        column >= 0.0 && self.dark.get(column as usize).copied().unwrap_or(false)
    }

    /// Makes what is in a shadow as bright as the rest is on the mean: no front runs there.
    pub(crate) fn fill(&self, patch: &mut Patch) {
        if !self.dark.contains(&true) {
            return;
        }
        let covered: Vec<bool> = (0..patch.columns).map(|column| self.cover(patch.place(column).0)).collect();
        let seen = |cell: usize| !covered[cell % patch.columns];
        let (mut sum, mut count) = (0.0_f32, 0.0_f32);
        for (_, power) in patch.power.iter().enumerate().filter(|(cell, _)| seen(*cell)) {
            (sum, count) = (sum + power, count + 1.0);
        }
        let mean = sum / count.max(1.0);
        let columns = patch.columns;
        for (cell, power) in patch.power.iter_mut().enumerate() {
            if covered[cell % columns] {
                *power = mean;
            }
        }
    }
}

/// Of every second column of a few rows: whether it is darker than most.
fn darker_columns(rows: &[&[u8]], table: &PowerOfGrey, half: usize) -> Vec<bool> {
    let columns = rows.first().map_or(0, |row| row.len().div_ceil(STEP.0));
    let mut power = vec![0.0_f32; columns];
    for row in rows.iter().step_by(STEP.1) {
        let pixels = row.iter().step_by(STEP.0);
        power.iter_mut().zip(pixels).for_each(|(sum, &grey)| *sum += table.single(grey));
    }
    let mut sums = vec![0.0_f32; columns + 1];
    for (column, power) in power.iter().enumerate() {
        sums[column + 1] = sums[column] + power;
    }
    let across = |column: usize| {
        let (from, to) = (column.saturating_sub(half), (column + half + 1).min(columns));
        (sums[to] - sums[from]) / (to - from) as f32
    };
    let means: Vec<f32> = (0..columns).map(across).collect();
    let mut sorted = means.clone();
    let middle = columns / 2;
    if middle >= columns {
        return Vec::new();
    }
    let usual = *sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
    means.iter().map(|mean| *mean < DARK * usual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::{Phantom, Shadow, Vein};

    fn shadows(phantom: &Phantom) -> Vec<(f64, bool)> {
        let image = phantom.bscan(0, 0.0);
        let shadows = Shadows::below(&image.bscan, &PowerOfGrey::new(60.0), 0.015, 1.7e-3);
        (0..31).map(|mm| (f64::from(mm), shadows.cover(f64::from(mm) * 1e-3))).collect()
    }

    #[test]
    fn a_shadow_is_found_with_what_lies_beside_it_and_nothing_else_is() {
        for (seed, loss_db) in [(171, 15.0), (172, 20.0), (173, 30.0)] {
            let shadow = Some(Shadow { across: (2.0, 6.0), below: 22.0, loss_db });
            let phantom = Phantom { shadow, pixels: (320, 240), seed, ..Phantom::default() };
            let middle = 0.5 * phantom.window.1;
            for (mm, covered) in shadows(&phantom) {
                let off = mm - middle;
                let (inside, beside) = ((2.5..=5.5).contains(&off), (0.0..=8.0).contains(&off));
                assert!(covered || !inside, "{seed}: {off} mm is in it");
                assert!(!covered || beside, "{seed}: {off} mm is not");
            }
        }
    }

    #[test]
    fn lumens_veins_and_the_dark_deep_are_no_shadows() {
        let vein = Some(Vein { off: (0.0, 8.5), radius: 4.0, wall: (0.4, 0.6) });
        let plain = Phantom { pixels: (320, 240), ..Phantom::default() };
        let phantoms = [
            plain.clone(),
            Phantom { vein, ..plain.clone() },
            Phantom { gain_db: -20.0, ..plain.clone() },
            Phantom { echoes: (0.02, 0.8, 0.1), ..plain },
        ];
        for phantom in &phantoms {
            for seed in 180..190 {
                let covered = shadows(&Phantom { seed, ..phantom.clone() });
                assert!(covered.iter().all(|(_, covered)| !covered), "{seed}: {covered:?}");
            }
        }
    }
}
