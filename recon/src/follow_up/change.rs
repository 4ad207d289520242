//! What changed between two exams, and whether that is more than their errors.

use serde::{Deserialize, Serialize};

use super::FALSE_ALARM;
use super::profile::Profile;
use super::register::Registered;
use crate::section::TWO_SIDED_95;
use crate::uncertainty::{ALONE_MM, AreaError, shared};
use crate::{LumenSettings, Section, Stenosis, stenosis};

/// Changed sections no farther apart than this are one stretch (mm).
const ONE_STRETCH_MM: f64 = 3.0;
/// Stenoses nearer to one another than this are the same (mm).
const SAME_STENOSIS_MM: f64 = 8.0;

/// The area of one place in both exams.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AreaChange {
    /// Along the earlier exam (mm).
    pub at_mm: f64,
    /// What it was (mm2).
    pub earlier_mm2: f64,
    /// What it is (mm2).
    pub later_mm2: f64,
    /// Standard deviation of their difference from everything that is known (mm2).
    pub sd_mm2: f64,
    /// The part of it that neighbours share only in part (mm2).
    pub random_mm2: f64,
}

impl AreaChange {
    /// By how many standard deviations the later area is larger.
    pub fn score(&self) -> f64 {
        (self.later_mm2 - self.earlier_mm2) / self.sd_mm2.max(1e-9)
    }

    /// By how much of the earlier area the later is larger (%).
    pub fn percent(&self) -> f64 {
        100.0 * (self.later_mm2 / self.earlier_mm2 - 1.0)
    }
}

/// A stretch whose area changed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangedStretch {
    /// Where it begins, along the earlier exam (mm).
    pub from_mm: f64,
    /// Where it ends (mm).
    pub to_mm: f64,
    /// The section that changed most surely.
    pub most: AreaChange,
}

/// A stenosis in both exams, or in one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StenosisChange {
    /// As it was; none when it is new.
    pub earlier: Option<Stenosis>,
    /// As it is; none when it is gone. Its places are the later exam's.
    pub later: Option<Stenosis>,
    /// Percent area now less percent area then (points), when both have it.
    pub points: Option<f64>,
    /// The 95 % interval of that.
    pub points_interval: Option<[f64; 2]>,
}

/// Every place that both measured.
pub(super) fn areas(before: &Profile, after: &Profile, found: &Registered) -> Vec<AreaChange> {
    let change = |row: &super::profile::Row| {
        let later = after.at(row.at - found.shift)?;
        let shifted = before.slope(row.at) * found.shift_sd;
        let random_mm2 = row.random.hypot(later.random).hypot(shifted);
        Some(AreaChange {
            at_mm: row.at,
            earlier_mm2: row.area,
            later_mm2: later.area,
            sd_mm2: random_mm2.hypot(row.common).hypot(later.common),
            random_mm2,
        })
    };
    before.rows().iter().filter_map(change).collect()
}

/// How many standard deviations make a change, so that an unchanged vessel shows none in all but `FALSE_ALARM` of the
/// cases: sections that far apart that they share nothing, each as likely to err (Bonferroni).
pub(super) fn limit(areas: &[AreaChange]) -> f64 {
    let length = areas.first().zip(areas.last()).map_or(0.0, |(a, b)| b.at_mm - a.at_mm);
    let independent = (length / ALONE_MM).max(1.0);
    normal_quantile(FALSE_ALARM / (2.0 * independent))
}

/// What a normal number exceeds with a small chance (Abramowitz and Stegun 26.2.23, within 4.5e-4).
fn normal_quantile(chance: f64) -> f64 {
    let t = (-2.0 * chance.ln()).sqrt();
    t - (2.515_517 + 0.802_853 * t + 0.010_328 * t * t)
        / (1.0 + 1.432_788 * t + 0.189_269 * t * t + 0.001_308 * t * t * t)
}

/// The stretches in which the limit is passed, in one direction each.
pub(super) fn stretches(areas: &[AreaChange], limit: f64) -> Vec<ChangedStretch> {
    let mut stretches: Vec<ChangedStretch> = Vec::new();
    for change in areas.iter().filter(|change| change.score().abs() > limit) {
        let same = |last: &ChangedStretch| {
            change.at_mm - last.to_mm <= ONE_STRETCH_MM && last.most.score() * change.score() > 0.0
        };
        match stretches.last_mut().filter(|last| same(last)) {
            Some(last) => {
                last.to_mm = change.at_mm;
                if change.score().abs() > last.most.score().abs() {
                    last.most = *change;
                }
            }
            None => {
                stretches.push(ChangedStretch { from_mm: change.at_mm, to_mm: change.at_mm, most: *change })
            }
        }
    }
    stretches
}

/// Mean change (%) and its standard deviation: what is random averages out as far as neighbours do not share it.
pub(super) fn mean_percent(areas: &[AreaChange]) -> [f64; 2] {
    let count = areas.len().max(1) as f64;
    let mean = areas.iter().map(AreaChange::percent).sum::<f64>() / count;
    let part = |change: &AreaChange| 100.0 * change.random_mm2 / change.earlier_mm2;
    let pair = |a: &AreaChange, b: &AreaChange| part(a) * part(b) * shared(a.at_mm - b.at_mm);
    let random: f64 = areas.iter().flat_map(|a| areas.iter().map(move |b| pair(a, b))).sum();
    let common =
        |c: &AreaChange| 100.0 * (c.sd_mm2.powi(2) - c.random_mm2.powi(2)).max(0.0).sqrt() / c.earlier_mm2;
    [mean, (random.max(0.0).sqrt() / count).hypot(areas.iter().map(common).sum::<f64>() / count)]
}

/// The stenoses of both exams, those at the same place side by side.
pub(super) fn stenoses(sections: [&[Section]; 2], found: &Registered) -> Vec<StenosisChange> {
    let [earlier, later] = sections.map(|sections| {
        let errors: Vec<AreaError> = sections.iter().map(AreaError::stated).collect();
        stenosis::find(sections, &errors, &LumenSettings::default())
    });
    let mut rest = later;
    let mut changes: Vec<StenosisChange> = Vec::new();
    for then in earlier {
        let near = |now: &Stenosis| (now.at_mm + found.shift - then.at_mm).abs();
        let nearest = rest.iter().enumerate().min_by(|a, b| near(a.1).total_cmp(&near(b.1)));
        let same = nearest.filter(|(_, now)| near(now) < SAME_STENOSIS_MM).map(|(i, _)| i);
        changes.push(beside(Some(then), same.map(|i| rest.remove(i))));
    }
    changes.extend(rest.into_iter().map(|now| beside(None, Some(now))));
    changes
}

fn beside(earlier: Option<Stenosis>, later: Option<Stenosis>) -> StenosisChange {
    let both = earlier.zip(later);
    let points = both.map(|(then, now)| now.percent_area - then.percent_area);
    let sd = both.map(|(then, now)| now.percent_area_sd.hypot(then.percent_area_sd));
    let interval =
        points.zip(sd).map(|(points, sd)| [points - TWO_SIDED_95 * sd, points + TWO_SIDED_95 * sd]);
    StenosisChange { earlier, later, points, points_interval: interval }
}
