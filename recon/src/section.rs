//! Sections normal to the centreline, with their areas and diameters.

mod crossing;
mod outline;

use std::sync::OnceLock;

use probepath_frames::{Direction, Point, World};
use serde::{Deserialize, Serialize};

use crate::centreline::{Centreline, CentrelinePoint};
use crate::surface::{Tube, harmonics_of};
use outline::Flat;

/// Points of a section's outline.
const OUTLINE: usize = 72;
/// No radius is smaller (m).
const LEAST_RADIUS_M: f64 = 0.05e-3;
/// So many standard deviations on either side hold 95 % of a normal distribution.
pub(crate) const TWO_SIDED_95: f64 = 1.959_963_984_540_054;

/// The section normal to the centreline at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Length along the centreline (mm).
    pub at_mm: f64,
    /// The centreline's point.
    pub centre: Point<World>,
    /// The centreline's direction.
    pub normal: Direction<World>,
    /// The outline's centre of gravity; the centreline's point where nothing is measured.
    pub middle: Point<World>,
    /// With what force the probe pressed there (N), where it was measured.
    pub force_n: Option<f64>,
    /// Its measures.
    pub measure: Option<SectionMeasure>,
    /// Why it has none.
    pub missing: Option<NotMeasured>,
}

/// Why a section has no measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NotMeasured {
    /// No image shows the lumen near it.
    NotSeen,
    /// The vessel bends so sharply that this section would cross its neighbour inside the lumen.
    Crossing,
}

/// How large a section of the lumen is. The outline's border between its 72 points is taken as round for area and
/// length, as straight for widths and the circle inside (0.1 % less on a round lumen).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionMeasure {
    /// Area (mm2).
    pub area_mm2: f64,
    /// Its standard deviation, from the speckle and the poses; no systematic error (mm2).
    pub area_sd_mm2: f64,
    /// Its standard deviation from what the whole scan shares: wall model, point spread, calibration, lag (mm2).
    pub area_common_sd_mm2: f64,
    /// Holds the true area with 95 % probability, from both (mm2).
    pub area_interval_mm2: [f64; 2],
    /// Diameter of the circle of the same area (mm).
    pub equivalent_diameter_mm: f64,
    /// Diameter of the largest circle inside the outline (mm).
    pub inscribed_diameter_mm: f64,
    /// Smallest width (minimum Feret diameter, mm).
    pub least_diameter_mm: f64,
    /// Largest width (maximum Feret diameter, mm).
    pub largest_diameter_mm: f64,
    /// `4 pi area / length^2` of the outline: 1 for a circle, less for anything else.
    pub circularity: f64,
}

impl SectionMeasure {
    /// The 95 % interval of the equivalent diameter (mm): that of the area, as diameters.
    pub fn diameter_interval_mm(&self) -> [f64; 2] {
        self.area_interval_mm2.map(diameter_of)
    }

    /// Intervals of what has these standard deviations.
    pub(crate) fn with_sd(self, random_mm2: f64, common_mm2: f64) -> Self {
        Self {
            area_sd_mm2: random_mm2,
            area_common_sd_mm2: common_mm2,
            area_interval_mm2: area_interval(self.area_mm2, random_mm2.hypot(common_mm2)),
            ..self
        }
    }
}

/// Diameter of the circle of an area.
pub(crate) fn diameter_of(area: f64) -> f64 {
    2.0 * (area / std::f64::consts::PI).sqrt()
}

/// The 95 % interval of an area of standard deviation `sd`. A border is found to within so many micrometres whatever
/// the lumen's size, so it is the radius whose error is normal: the interval is that of the radius, squared, and
/// never negative.
pub(crate) fn area_interval(area: f64, sd: f64) -> [f64; 2] {
    let radius = (area / std::f64::consts::PI).sqrt();
    let reach = TWO_SIDED_95 * sd / (std::f64::consts::TAU * radius).max(f64::MIN_POSITIVE);
    [(radius - reach).max(0.0), radius + reach].map(|r| std::f64::consts::PI * r * r)
}

