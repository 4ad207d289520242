//! The search for stenoses along a row of sections.

use super::place::{self, Place, bottom, places};
use super::reference::{Normal, Segment, asymmetry, beside, stretch};
use super::shoulder::{Shoulder, shoulders};
use super::{ReferenceChoice, Stenosis};
use crate::section::{TWO_SIDED_95, area_interval, diameter_of};
use crate::uncertainty::{ALONE_MM, AreaError};
use crate::{LumenSettings, Section};

/// A stenosis ends: beyond it the vessel is wide again, by at least this part of what it lost.
const RECOVERY: f64 = 0.4;
/// A narrowing of less than this (%), or of half of what is called a stenosis, is noise: normal segments may hold it.
const HARDLY: f64 = 15.0;
/// Places farther apart than this have something unseen between them (mm): sections are half a millimetre apart.
const UNSEEN_MM: f64 = 1.2;
/// A narrowing whose narrowest place is this near to where the scan ends may be narrower beyond (mm).
const AT_THE_END_MM: f64 = 2.0;

/// A narrowing, before it is measured.
struct Narrowing {
    narrowest: usize,
    ends: [Shoulder; 2],
}

/// The stenoses of at least the settings' percent area, along the vessel. `errors` says how sure each section is.
pub(crate) fn find(sections: &[Section], errors: &[AreaError], settings: &LumenSettings) -> Vec<Stenosis> {
    let places = places(sections, errors);
    let narrowings = narrowings(&places, HARDLY.min(0.5 * settings.least_percent_area));
    let measured = narrowings.iter().enumerate().filter_map(|(own, narrowing)| {
        let others = || narrowings.iter().enumerate().filter(move |(k, _)| *k != own).map(|(_, other)| other);
        let normal = |at: f64| !others().any(|other| other.holds(&places, at));
        measure(&places, narrowing, settings.reference, normal)
    });
    let mut found: Vec<Stenosis> = measured.filter(|s| is_one(s, settings.least_percent_area)).collect();
    found.sort_by(|a, b| a.at_mm.total_cmp(&b.at_mm));
    found
}

/// Whether a stretch holds enough measured sections to be a reference.
pub(crate) fn has_reference(sections: &[Section], from_mm: f64, to_mm: f64) -> bool {
    let errors: Vec<AreaError> = sections.iter().map(AreaError::of).collect();
    stretch(&places(sections, &errors), from_mm, to_mm).is_some()
}

/// Whether what was measured is large enough, and sure.
fn is_one(stenosis: &Stenosis, least_percent_area: f64) -> bool {
    stenosis.percent_area >= least_percent_area && stenosis.percent_area > 3.0 * stenosis.percent_area_sd
}

/// Every stretch that is narrower than what lies beside it, the narrowest first; none inside another, and none that
/// reaches across a narrower place: where a branch leaves, the vessel beyond would be one long narrowing.
fn narrowings(places: &[Place], hardly: f64) -> Vec<Narrowing> {
    let mut minima: Vec<usize> = (0..places.len()).filter(|&i| is_minimum(places, i)).collect();
    minima.sort_by(|&a, &b| places[a].smooth.total_cmp(&places[b].smooth));
    let mut found: Vec<Narrowing> = Vec::new();
    for narrowest in minima {
        let at = places[narrowest].at;
        if found.iter().any(|other| other.spans(places, at)) {
            continue;
        }
        let narrowing = Narrowing { narrowest, ends: shoulders(places, narrowest) };
        let across = found.iter().any(|other| narrowing.spans(places, places[other.narrowest].at));
        if !across && narrowing.depth(places) > hardly {
            found.push(narrowing);
        }
    }
    found
}

fn is_minimum(places: &[Place], i: usize) -> bool {
    let area = places[i].smooth;
    let before = i.checked_sub(1).and_then(|i| places.get(i)).is_none_or(|place| area <= place.smooth);
    let after = places.get(i + 1).is_none_or(|place| area < place.smooth);
    before && after
}

impl Narrowing {
    fn span(&self, places: &[Place]) -> [f64; 2] {
        [places[self.ends[0].index].at, places[self.ends[1].index].at]
    }

    /// Whether a place lies in it, its ends with it.
    fn spans(&self, places: &[Place], at: f64) -> bool {
        let [from, to] = self.span(places);
        (from..=to).contains(&at)
    }

    /// Whether a place lies in it, its ends without.
    fn holds(&self, places: &[Place], at: f64) -> bool {
        let [from, to] = self.span(places);
        from < at && at < to
    }

    /// How much of it no image shows, and of the hole beyond an end that was not reached (mm).
    fn unseen_mm(&self, places: &[Place]) -> f64 {
        let [from, to] = self.ends.each_ref().map(|end| end.index);
        let first = if self.ends[0].reached { from } else { from.saturating_sub(1) };
        let last = if self.ends[1].reached { to } else { (to + 1).min(places.len() - 1) };
        let gaps = places[first..=last].windows(2).map(|two| two[1].at - two[0].at);
        gaps.filter(|gap| *gap > UNSEEN_MM).sum()
    }

    /// Whether it is narrowest where what was measured ends.
    fn narrows_out_of_sight(&self, places: &[Place]) -> bool {
        let narrowest = places[self.narrowest].at;
        let ends = [places.first(), places.last()].into_iter().flatten();
        ends.zip(&self.ends).any(|(place, end)| !end.reached && (place.at - narrowest).abs() < AT_THE_END_MM)
    }

