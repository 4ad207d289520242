//! Shadows: columns of the picture under which less echoes than elsewhere, because plaque, bone, gas or lost contact keeps
//! the sound away. A shadow is as dark as a lumen and is none. Where enough comes back all the way from above the lumen
//! down, it is made as bright as the rest; elsewhere it is not asked.

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
/// A shadow that is to be made up for begins at least this far above the lumen's middle (m) or runs up to the picture's edge,
/// and leaves this part of the power and this many times what black stands for.
const ABOVE_M: f64 = 7e-3;
const LEAST_GAIN: f32 = 0.003;
const OVER_BLACK: f32 = 10.0;
/// Bands in order of brightness: what a column loses is that of this part of them, because the lumen darkens some.
const TYPICAL: f64 = 0.65;
/// Pixels that are asked: one in so many along x and y.
const STEP: (usize, usize) = (2, 3);

/// What shadows do to the columns of a picture round some depth.
#[derive(Clone, Debug)]
pub(crate) struct Shadows {
    step_m: f64,
    /// What is left of each column's power; zero where nothing can be said.
    gains: Vec<f32>,
}

impl Shadows {
    /// From the picture round a depth in it (m), where the beam is this wide (full width, m).
    pub(crate) fn below(bscan: &BScan, table: &PowerOfGrey, depth_m: f64, width_m: f64) -> Self {
        let spacing = bscan.setting.spacing;
        let step_m = spacing.x_m * STEP.0 as f64;
        let first = (depth_m / spacing.y_m).clamp(0.0, bscan.height() as f64) as usize;
        let height = ((BAND_M / spacing.y_m).round() as usize).max(STEP.1);
        let half = (ACROSS_M / step_m / 2.0).round() as usize;
        let rows: Vec<&[u8]> = bscan.pixels().chunks_exact(bscan.width()).collect();
        let (above, below) = rows.split_at(first.min(rows.len()));
        let below: Vec<Band> =
            below.chunks_exact(height).filter_map(|rows| Band::of(rows, table, half)).collect();
        let columns = bscan.width().div_ceil(STEP.0);
        let mut shadows = Self { step_m, gains: vec![1.0; columns] };
        let core: Vec<bool> = (0..columns).map(|column| dark(&below, column)).collect();
        if below.len() < LEAST_BANDS || !core.contains(&true) {
            return shadows;
        }
        let most = (ABOVE_M / BAND_M).ceil() as usize;
        let above = above.rchunks_exact(height).take(most).filter_map(|rows| Band::of(rows, table, half));
        let beside = (BESIDE * width_m / step_m).round() as usize;
        shadows.fall(&core, beside, &below, &above.collect::<Vec<_>>(), OVER_BLACK * table.single(0));
        shadows
    }

    /// Each shadow, with what lies `beside` its core.
    fn fall(&mut self, core: &[bool], beside: usize, below: &[Band], above: &[Band], least: f32) {
        let mut from = 0;
        while let Some(start) = core.iter().skip(from).position(|core| *core).map(|at| from + at) {
            // Cores whose surroundings meet are one shadow.
            let mut end = start + 1;
            while let Some(next) = core.iter().take(end + 2 * beside + 1).rposition(|core| *core)
                && next >= end
            {
                end = next + 1;
            }
            let shadow = start.saturating_sub(beside)..(end + beside).min(core.len());
            let gains: Vec<f32> = shadow.clone().map(|column| gain(column, below, above)).collect();
            // At its edges less is lost.
            let whole = 2 * (start..end).filter(|column| dark(above, *column)).count() > end - start;
            let shows = gains.iter().all(|gain| *gain > LEAST_GAIN)
                && (start..end).all(|column| typical(below, above, |band| band.power[column]) > least);
            for (column, gain) in shadow.zip(gains) {
                self.gains[column] = if whole && shows { gain } else { 0.0 };
            }
            from = end;
        }
    }

    /// What is left of the power at a place (m along x, from the middle of the first column); zero where nothing can be
    /// said.
    pub(crate) fn gain(&self, x_m: f64) -> f32 {
        let column = (x_m / self.step_m).round();
        if column >= 0.0 { self.gains.get(column as usize).copied().unwrap_or(1.0) } else { 1.0 }
    }

    /// Whether nothing can be said of a place.
    pub(crate) fn cover(&self, x_m: f64) -> bool {
        self.gain(x_m) <= 0.0
    }

    /// Makes up for what is lost, and what nothing can be said of as bright as the rest is on the mean: no front runs there.
    pub(crate) fn fill(&self, patch: &mut Patch) {
        let gains: Vec<f32> = (0..patch.columns).map(|column| self.gain(patch.place(column).0)).collect();
        if gains.iter().all(|gain| *gain >= 1.0) {
            return;
        }
        let columns = patch.columns;
        let (mut sum, mut count) = (0.0_f32, 0.0_f32);
        for (cell, power) in
            patch.power.iter_mut().enumerate().filter(|(cell, _)| gains[cell % columns] > 0.0)
        {
            *power /= gains[cell % columns];
            (sum, count) = (sum + *power, count + 1.0);
        }
        let mean = sum / count.max(1.0);
        let hidden = patch.power.iter_mut().enumerate().filter(|(cell, _)| gains[cell % columns] <= 0.0);
        hidden.for_each(|(_, power)| *power = mean);
    }
}

