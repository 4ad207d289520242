//! Every measured section beside the true one.

use probepath_recon::{LumenReconstruction, Section, SectionMeasure};
use probepath_sim::Vessel;
use serde::{Deserialize, Serialize};

/// A section whose middle is nearer than this to a branch's lumen (m), beyond its own radius, shows both.
const MOUTH_M: f64 = 0.5e-3;

/// What a section says, beside the truth there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionError {
    /// True area normal to the true centreline, where that is nearest (mm²).
    pub true_mm2: f64,
    /// Found area (mm²).
    pub found_mm2: f64,
    /// Its stated standard deviations: of its own, and shared by the scan (mm²).
    #[serde(default)]
    pub sd_mm2: [f64; 2],
    /// Whether its 95 % interval holds the true one.
    pub held: bool,
    /// Distance of the found centreline from the true one (mm).
    pub centre_mm: f64,
}

/// The measured sections of the first vessel, but for those in the mouth of a branch, whose area is nobody's.
pub(super) fn sections(vessels: &[Vessel], recon: &LumenReconstruction) -> Vec<SectionError> {
    let Some((main, branches)) = vessels.split_first() else { return Vec::new() };
    let beside = |section: &Section| {
        let measure = section.measure.as_ref()?;
        let at = main.nearest(section.centre);
        let radius = main.radius(at);
        if branches.iter().any(|branch| branch.wall_distance(section.centre) < radius + MOUTH_M) {
            return None;
        }
        let true_mm2 = main.area(at) * 1e6;
        let centre_mm = main.centre(at).distance(&section.centre) * 1e3;
        let held = holds(measure, true_mm2);
        let (found_mm2, sd_mm2) = (measure.area_mm2, [measure.area_sd_mm2, measure.area_common_sd_mm2]);
        Some(SectionError { true_mm2, found_mm2, sd_mm2, held, centre_mm })
    };
    recon.sections.iter().filter_map(beside).collect()
}

fn holds(measure: &SectionMeasure, true_mm2: f64) -> bool {
    let [low, high] = measure.area_interval_mm2;
    (low..=high).contains(&true_mm2)
}
