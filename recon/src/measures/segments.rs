//! The leg's named segments: external iliac, common femoral, superficial femoral, popliteal, …

use serde::{Deserialize, Serialize};

use crate::section::TWO_SIDED_95;
use crate::{Section, SectionMeasure, Stenosis};

/// A named part of the artery, in millimetres along the centreline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// CFA, SFA proximal, …
    pub name: String,
    /// Where it begins (mm).
    pub from_mm: f64,
    /// Where it ends (mm).
    pub until_mm: f64,
}

/// What was measured in a segment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SegmentMeasure {
    /// The segment, cut to what was scanned.
    pub segment: Segment,
    /// How much of it was measured (mm).
    pub measured_mm: f64,
    /// Mean area (mm2).
    pub mean_area_mm2: f64,
    /// Its 95 % interval (mm2): what all sections share does not average out.
    pub mean_area_interval_mm2: [f64; 2],
    /// Least area (mm2).
    pub min_area_mm2: f64,
    /// Its 95 % interval (mm2).
    pub min_area_interval_mm2: [f64; 2],
    /// Mean of the diameters of equal area (mm).
    pub mean_diameter_mm: f64,
    /// Least diameter of equal area (mm).
    pub min_diameter_mm: f64,
    /// The largest circle that fits through all of it (mm).
    pub min_inscribed_diameter_mm: f64,
    /// Mean contact force (N), where it was measured.
    pub mean_force_n: Option<f64>,
    /// The stenosis whose narrowest place lies in it that takes most of the area.
    pub worst: Option<Stenosis>,
}

/// What was measured in each segment, in the segments' order; nothing for one that was not scanned.
pub fn segment_measures(
    segments: &[Segment],
    sections: &[Section],
    stenoses: &[Stenosis],
) -> Vec<SegmentMeasure> {
    segments.iter().filter_map(|segment| of(segment, sections, stenoses)).collect()
}

fn of(segment: &Segment, sections: &[Section], stenoses: &[Stenosis]) -> Option<SegmentMeasure> {
    let inside = |at: f64| (segment.from_mm..segment.until_mm).contains(&at);
    let within: Vec<&Section> = sections.iter().filter(|section| inside(section.at_mm)).collect();
    let measured: Vec<(f64, &SectionMeasure)> =
        within.iter().filter_map(|section| Some((section.at_mm, section.measure.as_ref()?))).collect();
    let least = measured.iter().map(|(_, m)| *m).min_by(|a, b| a.area_mm2.total_cmp(&b.area_mm2))?;
    let mean = |of: fn(&SectionMeasure) -> f64| {
        measured.iter().map(|(_, m)| of(m)).sum::<f64>() / measured.len() as f64
    };
    let mean_area_mm2 = mean(|m| m.area_mm2);
    let reach = TWO_SIDED_95 * mean_sd(&measured);
    let worst = stenoses.iter().filter(|stenosis| inside(stenosis.at_mm));
    Some(SegmentMeasure {
        segment: cut(segment, sections),
        measured_mm: measured_mm(&within),
        mean_area_mm2,
        mean_area_interval_mm2: [(mean_area_mm2 - reach).max(0.0), mean_area_mm2 + reach],
        min_area_mm2: least.area_mm2,
        min_area_interval_mm2: least.area_interval_mm2,
        mean_diameter_mm: mean(|m| m.equivalent_diameter_mm),
        min_diameter_mm: least.equivalent_diameter_mm,
        min_inscribed_diameter_mm: measured
            .iter()
            .map(|(_, m)| m.inscribed_diameter_mm)
            .fold(f64::INFINITY, f64::min),
        mean_force_n: mean_force(&within),
        worst: worst.copied().max_by(|a, b| a.percent_area.total_cmp(&b.percent_area)),
    })
}

/// The segment, as far as there are sections.
fn cut(segment: &Segment, sections: &[Section]) -> Segment {
    let ends = sections.first().zip(sections.last());
    let (first, last) = ends.map_or((0.0, 0.0), |(a, b)| (a.at_mm, b.at_mm));
    Segment { from_mm: segment.from_mm.max(first), until_mm: segment.until_mm.min(last), ..segment.clone() }
}

/// Standard deviation of the mean of the areas (mm2): what is random averages out as far as neighbours do not share
/// it, the rest stays.
fn mean_sd(measured: &[(f64, &SectionMeasure)]) -> f64 {
    let count = measured.len() as f64;
    let pair = |a: &(f64, &SectionMeasure), b: &(f64, &SectionMeasure)| {
        a.1.area_sd_mm2 * b.1.area_sd_mm2 * crate::uncertainty::shared(a.0 - b.0)
    };
    let random: f64 = measured.iter().flat_map(|a| measured.iter().map(move |b| pair(a, b))).sum();
    let common = measured.iter().map(|(_, m)| m.area_common_sd_mm2).sum::<f64>() / count;
    (random.max(0.0).sqrt() / count).hypot(common)
}

/// How much vessel lies between neighbours that are both measured (mm).
fn measured_mm(within: &[&Section]) -> f64 {
    let both = |pair: &&[&Section]| pair.iter().all(|section| section.measure.is_some());
    within.windows(2).filter(both).map(|pair| pair[1].at_mm - pair[0].at_mm).sum()
}

fn mean_force(within: &[&Section]) -> Option<f64> {
    let forces: Vec<f64> = within.iter().filter_map(|section| section.force_n).collect();
    (!forces.is_empty()).then(|| forces.iter().sum::<f64>() / forces.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::table::tests::section;

    #[test]
    fn a_segment_has_the_mean_the_least_and_the_worst_of_what_lies_in_it() {
        let area = |at: f64| if (60.0..62.0).contains(&at) { 10.0 } else { 40.0 };
        let sections: Vec<Section> =
            (0..200).map(|i| 0.5 * f64::from(i)).map(|at| section(at, area(at))).collect();
        let named =
            |name: &str, from_mm: f64, until_mm: f64| Segment { name: name.into(), from_mm, until_mm };
        let leg = [named("CFA", -5.0, 30.0), named("SFA proximal", 30.0, 80.0), named("POP", 200.0, 300.0)];
        let found = segment_measures(&leg, &sections, &[]);
        let [cfa, sfa] = &found[..] else { panic!("{found:?}") };
        assert!((cfa.mean_area_mm2 - 40.0).abs() < 1e-9 && (cfa.segment.from_mm - 0.0).abs() < 1e-9);
        assert!((sfa.mean_area_mm2 - (40.0 * 96.0 + 10.0 * 4.0) / 100.0).abs() < 1e-9, "{sfa:?}");
        assert!((sfa.min_area_mm2 - 10.0).abs() < 1e-9 && (sfa.measured_mm - 49.5).abs() < 1e-9);
        assert!(cfa.worst.is_none() && (cfa.mean_force_n.expect("measured") - 5.0).abs() < 1e-9);
        // 60 sections, but only about a dozen that are independent: 0.5 mm2 becomes 0.5 / sqrt(30 / (2.5 sqrt(pi))).
        let half = 0.5 * (cfa.mean_area_interval_mm2[1] - cfa.mean_area_interval_mm2[0]) / 1.96;
        let random = 0.5 * (2.5 * std::f64::consts::PI.sqrt() / 30.0_f64).sqrt();
        assert!((half - random.hypot(0.3)).abs() < 0.02, "{half} {}", random.hypot(0.3));
    }
}