    /// How much of the larger shoulder's area is missing (%).
    fn depth(&self, places: &[Place]) -> f64 {
        let shoulder = self.ends.iter().map(|end| places[end.index].smooth).fold(0.0, f64::max);
        100.0 * (1.0 - places[self.narrowest].smooth / shoulder)
    }
}

fn measure(
    places: &[Place],
    narrowing: &Narrowing,
    choice: ReferenceChoice,
    normal: impl Fn(f64) -> bool,
) -> Option<Stenosis> {
    let least = bottom(places, narrowing.narrowest);
    let ends = [narrowing.ends[0].index, narrowing.ends[1].index];
    let beside = beside(places, ends, normal);
    let reference = Normal::chosen(places, choice, &beside, least.at)?;
    recovers(&least, &beside, &reference).then(|| stenosis(places, narrowing, &least, &beside, &reference))
}

/// Whether the vessel is wide again beyond: where it is not, it has only become another.
fn recovers(least: &Place, [_, distal]: &[Option<Segment>; 2], reference: &Normal) -> bool {
    distal.is_none_or(|beyond| beyond.area - least.area >= RECOVERY * (reference.area - least.area))
}

fn stenosis(
    places: &[Place],
    narrowing: &Narrowing,
    least: &Place,
    beside: &[Option<Segment>; 2],
    reference: &Normal,
) -> Stenosis {
    let ratio = least.area / reference.area;
    let sd = ratio_sd(least, reference);
    let parts = ratio_interval(ratio, sd);
    let [from_mm, to_mm] = narrowing.span(places);
    let absolute = least.error.total_mm2();
    let area_mm2 = area_interval(least.area, absolute);
    let along = places.first().map_or(0.0, |first| least.error.apart_sd_mm(&first.error));
    let place_sd = place_sd(places, narrowing).hypot(along);
    let length_sd = length_sd(places, narrowing);
    let length = to_mm - from_mm;
    let unseen_mm = narrowing.unseen_mm(places);
    let may_be_narrower = unseen_mm > 0.0 || narrowing.narrows_out_of_sight(places);
    // Nobody knows how narrow it is where nobody looked.
    let (parts, area_mm2) =
        if may_be_narrower { ([parts[0], 0.0], [0.0, area_mm2[1]]) } else { (parts, area_mm2) };
    Stenosis {
        percent_area: 100.0 * (1.0 - ratio),
        percent_diameter: 100.0 * (1.0 - ratio.sqrt()),
        percent_area_sd: 100.0 * ratio * sd,
        percent_area_interval: parts.map(|part| 100.0 * (1.0 - part * part)),
        percent_diameter_interval: parts.map(|part| 100.0 * (1.0 - part)),
        at_mm: least.at,
        at_interval_mm: around(least.at, place_sd),
        from_mm,
        length_mm: length,
        length_interval_mm: around(length, length_sd).map(|mm| mm.max(0.0)),
        cut_off: !narrowing.ends.iter().all(|end| end.reached),
        unseen_mm,
        may_be_narrower,
        min_area_mm2: least.area,
        min_area_interval_mm2: area_mm2,
        min_diameter_mm: diameter_of(least.area),
        min_diameter_interval_mm: area_mm2.map(diameter_of),
        minimal_inscribed_diameter_mm: least.inscribed,
        asymmetry: asymmetry(least, least.area, beside),
        reference_area_mm2: reference.area,
        reference: reference.reference,
    }
}

fn around(value: f64, sd: f64) -> [f64; 2] {
    [value - TWO_SIDED_95 * sd, value + TWO_SIDED_95 * sd]
}

/// Standard deviation of the logarithm of the ratio of areas: what both share cancels.
fn ratio_sd(least: &Place, reference: &Normal) -> f64 {
    let random = (least.error.random_mm2 / least.area).powi(2) + reference.variance;
    let apart = least.common().into_iter().zip(reference.common).map(|(a, b)| (a - b) * (a - b));
    (random + apart.sum::<f64>()).sqrt()
}

/// The interval of the ratio of diameters, from the widest to the narrowest, so that percents rise.
fn ratio_interval(ratio: f64, sd: f64) -> [f64; 2] {
    let part = ratio.sqrt();
    let reach = TWO_SIDED_95 * 0.5 * sd * part;
    [part + reach, (part - reach).max(0.0)]
}

/// Standard deviation of the narrowest place (mm): a slope of the errors moves the bottom of a parabola.
fn place_sd(places: &[Place], narrowing: &Narrowing) -> f64 {
    let i = narrowing.narrowest;
    let bend = place::bend(places, i);
    let slope_sd = std::f64::consts::SQRT_2 * places[i].error.random_mm2 / ALONE_MM;
    let length = narrowing.span(places);
    // A flat bottom may be anywhere in the narrowing.
    (slope_sd / (2.0 * bend.max(1e-9))).min(0.3 * (length[1] - length[0]))
}

/// Standard deviation of the length (mm): each end lies where the area crosses a limit, and errors move both the
/// area and the limit.
fn length_sd(places: &[Place], narrowing: &Narrowing) -> f64 {
    let end = |end: &Shoulder| {
        let error = std::f64::consts::SQRT_2 * places[end.index].error.random_mm2;
        let slope = place::slope(places, end.index).abs();
        (error / slope.max(0.1 * error)).min(10.0)
    };
    end(&narrowing.ends[0]).hypot(end(&narrowing.ends[1]))
}
