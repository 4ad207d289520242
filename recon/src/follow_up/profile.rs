//! An exam as a row of radii along the vessel, asked at any place.

use nalgebra::Vector3;

use super::{FollowUpError, LEAST_MM};
use crate::Section;

/// Nothing is said between sections farther apart than this (mm).
const HOLE_MM: f64 = 2.0;

/// A measured place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Along the vessel (mm).
    pub(super) at: f64,
    /// Area (mm2), and its standard deviations: random, common.
    pub(super) area: f64,
    pub(super) random: f64,
    pub(super) common: f64,
    /// The centreline (m).
    pub(super) centre: Vector3<f64>,
}

impl Row {
    /// Radius of the circle of the same area (mm).
    pub(super) fn radius(&self) -> f64 {
        (self.area / std::f64::consts::PI).sqrt()
    }

    /// Variance of the radius from what is random (mm2).
    pub(super) fn radius_variance(&self) -> f64 {
        (self.random / (std::f64::consts::TAU * self.radius())).powi(2)
    }
}

/// The measured places of an exam.
pub(super) struct Profile(Vec<Row>);

impl Profile {
    pub(super) fn of(sections: &[Section], which: &str) -> Result<Self, FollowUpError> {
        let rows: Vec<Row> = sections.iter().filter_map(row).collect();
        let measured_mm = rows.first().zip(rows.last()).map_or(0.0, |(a, b)| b.at - a.at);
        if measured_mm < LEAST_MM {
            return Err(FollowUpError::Short { which: which.into(), measured_mm });
        }
        Ok(Self(rows))
    }

    pub(super) fn rows(&self) -> &[Row] {
        &self.0
    }

    /// First and last place (mm).
    pub(super) fn span(&self) -> [f64; 2] {
        self.0.first().zip(self.0.last()).map_or([0.0; 2], |(a, b)| [a.at, b.at])
    }

    /// What it measured at a place; nothing in a hole or beyond an end.
    pub(super) fn at(&self, at: f64) -> Option<Row> {
        let after = self.0.partition_point(|row| row.at < at).clamp(1, self.0.len().max(2) - 1);
        let (a, b) = (self.0.get(after - 1)?, self.0.get(after)?);
        if at < a.at || at > b.at || b.at - a.at > HOLE_MM {
            return None;
        }
        let t = (at - a.at) / (b.at - a.at).max(1e-9);
        let blend = |a: f64, b: f64| a + (b - a) * t;
        Some(Row {
            at,
            area: blend(a.area, b.area),
            random: blend(a.random, b.random),
            common: blend(a.common, b.common),
            centre: a.centre.lerp(&b.centre, t),
        })
    }

    /// How fast the area changes at a place (mm2/mm).
    pub(super) fn slope(&self, at: f64) -> f64 {
        let pair = self.at(at - 1.0).zip(self.at(at + 1.0));
        pair.map_or(0.0, |(a, b)| 0.5 * (b.area - a.area))
    }
}

fn row(section: &Section) -> Option<Row> {
    let measure = section.measure.as_ref().filter(|m| m.area_mm2.is_finite() && m.area_mm2 > 0.0)?;
    Some(Row {
        at: section.at_mm,
        area: measure.area_mm2,
        random: measure.area_sd_mm2,
        common: measure.area_common_sd_mm2,
        centre: section.centre.vector(),
    })
}
