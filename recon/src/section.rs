//! Sections normal to the centreline, with their areas and diameters.

use probepath_frames::{Direction, Point, World};
use serde::{Deserialize, Serialize};

use crate::centreline::Centreline;
use crate::surface::Tube;

/// Points of a section's outline.
const OUTLINE: usize = 72;
/// Directions in which a section's width is measured.
const WIDTHS: usize = 90;

/// The section normal to the centreline at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Length along the centreline (mm).
    pub at_mm: f64,
    /// The centreline's point.
    pub centre: Point<World>,
    /// The centreline's direction.
    pub normal: Direction<World>,
    /// Its measures; nothing where no image shows the lumen.
    pub measure: Option<SectionMeasure>,
}

/// How large a section of the lumen is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionMeasure {
    /// Area (mm2).
    pub area_mm2: f64,
    /// Its standard deviation, from the speckle and the poses; no systematic error (mm2).
    pub area_sd_mm2: f64,
    /// Diameter of the circle of the same area (mm).
    pub equivalent_diameter_mm: f64,
    /// Smallest width (minimum Feret diameter, mm).
    pub least_diameter_mm: f64,
    /// Largest width (maximum Feret diameter, mm).
    pub largest_diameter_mm: f64,
}

/// Sections every `step` (m), measured where `measured` says so.
pub(crate) fn sections(
    line: &Centreline,
    tube: &Tube,
    step: f64,
    measured: impl Fn(f64) -> bool,
) -> Vec<Section> {
    let count = (line.length_m() / step).floor() as usize + 1;
    let centres = (0..count).filter_map(|i| line.at(i as f64 * step));
    centres
        .map(|centre| Section {
            at_mm: centre.at_m * 1e3,
            centre: centre.point,
            normal: centre.tangent,
            measure: measured(centre.at_m).then(|| measure(tube, centre.at_m)),
        })
        .collect()
}

fn measure(tube: &Tube, at: f64) -> SectionMeasure {
    let radii = |k: usize| tube.radius(at, angle(k)).max(0.05e-3);
    let outline: Vec<(f64, f64)> =
        (0..OUTLINE).map(|k| (radii(k) * angle(k).cos(), radii(k) * angle(k).sin())).collect();
    // The border between the points is round: the integral of r^2 / 2, not the polygon.
    let area = (0..OUTLINE).map(|k| radii(k).powi(2)).sum::<f64>() * std::f64::consts::PI / OUTLINE as f64;
    let (least, largest) = widths(&outline);
    let mean = (area / std::f64::consts::PI).sqrt();
    SectionMeasure {
        area_mm2: area * 1e6,
        area_sd_mm2: std::f64::consts::TAU * mean * tube.radius_sd(at) * 1e6,
        equivalent_diameter_mm: 2.0 * mean * 1e3,
        least_diameter_mm: least * 1e3,
        largest_diameter_mm: largest * 1e3,
    }
}

fn angle(k: usize) -> f64 {
    std::f64::consts::TAU * k as f64 / OUTLINE as f64
}

/// Smallest and largest width of an outline.
fn widths(outline: &[(f64, f64)]) -> (f64, f64) {
    let width = |k: usize| {
        let (sin, cos) = (std::f64::consts::PI * k as f64 / WIDTHS as f64).sin_cos();
        let along = outline.iter().map(|p| p.0 * cos + p.1 * sin);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low
    };
    (0..WIDTHS).map(width).fold((f64::INFINITY, 0.0), |(a, b), w| (a.min(w), f64::max(b, w)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_widths_of_an_ellipse_are_its_axes() {
        let outline: Vec<(f64, f64)> =
            (0..OUTLINE).map(|k| (3.0 * angle(k).cos(), 2.0 * angle(k).sin())).collect();
        let (least, largest) = widths(&outline);
        assert!((least - 4.0).abs() < 0.01 && (largest - 6.0).abs() < 0.01, "{least} {largest}");
    }
}
