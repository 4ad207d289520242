//! Measured sections as the search for stenoses sees them: a row of areas along the vessel.

use nalgebra::Vector3;

use crate::Section;
use crate::uncertainty::{AreaError, COMMON};

/// Half the length over which areas are averaged to tell a narrowing from noise (mm).
const SMOOTH_MM: f64 = 1.5;
/// Half the length of the parabola through the narrowest place (mm).
const BOTTOM_MM: f64 = 1.5;

/// A measured section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Along the vessel (mm).
    pub(super) at: f64,
    /// As measured (mm2).
    pub(super) area: f64,
    /// Averaged over its neighbours (mm2): where a narrowing begins and ends is asked of this one.
    pub(super) smooth: f64,
    /// How sure `area` is.
    pub(super) error: AreaError,
    /// Centre of gravity of the outline (m).
    pub(super) middle: Vector3<f64>,
    /// Along the vessel.
    pub(super) along: Vector3<f64>,
    /// Diameter of the circle inside (mm).
    pub(super) inscribed: f64,
}

impl Place {
    /// Errors from common causes relative to the area.
    pub(super) fn common(&self) -> [f64; COMMON] {
        self.error.common_mm2.map(|move_mm2| move_mm2 / self.area)
    }
}

/// The measured sections, in their order.
pub(super) fn places(sections: &[Section], errors: &[AreaError]) -> Vec<Place> {
    let mut places: Vec<Place> = sections
        .iter()
        .zip(errors)
        .filter_map(|(section, error)| {
            let measure = section.measure.as_ref().filter(|m| m.area_mm2.is_finite() && m.area_mm2 > 0.0)?;
            Some(Place {
                at: section.at_mm,
                area: measure.area_mm2,
                smooth: measure.area_mm2,
                error: *error,
                middle: section.middle.vector(),
                along: section.normal.vector(),
                inscribed: measure.inscribed_diameter_mm,
            })
        })
        .collect();
    let smooth: Vec<f64> = (0..places.len()).map(|i| smoothed(&places, i)).collect();
    places.iter_mut().zip(smooth).for_each(|(place, smooth)| place.smooth = smooth);
    places
}

/// Those at most `half` mm from a place.
fn within(places: &[Place], i: usize, half: f64) -> &[Place] {
    let Some(centre) = places.get(i).map(|place| place.at) else { return &[] };
    let from = places.partition_point(|place| place.at < centre - half);
    let to = places.partition_point(|place| place.at <= centre + half);
    places.get(from..to).unwrap_or_default()
}

/// The mean area near a place, neighbours counting less the farther they are; as many on one side as on the other, so
/// that an end is not pulled inward.
fn smoothed(places: &[Place], i: usize) -> f64 {
    let near = within(places, i, SMOOTH_MM);
    let at = places[i].at;
    let room = |place: Option<&Place>| place.map_or(0.0, |place| (place.at - at).abs());
    let half = room(near.first()).min(room(near.last())) + 1e-9;
    let weigh = |place: &Place| (1.0 - (place.at - at).abs() / (SMOOTH_MM + 0.5)).max(0.0);
    let inside = near.iter().filter(|place| (place.at - at).abs() <= half);
    let (sum, weights) = inside
        .fold((0.0, 0.0), |(sum, weights), place| (sum + weigh(place) * place.area, weights + weigh(place)));
    sum / weights
}

/// The bottom of a narrowing: the least area near place `i`, and its place. A parabola through the neighbours, because the least of several noisy areas is too small; the measured
/// place itself where there are too few or they make no bottom.
pub(super) fn bottom(places: &[Place], i: usize) -> Place {
    let least = places[i];
    let near = within(places, i, BOTTOM_MM);
    let Some([constant, slope, bend]) = parabola(near, least.at) else { return least };
    let off = -slope / (2.0 * bend);
    if bend <= 0.0 || off.is_nan() || off.abs() > BOTTOM_MM {
        return least;
    }
    let area = constant + slope * off + bend * off * off;
    if area.is_nan() || area <= 0.0 {
        return least;
    }
    // The errors are those of the place measured nearest: relative, so that they stay what they are.
    let nearest =
        near.iter().min_by(|a, b| (a.at - least.at - off).abs().total_cmp(&(b.at - least.at - off).abs()));
    let nearest = nearest.copied().unwrap_or(least);
    Place { at: least.at + off, area, ..nearest }
}

/// Least squares of `area = a + b x + c x^2` with x from `at`. None when fewer than five places are there.
fn parabola(near: &[Place], at: f64) -> Option<[f64; 3]> {
    if near.len() < 5 {
        return None;
    }
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = Vector3::zeros();
    for place in near {
        let x = place.at - at;
        let row = Vector3::new(1.0, x, x * x);
        normal += row * row.transpose();
        right += row * place.area;
    }
    Some(normal.cholesky()?.solve(&right).into())
}

/// How fast the averaged area changes at place `i` (mm2/mm).
pub(super) fn slope(places: &[Place], i: usize) -> f64 {
    let near = within(places, i, SMOOTH_MM);
    let (Some(first), Some(last)) = (near.first(), near.last()) else { return 0.0 };
    (last.smooth - first.smooth) / (last.at - first.at).max(1e-9)
}

/// How sharply the area rises from place `i` on both sides: the parabola's factor (mm2/mm2).
pub(super) fn bend(places: &[Place], i: usize) -> f64 {
    parabola(within(places, i, 2.0 * BOTTOM_MM), places[i].at).map_or(0.0, |[_, _, bend]| bend)
}
