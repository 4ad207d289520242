//! One vessel of the tree: its centreline, its tube, and what is measured on them.

use crate::centreline::Centreline;
use crate::surface::{self, LumenSurface, Tube};
use crate::{Contour, LumenSettings, ReconError, Section, Stenosis, section, stenosis};

/// Sections are this far apart (m).
const SECTION_STEP_M: f64 = 0.5e-3;

/// The artery that was followed, or a branch of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Vessel {
    /// Its number: 0 is the one followed first, as in the contours' `vessel`.
    pub number: usize,
    /// The curve along its middle.
    pub centreline: Centreline,
    /// Its surface, as a grid.
    pub surface: LumenSurface,
    /// Sections normal to the centreline, every half millimetre.
    pub sections: Vec<Section>,
    /// Its narrowings.
    pub stenoses: Vec<Stenosis>,
    /// The border's distance from the centreline, with its covariance.
    pub(crate) tube: Tube,
}

/// Where along the centreline a contour lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Length from the beginning (m).
    pub at_m: f64,
    /// Whether the dark region runs on beyond the contour.
    pub branches: bool,
}

impl Vessel {
    /// The vessel along a centreline, and the places of its contours in order.
    pub(crate) fn along(
        number: usize,
        centreline: Centreline,
        contours: &[&Contour],
        settings: &LumenSettings,
    ) -> Result<(Self, Vec<Place>), ReconError> {
        let tube = Tube::fit(&surface::samples(&centreline, contours))?;
        let seen = places(&centreline, contours);
        let measured = |at: f64| is_measured(&seen, at, settings.longest_gap_m);
        let surface = surface::grid(&centreline, &tube, settings.grid, measured);
        let sections = section::sections(&centreline, &tube, SECTION_STEP_M, measured);
        let stenoses = stenosis::find(&sections, settings.least_percent_area);
        Ok((Self { number, centreline, surface, sections, stenoses, tube }, seen))
    }
}

/// Where along the centreline contours lie, in order, and whether they branch.
fn places(line: &Centreline, contours: &[&Contour]) -> Vec<Place> {
    let place = |contour: &&Contour| {
        let at_m = line.nearest_m(&contour.centre.vector())?;
        Some(Place { at_m, branches: contour.branches })
    };
    let mut places: Vec<Place> = contours.iter().filter_map(place).collect();
    places.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
    places
}

/// Whether contours lie on both sides of a place, no farther apart than the longest gap.
fn is_measured(seen: &[Place], at: f64, longest_gap: f64) -> bool {
    let after = seen.partition_point(|place| place.at_m < at);
    let next = seen.get(after).map_or(f64::INFINITY, |place| place.at_m - at);
    let last = after.checked_sub(1).and_then(|i| seen.get(i)).map_or(f64::INFINITY, |place| at - place.at_m);
    // At the ends a contour within half a gap will do.
    next + last <= longest_gap || next.min(last) <= 0.25 * longest_gap
}
