//! Stenoses: where the lumen is narrower than the normal segment before it.

use serde::{Deserialize, Serialize};

use crate::Section;

/// A narrowing is bounded where the area is back at this part of the largest nearby.
const SHOULDER: f64 = 0.93;
/// Over this length the area is looked ahead for (mm).
const STRETCH_MM: f64 = 6.0;
/// How far a narrowing may reach on either side of its narrowest place (mm).
const REACH_MM: f64 = 30.0;
/// Length of the normal segment that is the reference (mm), and the least of it that must be measured.
const REFERENCE_MM: f64 = 10.0;
const LEAST_REFERENCE_MM: f64 = 2.0;
/// A stenosis ends: beyond it the vessel is wide again, by at least this part of what it lost.
const RECOVERY: f64 = 0.4;

/// A narrowing of the lumen. B-mode geometry, not a Doppler grade.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stenosis {
    /// Area that is missing, of the reference's (%).
    pub percent_area: f64,
    /// Equivalent diameter that is missing, of the reference's (%).
    pub percent_diameter: f64,
    /// Standard deviation of `percent_area`, from speckle and poses (points).
    pub percent_area_sd: f64,
    /// Where it is narrowest, along the centreline from its beginning (mm).
    pub at_mm: f64,
    /// Where it begins (mm).
    pub from_mm: f64,
    /// How long it is (mm).
    pub length_mm: f64,
    /// The least area (mm2).
    pub min_area_mm2: f64,
    /// The diameter of the circle of that area (mm).
    pub min_diameter_mm: f64,
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
}

/// Which normal segment is the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReferenceSide {
    /// The normal segment before the stenosis, on the side of the first image.
    Proximal,
    /// The one after it, because none before it was imaged.
    Distal,
}

/// A measured section.
#[derive(Clone, Copy)]
struct Place {
    at: f64,
    area: f64,
    sd: f64,
}

/// The stenoses of at least `least_percent_area`, along the vessel.
pub(crate) fn find(sections: &[Section], least_percent_area: f64) -> Vec<Stenosis> {
    let places: Vec<Place> = sections
        .iter()
        .filter_map(|section| {
            let measure = section.measure.as_ref().filter(|measure| measure.area_mm2.is_finite())?;
            Some(Place { at: section.at_mm, area: measure.area_mm2, sd: measure.area_sd_mm2 })
        })
        .collect();
    let mut minima: Vec<usize> = (0..places.len()).filter(|&i| is_minimum(&places, i)).collect();
    minima.sort_by(|&a, &b| places[a].area.total_cmp(&places[b].area));
    let mut found: Vec<Stenosis> = Vec::new();
    for narrowest in minima {
        let at = places[narrowest].at;
        let taken = found.iter().any(|other| (other.from_mm..=other.from_mm + other.length_mm).contains(&at));
        let stenosis = if taken { None } else { measure(&places, narrowest) };
        found.extend(stenosis.filter(|stenosis| is_one(stenosis, least_percent_area)));
    }
    found.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
    found
}

/// Whether what was measured is large enough, and sure.
fn is_one(stenosis: &Stenosis, least_percent_area: f64) -> bool {
    stenosis.percent_area >= least_percent_area && stenosis.percent_area > 3.0 * stenosis.percent_area_sd
}

fn is_minimum(places: &[Place], i: usize) -> bool {
    let area = places[i].area;
    let before = i.checked_sub(1).and_then(|i| places.get(i)).is_none_or(|place| area <= place.area);
    let after = places.get(i + 1).is_none_or(|place| area < place.area);
    before && after
}

fn measure(places: &[Place], narrowest: usize) -> Option<Stenosis> {
    let least = places[narrowest];
    let before: Vec<Place> = near(places[..narrowest].iter().rev().copied(), least.at);
    let after: Vec<Place> = near(places[narrowest + 1..].iter().copied(), least.at);
    let (start, end) = (shoulder(&before, least), shoulder(&after, least));
    let proximal = reference(places, start.at - REFERENCE_MM, start.at, ReferenceSide::Proximal);
    let distal = reference(places, end.at, end.at + REFERENCE_MM, ReferenceSide::Distal);
    let (area, reference) = proximal.or(distal)?;
    let recovered = distal.is_none_or(|(beyond, _)| beyond - least.area >= RECOVERY * (area - least.area));
    let ratio = least.area / area;
    recovered.then(|| Stenosis {
        percent_area: 100.0 * (1.0 - ratio),
        percent_diameter: 100.0 * (1.0 - ratio.sqrt()),
        percent_area_sd: 100.0 * least.sd / area,
        at_mm: least.at,
        from_mm: start.at,
        length_mm: end.at - start.at,
        min_area_mm2: least.area,
        min_diameter_mm: 2.0 * (least.area / std::f64::consts::PI).sqrt(),
        reference_area_mm2: area,
        reference,
    })
}

/// Those within reach, up to the first gap.
fn near(places: impl Iterator<Item = Place>, from: f64) -> Vec<Place> {
    let mut last = from;
    places
        .take_while(|place| {
            let joined = (place.at - last).abs() < 5.0 && (place.at - from).abs() <= REACH_MM;
            last = place.at;
            joined
        })
        .collect()
}

/// Where the area, going outward, is first back at what it reaches there before it narrows again.
fn shoulder(outward: &[Place], least: Place) -> Place {
    // The next narrowing ends this one: past the top, where the area has fallen by half of what it rose.
    let mut top = least.area;
    let until = outward.iter().position(|place| {
        top = top.max(place.area);
        place.area < top - 0.5 * (top - least.area) && top > 1.2 * least.area
    });
    let own = &outward[..until.unwrap_or(outward.len())];
    let largest = own.iter().map(|place| place.area).fold(least.area, f64::max);
    // Half of what was lost is back, and the next stretch brings hardly more: beyond a branch the vessel may be of
    // another size altogether, and that is no part of this narrowing.
    let half = least.area + 0.5 * (largest - least.area);
    let ended = own.iter().find(|place| {
        let beyond = own.iter().filter(|next| (next.at - least.at).abs() >= (place.at - least.at).abs());
        let near = beyond.filter(|next| (next.at - place.at).abs() <= STRETCH_MM);
        place.area >= half && place.area >= SHOULDER * near.map(|next| next.area).fold(0.0, f64::max)
    });
    ended.copied().unwrap_or(least)
}

/// The median area between two places, when enough of it was measured.
fn reference(places: &[Place], from: f64, to: f64, side: ReferenceSide) -> Option<(f64, Reference)> {
    let inside: Vec<Place> = places.iter().copied().filter(|place| (from..=to).contains(&place.at)).collect();
    let (first, last) = (inside.first()?, inside.last()?);
    if last.at - first.at < LEAST_REFERENCE_MM {
        return None;
    }
    let mut areas: Vec<f64> = inside.iter().map(|place| place.area).collect();
    areas.sort_by(f64::total_cmp);
    let median = areas[areas.len() / 2];
    Some((median, Reference { side, from_mm: first.at, to_mm: last.at }))
}

#[cfg(test)]
mod tests;
