//! One vessel of the tree: its centreline, its tube, and what is measured on them.

mod closed;
mod root;
mod sweeps;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub(crate) use closed::surface as closed_surface;

use root::Root;

use crate::centreline::Centreline;
use crate::surface::{self, LumenSurface, Samples, Tube};
use crate::uncertainty::{self, AreaError, Shown};
use crate::{Contour, LumenSettings, ReconError, ReconWarning, Section, Stenosis, section, stenosis};

/// Sections are this far apart (m).
const SECTION_STEP_M: f64 = 0.5e-3;
/// How often the centreline is moved to the middle of what is round it.
const ROUNDS: usize = 2;
/// A contour whose centre is farther than this from the smooth centreline is of something else (m).
const FAR_M: f64 = 3e-3;
/// The least number of contours that make a surface.
const LEAST_CONTOURS: usize = 4;

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
    /// Where it leaves the vessel it is a branch of; nothing for the first vessel, and where it was not seen to leave.
    pub leaves: Option<Leaves>,
    /// The border's distance from the centreline, with its covariance.
    pub(crate) tube: Tube,
    /// The stretch between the parent's middle and the branch's first section.
    pub(crate) root: Option<Root>,
    seen: Vec<Place>,
    longest_gap_m: f64,
}

/// Where a branch leaves its parent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leaves {
    /// The parent's number.
    pub parent: usize,
    /// Where it comes out of the parent's surface, along the parent's centreline (mm).
    pub at_mm: f64,
    /// Between the directions of the two, both away from the parent's beginning for a branch that goes on with the
    /// blood (degrees).
    pub angle_deg: f64,
}

/// Where along the centreline a contour lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Length from the beginning (m).
    pub at_m: f64,
    /// Whether the dark region runs on beyond the contour.
    pub branches: bool,
}

/// A centreline and the tube round it, before anything is measured.
pub(crate) struct Fitted {
    pub centreline: Centreline,
    pub tube: Tube,
    /// The contours as seen from the centreline, sorted along it.
    pub samples: Vec<Samples>,
    /// Where they lie, sorted.
    pub seen: Vec<Place>,
}

impl Fitted {
    /// From contours in the order of their images. Also which of them are far from the vessel, and how far (m): they
    /// are left out.
    ///
    /// # Errors
    /// When fewer than four are left, or they span no length.
    pub(crate) fn to(contours: &[&Contour]) -> Result<(Self, Vec<(usize, f64)>), ReconError> {
        Self::settled(contours, Ok)
    }

    /// A branch: it begins at the end that is nearer to one of `vessels`. Also which of them.
    pub(crate) fn branch(contours: &[&Contour], vessels: &[Vessel]) -> Result<(Self, usize), ReconError> {
        let parent =
            |line: &Centreline| root::parent(line, vessels).ok_or(ReconError::NoFit { what: "branch" });
        let from_parent = |line: Centreline| Ok(if parent(&line)?.1 { line.reversed() } else { line });
        let (fitted, _) = Self::settled(contours, from_parent)?;
        let (parent, _) = parent(&fitted.centreline)?;
        Ok((fitted, parent))
    }

    /// Lays the vessel through the contours, and again without those that are far from it.
    fn settled(
        contours: &[&Contour],
        turned: impl Fn(Centreline) -> Result<Centreline, ReconError>,
    ) -> Result<(Self, Vec<(usize, f64)>), ReconError> {
        let (mut kept, mut strays): (Vec<usize>, Vec<(usize, f64)>) =
            ((0..contours.len()).collect(), Vec::new());
        loop {
            if kept.len() < LEAST_CONTOURS {
                let (seen, images) = (kept.len(), contours.len());
                let reason = "away from its neighbours".into();
                return Err(ReconError::TooFew { seen, images, needed: LEAST_CONTOURS, reason });
            }
            let these: Vec<&Contour> = kept.iter().map(|&i| contours[i]).collect();
            let centres: Vec<Vector3<f64>> = these.iter().map(|contour| contour.centre.vector()).collect();
            let fitted = Self::along(turned(Centreline::through(&centres)?)?, &these)?;
            let off = |i: &usize| fitted.centreline.distance_to(&contours[*i].centre.vector());
            let far: Vec<(usize, f64)> =
                kept.iter().map(|i| (*i, off(i))).filter(|(_, by)| by.is_nan() || *by > FAR_M).collect();
            if far.is_empty() {
                return Ok((fitted, strays));
            }
            kept.retain(|i| far.iter().all(|(stray, _)| stray != i));
            strays.extend(far);
        }
    }

