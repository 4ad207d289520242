//! How sure an area is: what is left open at each place by itself, and what the whole scan shares.
//!
//! A contour cut by a plane of normal `n` out of a vessel along `a` has the area `A_normal = A_cut (n . a)`. An error
//! of the calibration, of the scales or of the lag moves every image by a rule of its own; what it does to an area
//! follows from how it turns `n`, how it bends the line of the centres, and how it stretches the picture:
//!
//! `d ln A = d ln A_cut + (dn . a + n . da) / (n . a)`.
//!
//! The first order is enough: the errors are small angles and parts of a percent. What the whole scan shares cancels
//! in a percent stenosis as far as both places feel it alike; the rest of it, and what is random, does not.

mod budget;
mod station;
mod tracking;

use crate::Section;
pub use budget::ErrorBudget;
use budget::PARAMETERS;
pub(crate) use station::{Shown, Station, stations};
pub use tracking::Tracking;

/// How many independent causes a whole scan shares: what a calibration says, and where the wall is taken to be.
pub(crate) const COMMON: usize = PARAMETERS + 1;
/// Two places this far apart have hardly any random error in common (mm): the beam's thickness and the surface's
/// smoothing.
pub(crate) const ALONE_MM: f64 = 2.5;
/// Images this far from a section on either side make it (mm).
const NEAR_MM: f64 = 2.0;

/// The errors of one section's area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AreaError {
    /// Standard deviation of what its neighbours share only in part: speckle, noise of the poses (mm2).
    pub(crate) random_mm2: f64,
    /// What each common cause, of standard deviation one and independent of the others, moves the area by (mm2).
    pub(crate) common_mm2: [f64; COMMON],
    /// What each of them moves the section along the vessel by (mm).
    pub(crate) moved_mm: [f64; COMMON],
}

impl AreaError {
    /// The random errors of a section.
    pub(crate) fn of(section: &Section) -> Self {
        Self::random(section.measure.as_ref().map_or(0.0, |measure| measure.area_sd_mm2))
    }

    /// All that a section states: what its scan shares as one cause.
    pub(crate) fn stated(section: &Section) -> Self {
        let mut error = Self::of(section);
        error.common_mm2[0] = section.measure.as_ref().map_or(0.0, |measure| measure.area_common_sd_mm2);
        error
    }

    /// Only random errors.
    pub(crate) const fn random(sd_mm2: f64) -> Self {
        Self { random_mm2: sd_mm2, common_mm2: [0.0; COMMON], moved_mm: [0.0; COMMON] }
    }

    /// Standard deviation from what the whole scan shares (mm2).
    pub(crate) fn common_sd_mm2(&self) -> f64 {
        norm(self.common_mm2)
    }

    /// Standard deviation from everything (mm2).
    pub(crate) fn total_mm2(&self) -> f64 {
        self.random_mm2.hypot(self.common_sd_mm2())
    }

    /// Standard deviation of the length of vessel from here to another section (mm).
    pub(crate) fn apart_sd_mm(&self, other: &Self) -> f64 {
        norm(std::array::from_fn(|k| self.moved_mm[k] - other.moved_mm[k]))
    }
}