/// Sections every `step` (m), measured where `measured` says so and none crosses another.
pub(crate) fn sections(
    line: &Centreline,
    tube: &Tube,
    step: f64,
    measured: impl Fn(f64) -> bool,
) -> Vec<Section> {
    let count = (line.length_m() / step).floor() as usize + 1;
    let centres = (0..count).filter_map(|i| line.at(i as f64 * step));
    let cuts: Vec<Cut> = centres.map(|centre| Cut { radii: radii(tube, centre.at_m), centre }).collect();
    let seen: Vec<bool> = cuts.iter().map(|cut| measured(cut.centre.at_m)).collect();
    let apart = crossing::apart(&cuts, &seen);
    cuts.iter()
        .zip(seen.into_iter().zip(apart))
        .map(|(cut, (seen, apart))| {
            let missing = match (seen, apart) {
                (true, true) => None,
                (true, false) => Some(NotMeasured::Crossing),
                (false, _) => Some(NotMeasured::NotSeen),
            };
            section(cut, tube, missing)
        })
        .collect()
}

/// A place of the centreline with the lumen's radii round it.
struct Cut {
    centre: CentrelinePoint,
    radii: [f64; OUTLINE],
}

fn section(Cut { centre, radii }: &Cut, tube: &Tube, missing: Option<NotMeasured>) -> Section {
    let (area, (x, y)) = area_and_middle(radii);
    let middle = centre.point.moved(centre.up, x).moved(centre.side, y);
    Section {
        at_mm: centre.at_m * 1e3,
        centre: centre.point,
        normal: centre.tangent,
        middle: if missing.is_none() { middle } else { centre.point },
        force_n: None,
        measure: missing.is_none().then(|| measure(radii, area, tube.area(centre.at_m).1)),
        missing,
    }
}

/// Area of a round outline, and its centre of gravity: the integrals of `r^2 / 2` and of `r^3 / 3` times the
/// direction. No polygon: the border between the points is round.
fn area_and_middle(radii: &[f64; OUTLINE]) -> (f64, Flat) {
    let step = std::f64::consts::TAU / OUTLINE as f64;
    let area = radii.iter().map(|r| r * r).sum::<f64>() * step / 2.0;
    let moment = radii.iter().zip(turns()).fold((0.0, 0.0), |sum, (r, (cos, sin))| {
        let part = r * r * r * step / 3.0;
        (sum.0 + part * cos, sum.1 + part * sin)
    });
    (area, (moment.0 / area, moment.1 / area))
}

fn measure(radii: &[f64; OUTLINE], area: f64, area_sd: f64) -> SectionMeasure {
    let outline: Vec<Flat> = radii.iter().zip(turns()).map(|(r, (cos, sin))| (r * cos, r * sin)).collect();
    let (least, largest) = outline::widths(&outline);
    let (_, inscribed) = outline::inscribed_circle(&outline, (0.0, 0.0));
    let mean = (area / std::f64::consts::PI).sqrt();
    let area_mm2 = area * 1e6;
    let measure = SectionMeasure {
        area_mm2,
        area_sd_mm2: 0.0,
        area_common_sd_mm2: 0.0,
        area_interval_mm2: [area_mm2; 2],
        equivalent_diameter_mm: 2.0 * mean * 1e3,
        inscribed_diameter_mm: 2.0 * inscribed * 1e3,
        least_diameter_mm: least * 1e3,
        largest_diameter_mm: largest * 1e3,
        circularity: (4.0 * std::f64::consts::PI * area / outline::length(&outline).powi(2)).min(1.0),
    };
    measure.with_sd(area_sd * 1e6, 0.0)
}

/// Distances of the outline's points from the centreline.
fn radii(tube: &Tube, at: f64) -> [f64; OUTLINE] {
    let section = tube.section(at);
    let radius = |turn: (f64, f64)| section.iter().zip(harmonics_of(turn)).map(|(a, b)| a * b).sum::<f64>();
    turns().map(|turn| radius(turn).max(LEAST_RADIUS_M))
}

fn angle(k: usize) -> f64 {
    std::f64::consts::TAU * k as f64 / OUTLINE as f64
}

/// Cosine and sine of the outline's angles.
fn turns() -> &'static [(f64, f64); OUTLINE] {
    static TURNS: OnceLock<[(f64, f64); OUTLINE]> = OnceLock::new();
    TURNS.get_or_init(|| {
        std::array::from_fn(|k| {
            let (sin, cos) = angle(k).sin_cos();
            (cos, sin)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_an_area_is_that_of_its_radius() {
        let [low, high] = area_interval(std::f64::consts::PI * 4.0, std::f64::consts::TAU * 2.0 * 0.1);
        assert!((diameter_of(low) / 2.0 - (2.0 - 0.196)).abs() < 1e-4, "{low}");
        assert!((diameter_of(high) / 2.0 - (2.0 + 0.196)).abs() < 1e-4, "{high}");
        assert!(area_interval(1e-3, 1.0)[0] == 0.0 && area_interval(0.0, 0.0)[1] == 0.0);
    }
}