    /// The tube along a first guess of the centreline, which moves to the middle of what is round it.
    fn along(mut centreline: Centreline, contours: &[&Contour]) -> Result<Self, ReconError> {
        for _ in 0..ROUNDS {
            let shape = Tube::shape_of(&surface::coarse_samples(&centreline, contours))?;
            centreline = centreline.recentred(&shape)?;
        }
        let samples = surface::samples(&centreline, contours);
        let tube = Tube::fit(&samples)?;
        let place = |s: &Samples| Place { at_m: s.at, branches: contours[s.turn].branches };
        let seen = samples.iter().map(place).collect();
        Ok(Self { centreline, tube, samples, seen })
    }

    /// What has to be said about gaps, branches and sweeps that disagree.
    pub(crate) fn warnings(&self, longest_gap_m: f64) -> Vec<ReconWarning> {
        let pairs = self.seen.windows(2).filter(|pair| pair[1].at_m - pair[0].at_m > longest_gap_m);
        let gap =
            |pair: &[Place]| ReconWarning::Gap { from_mm: pair[0].at_m * 1e3, to_mm: pair[1].at_m * 1e3 };
        // Three in a row: one alone is speckle.
        let runs = self.seen.chunk_by(|a, b| a.branches == b.branches);
        let runs = runs.filter(|run| run.len() >= 3 && run[0].branches);
        let branch = |run: &[Place]| ReconWarning::Branch {
            from_mm: run[0].at_m * 1e3,
            to_mm: run[run.len() - 1].at_m * 1e3,
        };
        let disagreement = sweeps::disagreement(&self.centreline, &self.tube, &self.samples);
        pairs.map(gap).chain(runs.map(branch)).chain(disagreement).collect()
    }

    /// Whether images show the lumen at a length (m).
    pub(crate) fn is_measured(&self, at: f64, longest_gap_m: f64) -> bool {
        is_measured(&self.seen, at, longest_gap_m)
    }

    /// The surface as a grid.
    pub(crate) fn grid(&self, settings: &LumenSettings) -> LumenSurface {
        let measured = |at: f64| self.is_measured(at, settings.longest_gap_m);
        surface::grid(&self.centreline, &self.tube, settings.grid, measured)
    }

    /// The vessel with its grid and measures.
    pub(crate) fn vessel(self, number: usize, settings: &LumenSettings) -> Vessel {
        let surface = self.grid(settings);
        let Self { centreline, tube, seen, .. } = self;
        let measured = |at: f64| is_measured(&seen, at, settings.longest_gap_m);
        let sections = section::sections(&centreline, &tube, SECTION_STEP_M, measured);
        let errors: Vec<AreaError> = sections.iter().map(AreaError::of).collect();
        let stenoses = stenosis::find(&sections, &errors, settings);
        let longest_gap_m = settings.longest_gap_m;
        let (leaves, root) = (None, None);
        Vessel { number, centreline, surface, sections, stenoses, leaves, tube, root, seen, longest_gap_m }
    }
}

impl Vessel {
    /// Whether images show the lumen at a length (m).
    fn is_measured(&self, at: f64) -> bool {
        is_measured(&self.seen, at, self.longest_gap_m)
    }

    /// The same with what the calibration, the poses and the lag add to the sections' intervals, with the force that the
    /// probe pressed with, and its stenoses measured with them.
    pub(crate) fn judged(mut self, shown: &[Shown<'_>], settings: &LumenSettings) -> Self {
        let stations = uncertainty::stations(shown, &self.centreline);
        let errors = uncertainty::judge(&mut self.sections, &stations, &settings.errors);
        self.stenoses = stenosis::find(&self.sections, &errors, settings);
        self
    }

    /// The same as a branch of one of `vessels`; as a vessel by itself when it was not seen to leave that one.
    pub(crate) fn rooted(mut self, vessels: &[Self], parent: usize) -> Self {
        (self.root, self.leaves) = root::root(&self, vessels, parent).unzip();
        self
    }
}

/// Whether contours lie on both sides of a place, no farther apart than the longest gap.
fn is_measured(seen: &[Place], at: f64, longest_gap: f64) -> bool {
    let after = seen.partition_point(|place| place.at_m < at);
    let next = seen.get(after).map_or(f64::INFINITY, |place| place.at_m - at);
    let last = after.checked_sub(1).and_then(|i| seen.get(i)).map_or(f64::INFINITY, |place| at - place.at_m);
    // At the ends a contour within half a gap will do.
    next + last <= longest_gap || next.min(last) <= 0.25 * longest_gap
}

#[cfg(test)]
mod tests;
