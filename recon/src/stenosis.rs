//! Stenoses: where the lumen is narrower than the normal segment before it.

mod find;
mod place;
mod reference;
mod shoulder;

use std::fmt;

use serde::{Deserialize, Serialize};

pub(crate) use find::{find, has_reference};

/// A narrowing of the lumen. B-mode geometry, not a Doppler grade.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stenosis {
    /// Area that is missing, of the reference's (%).
    pub percent_area: f64,
    /// Equivalent diameter that is missing, of the reference's (%).
    pub percent_diameter: f64,
    /// Standard deviation of `percent_area`, from everything known (points).
    pub percent_area_sd: f64,
    /// Holds the true percent area with 95 % probability. What the whole scan shares (scale, wall, calibration)
    /// moves the narrowest place and the reference together, and is not counted twice. Where it may be narrower unseen, it
    /// reaches to 100.
    pub percent_area_interval: [f64; 2],
    /// The same for the percent diameter.
    pub percent_diameter_interval: [f64; 2],
    /// Where it is narrowest, along the centreline from its beginning (mm).
    pub at_mm: f64,
    /// Its 95 % interval (mm).
    pub at_interval_mm: [f64; 2],
    /// Where it begins (mm).
    pub from_mm: f64,
    /// How long it is (mm).
    pub length_mm: f64,
    /// Its 95 % interval (mm).
    pub length_interval_mm: [f64; 2],
    /// Whether it runs on beyond what was measured: then it may be narrower there, and longer.
    pub cut_off: bool,
    /// How much of it, or of the hole that it ends at, no image shows (mm).
    #[serde(default)]
    pub unseen_mm: f64,
    /// Whether it may be narrower than what was measured, because its narrowest place may not have been seen: the percents
    /// are the least that it has lost.
    #[serde(default)]
    pub may_be_narrower: bool,
    /// The least area (mm2).
    pub min_area_mm2: f64,
    /// Its 95 % interval (mm2).
    pub min_area_interval_mm2: [f64; 2],
    /// The diameter of the circle of that area (mm).
    pub min_diameter_mm: f64,
    /// Its 95 % interval (mm).
    pub min_diameter_interval_mm: [f64; 2],
    /// The diameter of the largest circle inside the narrowest section (mm).
    pub minimal_inscribed_diameter_mm: f64,
    /// How far the narrowest lumen lies off the middle of the vessel, as the normal segments on both sides continue
    /// it, of what there is room for: 0 in the middle, 1 against the wall. None without a normal segment on both
    /// sides.
    pub asymmetry: Option<f64>,
    /// The reference's area (mm2).
    pub reference_area_mm2: f64,
    /// What the reference is.
    pub reference: Reference,
}

/// The segment that a stenosis is measured against: the median of its areas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Which side it lies on.
    pub side: ReferenceSide,
    /// Where it begins (mm).
    pub from_mm: f64,
    /// Where it ends (mm).
    pub to_mm: f64,
    /// Beginning and end of the segment beyond the stenosis, when the reference lies between both (mm).
    pub distal_mm: Option<[f64; 2]>,
}

/// Which reference is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReferenceChoice {
    /// The normal segment before the stenosis; the one after it where there is none.
    #[default]
    Proximal,
    /// Between the normal segments before and after it, linear along the vessel, for one that tapers; the one there
    /// is where the other is missing.
    Interpolated,
    /// The median area of a stretch that the user names. Where nothing is measured in it, no stenosis is judged.
    Between {
        /// Where it begins (mm along the centreline).
        from_mm: f64,
        /// Where it ends (mm).
        to_mm: f64,
    },
}

/// Which normal segment is the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReferenceSide {
    /// The normal segment before the stenosis, on the side of the first image.
    Proximal,
    /// The one after it, because none before it was imaged.
    Distal,
    /// Between both, at the narrowest place.
    Interpolated,
    /// The stretch that the user named.
    Chosen,
}

impl fmt::Display for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stretch = format!("{:.0} to {:.0} mm", self.from_mm, self.to_mm);
        match (self.side, self.distal_mm) {
            (ReferenceSide::Proximal, _) => write!(f, "proximal normal segment, {stretch}"),
            (ReferenceSide::Distal, _) => write!(f, "distal normal segment, {stretch}"),
            (ReferenceSide::Chosen, _) => write!(f, "chosen segment, {stretch}"),
            (ReferenceSide::Interpolated, None) => write!(f, "interpolated normal segments, {stretch}"),
            (ReferenceSide::Interpolated, Some([from, to])) => {
                write!(f, "interpolated between normal segments, {stretch} and {from:.0} to {to:.0} mm")
            }
        }
    }
}

#[cfg(test)]
mod tests;