/// Mean power of every second column of a few rows, averaged over columns beside it, and what is usual there.
struct Band {
    power: Vec<f32>,
    usual: f32,
}

impl Band {
    fn of(rows: &[&[u8]], table: &PowerOfGrey, half: usize) -> Option<Self> {
        let columns = rows.first().map_or(0, |row| row.len().div_ceil(STEP.0));
        let mut power = vec![0.0_f32; columns];
        for row in rows.iter().step_by(STEP.1) {
            let pixels = row.iter().step_by(STEP.0);
            power.iter_mut().zip(pixels).for_each(|(sum, &grey)| *sum += table.single(grey));
        }
        let count = rows.len().div_ceil(STEP.1) as f32;
        let mut sums = vec![0.0_f32; columns + 1];
        for (column, power) in power.iter().enumerate() {
            sums[column + 1] = sums[column] + power / count;
        }
        let across = |column: usize| {
            let (from, to) = (column.saturating_sub(half), (column + half + 1).min(columns));
            (sums[to] - sums[from]) / (to - from) as f32
        };
        let power: Vec<f32> = (0..columns).map(across).collect();
        let mut sorted = power.clone();
        let middle = columns / 2;
        let usual = (middle < columns).then(|| *sorted.select_nth_unstable_by(middle, f32::total_cmp).1)?;
        Some(Self { power, usual })
    }
}

/// Whether a column is darker than most in nearly every band.
fn dark(bands: &[Band], column: usize) -> bool {
    let needed = (BANDS_DARK * bands.len() as f64).ceil() as usize;
    bands.iter().filter(|band| band.power[column] < DARK * band.usual).count() >= needed
}

/// What is left of a column's power, at most all.
fn gain(column: usize, below: &[Band], above: &[Band]) -> f32 {
    let part = |band: &Band| band.power[column] / band.usual.max(f32::MIN_POSITIVE);
    typical(below, above, part).min(1.0)
}

/// What the bands typically have, where a lumen darkens some.
fn typical(below: &[Band], above: &[Band], of: impl Fn(&Band) -> f32) -> f32 {
    let mut each: Vec<f32> = below.iter().chain(above).map(of).collect();
    each.sort_by(f32::total_cmp);
    each.get((TYPICAL * each.len() as f64) as usize).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom_images::{Phantom, Shadow, Vein};

    /// What is left at every millimetre across, of an image with its lumen's middle 15 mm down.
    fn gains(phantom: &Phantom) -> Vec<(f64, f32)> {
        let image = phantom.bscan(0, 0.0);
        let shadows = Shadows::below(&image.bscan, &PowerOfGrey::new(60.0), 0.015, 1.7e-3);
        (0..31).map(|mm| (f64::from(mm), shadows.gain(f64::from(mm) * 1e-3))).collect()
    }

    /// A shadow from 2 to 6 mm right of the middle.
    fn shadowed(seed: u64, below: f64, loss_db: f64) -> Phantom {
        let shadow = Some(Shadow { across: (2.0, 6.0), below, loss_db });
        Phantom { shadow, pixels: (320, 240), seed, ..Phantom::default() }
    }

    #[test]
    fn a_shadow_is_found_with_what_lies_beside_it_and_nothing_else_is() {
        for (seed, loss_db) in [(171, 15.0), (172, 20.0), (173, 30.0), (174, 50.0)] {
            let phantom = shadowed(seed, 10.0, loss_db);
            let middle = 0.5 * phantom.window.1;
            for (mm, gain) in gains(&phantom) {
                let off = mm - middle;
                let (inside, beside) = ((2.5..=5.5).contains(&off), (0.0..=8.0).contains(&off));
                assert!(gain < 0.5 || !inside, "{seed}: {off} mm is in it, {gain}");
                assert!(gain >= 1.0 || beside, "{seed}: {off} mm is not, {gain}");
            }
        }
    }

    #[test]
    fn what_a_shadow_takes_is_made_up_for_where_enough_comes_back() {
        let (mut made_up, mut all) = (0, 0);
        for seed in 190..220 {
            let lost = |below: f64, loss_db: f64| -> f32 {
                let phantom = shadowed(seed, below, loss_db);
                let core = 0.5 * phantom.window.1 + 4.0;
                gains(&phantom)
                    .into_iter()
                    .find(|(mm, _)| (mm - core).abs() < 0.6)
                    .map_or(1.0, |(_, gain)| gain)
            };
            for loss_db in [15.0_f32, 20.0] {
                let gain = lost(10.0, f64::from(loss_db));
                // The beam brings in some echoes from beside the shadow.
                let right = (-4.0..5.0).contains(&(10.0 * gain.log10() + loss_db));
                assert!(right || gain <= 0.0, "{seed}: {loss_db} dB, {gain}");
                (made_up, all) = (made_up + usize::from(right), all + 1);
            }
            // Too little comes back, or the shadow begins at the lumen.
            assert!(lost(10.0, 50.0) <= 0.0 && lost(28.0, 20.0) <= 0.0, "{seed}");
        }
        assert!(10 * made_up >= 9 * all, "{made_up} of {all}");
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
                let gains = gains(&Phantom { seed, ..phantom.clone() });
                assert!(gains.iter().all(|(_, gain)| *gain >= 1.0), "{seed}: {gains:?}");
            }
        }
    }
}