fn norm(parts: [f64; COMMON]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// How much of their random errors two places `apart_mm` share.
pub(crate) fn shared(apart_mm: f64) -> f64 {
    (-(apart_mm / ALONE_MM).powi(2)).exp()
}

/// The errors of every section, from its own (what the contours left open) and the stations near it; the sections'
/// intervals are set to them.
pub(crate) fn judge(sections: &mut [Section], stations: &[Station], budget: &ErrorBudget) -> Vec<AreaError> {
    let causes = budget.causes();
    let slopes = slopes(sections);
    let errors: Vec<AreaError> = sections
        .iter()
        .zip(slopes)
        .map(|(section, slope)| {
            let near = Near::of(stations, section.at_mm);
            near.map_or_else(|| AreaError::of(section), |near| near.error(section, slope, &causes, budget))
        })
        .collect();
    for (section, error) in sections.iter_mut().zip(&errors) {
        let judged =
            |measure: crate::SectionMeasure| measure.with_sd(error.random_mm2, error.common_sd_mm2());
        section.measure = section.measure.map(judged);
        section.force_n = Near::of(stations, section.at_mm).and_then(|near| near.force_n());
    }
    errors
}

/// How fast the area changes along the vessel at each section (mm2/mm).
fn slopes(sections: &[Section]) -> Vec<f64> {
    let area = |i: usize| Some((sections.get(i)?.at_mm, sections.get(i)?.measure?.area_mm2));
    let slope = |i: usize| {
        let (before, own, after) = (i.checked_sub(1).and_then(area), area(i), area(i + 1));
        let ((a, b), (c, d)) = (before.or(own)?, after.or(own)?);
        Some((d - b) / (c - a).max(1e-9))
    };
    (0..sections.len()).map(|i| slope(i).unwrap_or(0.0)).collect()
}

/// The stations near a section.
struct Near<'a>(&'a [Station]);

impl<'a> Near<'a> {
    /// Those within reach; the nearest one where none is.
    fn of(stations: &'a [Station], at_mm: f64) -> Option<Self> {
        let from = stations.partition_point(|station| station.at_mm < at_mm - NEAR_MM);
        let to = stations.partition_point(|station| station.at_mm <= at_mm + NEAR_MM);
        if from < to {
            return stations.get(from..to).map(Self);
        }
        let apart = |i: &usize| stations.get(*i).map_or(f64::INFINITY, |s| (s.at_mm - at_mm).abs());
        let nearest =
            [from.saturating_sub(1), from].into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        stations.get(nearest..=nearest).map(Self)
    }

    fn mean<const N: usize>(&self, of: impl Fn(&Station) -> [f64; N]) -> [f64; N] {
        let count = self.0.len() as f64;
        self.0.iter().fold([0.0; N], |mut sum, station| {
            sum.iter_mut().zip(of(station)).for_each(|(sum, part)| *sum += part / count);
            sum
        })
    }

    /// The mean force of those that have one.
    fn force_n(&self) -> Option<f64> {
        let forces = || self.0.iter().filter_map(|station| station.force_n);
        let count = forces().count();
        (count > 0).then(|| forces().sum::<f64>() / count as f64)
    }

    fn error(
        &self,
        section: &Section,
        slope: f64,
        causes: &budget::Causes,
        budget: &ErrorBudget,
    ) -> AreaError {
        let Some(measure) = &section.measure else { return AreaError::random(0.0) };
        let [oblique, border_m, spread] = self.mean(|s| [s.oblique, s.border_sd_m, s.spacing_m]);
        let relative = causes.along(self.mean(|s| s.relative));
        let moved = causes.along(self.mean(|s| s.moved_m));
        let perimeter_mm = std::f64::consts::PI * measure.equivalent_diameter_mm;
        let mut error = AreaError::random(measure.area_sd_mm2);
        for k in 0..PARAMETERS {
            error.moved_mm[k] = 1e3 * moved[k];
            // What is measured here belongs to where it truly was.
            error.common_mm2[k] = measure.area_mm2 * relative[k] - slope * error.moved_mm[k];
        }
        error.common_mm2[PARAMETERS] = perimeter_mm * 1e3 * border_m.hypot(budget.border_sd_m);
        // Poses noisy along the vessel show another place's area; poses noisy in angle show a cut more or less oblique.
        let alone = budget.poses_in(2e-3 * NEAR_MM, spread).sqrt();
        let along_mm2 = slope * 1e3 * budget.pose_sd_m / alone;
        let tilt_mm2 = measure.area_mm2 * oblique * budget.pose_sd_rad / alone;
        error.random_mm2 = error.random_mm2.hypot(along_mm2).hypot(tilt_mm2);
        error
    }
}

#[cfg(test)]
mod tests;
