//! From what the seeds gave to the table's figures.

use super::super::Goal;
use super::run::Outcome;
use super::settings::Row;

/// The 95th percentile of the surface error (mm).
const MOST_P95_MM: f64 = 0.6;
/// The mean error of a percent area, and how far its limits of agreement reach (points).
const MOST_MEAN_POINTS: f64 = 2.0;
const MOST_LIMIT_POINTS: f64 = 4.0;
/// Limits of agreement are judged from so many values on.
const LEAST_TO_AGREE: usize = 3;
/// The bias of the areas along the vessel (%).
const MOST_BIAS_PERCENT: f64 = 3.0;
/// 93 to 97 % of the 95 % intervals hold the truth.
const COVERED_PERCENT: f64 = 95.0;
const MOST_OFF_COVERED: f64 = 2.0;
/// A scan's sections share its calibration and much of their speckle: how many intervals hold is judged from so many
/// seeds on.
const LEAST_TO_COVER: usize = 10;
/// The centreline (mm).
const MOST_CENTRELINE_MM: f64 = 0.3;
/// A found stenosis is of the true one when that has this percent area, within so many points.
const SAME_POINTS: f64 = 0.1;

/// The rows of one line.
pub(super) fn rows(row: &Row, outcomes: &[Outcome]) -> Vec<Goal> {
    let figure = |what: &str| format!("{}: {what}", row.name);
    let each = |value: &dyn Fn(&Outcome) -> Option<f64>| -> Vec<f64> {
        // A seed that gave nothing keeps no bound.
        outcomes.iter().map(|outcome| value(outcome).unwrap_or(f64::NAN)).collect()
    };
    let mean = each(&|outcome| Some(outcome.surface_mm?.0));
    let p95 = each(&|outcome| Some(outcome.surface_mm?.1));
    let in_place = each(&|outcome| Some(outcome.in_place_mm?.0));
    let branches: Vec<f64> = outcomes.iter().filter_map(|outcome| Some(outcome.branches_mm?.0)).collect();
    let calibration = each(&|outcome| outcome.calibration_mm);
    let mut rows = vec![
        Goal::of(figure("surface, mean, mm"), &mean, Some(row.most_mean_mm), row.published),
        Goal::of(figure("surface, 95th percentile, mm"), &p95, Some(MOST_P95_MM), None),
    ];
    rows.push(Goal::of(figure("surface in place, mean, mm"), &in_place, None, None));
    if !branches.is_empty() {
        rows.push(Goal::of(figure("branches in place, mean, mm"), &branches, None, None));
    }
    for truth in row.true_percent() {
        rows.extend(stenosis(&figure(&format!("{truth:.0} % area")), truth, outcomes));
    }
    rows.extend(sections(&figure, outcomes));
    let centre = each(&|outcome| mean_of(outcome.sections.iter().map(|section| section.centre_mm)));
    rows.push(Goal::of(figure("centreline, mean, mm"), &centre, Some(MOST_CENTRELINE_MM), None));
    rows.push(Goal::of(figure("calibration's true error, mm"), &calibration, None, None));
    let without = each(&|outcome| Some(100.0 * outcome.images.1 as f64 / outcome.images.0.max(1) as f64));
    rows.push(Goal::of(figure("images without a lumen, %"), &without, None, None));
    rows
}

/// Percent area of one stenosis: found minus true, in points. One that was not found is wrong by all of it; one that was
/// not scanned whole in a seed says nothing.
fn stenosis(figure: &str, truth: f64, outcomes: &[Outcome]) -> Vec<Goal> {
    let errors: Vec<f64> = outcomes
        .iter()
        .flat_map(|outcome| &outcome.stenoses)
        .filter(|found| (found.true_percent_area - truth).abs() < SAME_POINTS)
        .map(|found| found.found_percent_area.unwrap_or(0.0) - truth)
        .collect();
    let enough = errors.len() >= LEAST_TO_AGREE;
    let whole = Goal::of(format!("{figure}, found minus true, points"), &errors, None, None);
    let (mean, sd) = (whole.mean, whole.sd);
    let limit = mean.abs() + 1.96 * sd;
    let judged = |what: &str, value: f64, most: Option<f64>| {
        let values: &[f64] = if errors.is_empty() { &[] } else { &[value] };
        Goal::of(format!("{figure}, {what}, points"), values, most, None)
    };
    vec![
        whole,
        judged("mean error", mean.abs(), Some(MOST_MEAN_POINTS)),
        judged("limits of agreement reach", limit, enough.then_some(MOST_LIMIT_POINTS)),
    ]
}

fn sections(figure: &dyn Fn(&str) -> String, outcomes: &[Outcome]) -> Vec<Goal> {
    let all = || outcomes.iter().flat_map(|outcome| &outcome.sections);
    let bias = mean_of(all().map(|section| 100.0 * (section.found_mm2 / section.true_mm2 - 1.0)));
    let held = mean_of(all().map(|section| if section.held { 100.0 } else { 0.0 }));
    let values = |value: Option<f64>| value.into_iter().collect::<Vec<f64>>();
    let off = held.map(|held| (held - COVERED_PERCENT).abs());
    let enough = outcomes.iter().filter(|outcome| !outcome.sections.is_empty()).count() >= LEAST_TO_COVER;
    vec![
        Goal::of(figure("area, found minus true, %"), &values(bias), None, None),
        Goal::of(figure("area, bias, %"), &values(bias.map(f64::abs)), Some(MOST_BIAS_PERCENT), None),
        Goal::of(figure("95 % intervals that hold the area, %"), &values(held), None, None),
        Goal::of(
            figure("the same, off 95 %, points"),
            &values(off),
            enough.then_some(MOST_OFF_COVERED),
            None,
        ),
    ]
}

fn mean_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::{SectionError, StenosisError};

    fn good() -> Outcome {
        let section = |i: usize| SectionError {
            true_mm2: 48.0,
            found_mm2: 48.5,
            sd_mm2: [0.5, 0.5],
            held: !i.is_multiple_of(20),
            centre_mm: 0.1,
        };
        let found =
            |truth: f64| StenosisError { true_percent_area: truth, found_percent_area: Some(truth + 0.5) };
        Outcome {
            failed: None,
            calibration_mm: Some(0.1),
            surface_mm: Some((0.1, 0.3)),
            in_place_mm: Some((0.15, 0.35)),
            branches_mm: None,
            stenoses: vec![found(80.0), found(75.0)],
            sections: (0..200).map(section).collect(),
            images: (200, 3),
        }
    }

    #[test]
    fn a_good_line_keeps_every_bound_and_one_bad_seed_does_not() {
        let row = &Row::all()[8];
        let kept = |outcomes: &[Outcome]| rows(row, outcomes).iter().all(|goal| goal.met != Some(false));
        assert!(kept(&[good(), good(), good()]));
        let failed = Outcome { failed: Some("no lumen".into()), ..Outcome::default() };
        assert!(!kept(&[good(), failed, good()]));
        let missed = StenosisError { true_percent_area: 80.0, found_percent_area: None };
        assert!(!kept(&[good(), Outcome { stenoses: vec![missed], ..good() }, good()]));
        let mut sure = good();
        sure.sections.iter_mut().for_each(|section| section.held = false);
        assert!(kept(&vec![sure.clone(); LEAST_TO_COVER - 1]));
        assert!(!kept(&vec![sure; LEAST_TO_COVER]));
    }
}
