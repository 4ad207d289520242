//! What the probe's pressure does to the lumen: an artery under a pressed probe is flattened.

use crate::reconstruct::ReconWarning;
use crate::{Section, SectionMeasure};

/// Leg arteries are scanned with less than this (N).
pub const SOFT_N: f64 = 8.0;
/// Forces have to differ by this much to tell what they do (N).
const LEAST_SPREAD_N: f64 = 1.0;
/// Neighbouring sections are one observation over this length (mm): they share images and smoothing.
const ALONE_MM: f64 = 5.0;
/// Fewer observations say nothing.
const LEAST_COUNT: f64 = 8.0;
/// So many standard errors make a slope one: a false alarm in about 1 of 700 scans.
const CLEAR: f64 = 3.0;
/// A slope of less is no concern (part of the width per N).
const LEAST_SLOPE: f64 = 0.005;

/// How the lumen's flatness goes with the force: a straight line through all measured sections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compression {
    /// Change of the smallest width's part of the largest for each newton (1/N): negative where force flattens.
    pub slope_per_n: f64,
    /// Its standard error.
    pub slope_sd_per_n: f64,
    /// The least and the largest force (N).
    pub forces_n: [f64; 2],
    /// The mean force (N).
    pub mean_n: f64,
}

impl Compression {
    /// Of sections; none where no force was measured, or too little of the vessel.
    pub fn of(sections: &[Section]) -> Option<Self> {
        let row = |section: &Section| Some((section.force_n?, flatness(section.measure.as_ref()?)));
        let rows: Vec<(f64, f64)> =
            sections.iter().filter_map(row).filter(|(n, f)| n.is_finite() && f.is_finite()).collect();
        let count = rows.len() as f64;
        let step = step_mm(sections)?;
        // Only so many of the rows are independent.
        let own = count * (step / ALONE_MM).min(1.0);
        if own < LEAST_COUNT {
            return None;
        }
        let mean = rows.iter().fold((0.0, 0.0), |(x, y), row| (x + row.0 / count, y + row.1 / count));
        let (xx, xy, yy) = rows.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), row| {
            let (x, y) = (row.0 - mean.0, row.1 - mean.1);
            (xx + x * x, xy + x * y, yy + y * y)
        });
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        let rest = (yy - slope * xy).max(0.0) / count;
        let forces = rows.iter().map(|row| row.0);
        Some(Self {
            slope_per_n: slope,
            slope_sd_per_n: if xx > 0.0 { (rest / (xx / count) / (own - 2.0)).sqrt() } else { f64::INFINITY },
            forces_n: [forces.clone().fold(f64::INFINITY, f64::min), forces.fold(0.0, f64::max)],
            mean_n: mean.0,
        })
    }

    /// Whether the lumen is clearly flatter where the force is larger.
    pub fn flattens(&self) -> bool {
        self.forces_n[1] - self.forces_n[0] >= LEAST_SPREAD_N
            && -self.slope_per_n > (CLEAR * self.slope_sd_per_n).max(LEAST_SLOPE)
    }
}

/// The smallest width's part of the largest: 1 for a round lumen.
fn flatness(measure: &SectionMeasure) -> f64 {
    measure.least_diameter_mm / measure.largest_diameter_mm
}

fn step_mm(sections: &[Section]) -> Option<f64> {
    let length = sections.last()?.at_mm - sections.first()?.at_mm;
    (sections.len() > 1).then(|| length / (sections.len() - 1) as f64)
}

pub(super) fn warnings(sections: &[Section]) -> Vec<ReconWarning> {
    let force = |section: &Section| section.force_n.unwrap_or(0.0);
    let most = |run: &[Section]| run.iter().map(force).fold(0.0, f64::max);
    let pressed = super::stretches(sections, |section| force(section) > SOFT_N);
    let mut warnings: Vec<ReconWarning> = pressed
        .map(|run| ReconWarning::Pressed {
            from_mm: run[0].at_mm,
            to_mm: run[run.len() - 1].at_mm,
            most_n: most(run),
        })
        .collect();
    warnings.extend(Compression::of(sections).filter(Compression::flattens).map(|found| {
        let [least_n, most_n] = found.forces_n;
        ReconWarning::Flattened { percent_per_n: -100.0 * found.slope_per_n, least_n, most_n }
    }));
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::table::tests::section;
    use crate::phantom_images::Dice;

    /// Sections every half millimetre over 100 mm; the force goes up and down, the widths answer with noise.
    fn pressed(dice: &mut Dice, force: impl Fn(f64) -> f64, per_n: f64) -> Vec<Section> {
        let mut noise = 0.0;
        (0..200)
            .map(|i| {
                let at = 0.5 * f64::from(i);
                // Noise that neighbours share: an autoregression over 2 mm.
                noise = 0.78 * noise + 0.0188 * dice.normal_pair().0;
                let mut section = section(at, 40.0);
                section.force_n = Some(force(at));
                if let Some(measure) = &mut section.measure {
                    let ratio = 0.95 - per_n * (force(at) - 5.0) + noise;
                    measure.least_diameter_mm = ratio * measure.largest_diameter_mm;
                }
                section
            })
            .collect()
    }

    fn wave(at: f64) -> f64 {
        5.0 + 2.0 * (at / 7.0).sin()
    }

    #[test]
    fn a_lumen_that_flattens_under_the_force_is_seen_and_one_that_does_not_is_hardly_ever_accused() {
        let (mut seen, mut accused) = (0, 0);
        for seed in 0..500 {
            let mut dice = Dice(seed);
            let flat = Compression::of(&pressed(&mut dice, wave, 0.03)).expect("forces");
            assert!((flat.slope_per_n + 0.03).abs() < 0.02, "{flat:?}");
            seen += i32::from(flat.flattens());
            accused += i32::from(Compression::of(&pressed(&mut dice, wave, 0.0)).expect("forces").flattens());
        }
        assert!(seen >= 475 && accused <= 5, "{seen} seen, {accused} accused of 500");
    }

    #[test]
    fn more_than_eight_newtons_are_said_with_the_place() {
        let mut dice = Dice(3);
        let sections = pressed(&mut dice, |at| if (20.0..30.0).contains(&at) { 9.5 } else { 5.0 }, 0.0);
        let found = warnings(&sections);
        let [ReconWarning::Pressed { from_mm, to_mm, most_n }] = found[..] else { panic!("{found:?}") };
        assert!((from_mm - 20.0).abs() < 0.6 && (to_mm - 29.5).abs() < 0.6 && (most_n - 9.5).abs() < 1e-9);
    }

    #[test]
    fn without_a_force_or_with_one_that_never_changes_nothing_is_said() {
        let mut dice = Dice(5);
        let mut none = pressed(&mut dice, wave, 0.1);
        none.iter_mut().for_each(|section| section.force_n = None);
        assert_eq!(Compression::of(&none), None);
        let steady = Compression::of(&pressed(&mut dice, |_| 5.0, 0.1)).expect("forces");
        assert!(!steady.flattens());
    }
}
