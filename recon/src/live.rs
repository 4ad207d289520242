//! The lumen while the probe is still moving: what is seen so far, and where it has to look again.

use std::collections::HashMap;
use std::fmt;

use probepath_frames::Stamp;
use probepath_us_capture::PlacedBScan;

use crate::reconstruct::counts;
use crate::vessel::{Fitted, Place};
use crate::{
    Centreline, Contour, ImageCounts, ImageLumen, LumenFinder, LumenSettings, LumenSurface, ReconError,
    ReconWarning, Tracker,
};

/// The view takes no more than this many contours from a cube of this edge (m): its cost grows with the vessel, not
/// with the number of images.
const PER_CUBE: usize = 2;
const CUBE_M: f64 = 0.5e-3;
/// Areas are given this far apart (m).
const AREA_STEP_M: f64 = 1e-3;
/// Images farther apart than this blur a short stenosis (m).
const SPARSE_M: f64 = 1.5e-3;
/// The sweep's speed is taken over so many images.
const SPEED_OVER: usize = 5;

/// Finds the lumen image by image and shows the vessel as far as it has been seen.
///
/// [`push`](Self::push) takes an image, [`view`](Self::view) what has come together. The view is fitted anew each time,
/// to contours half a millimetre apart: its cost grows with the length of the vessel and no longer with the number of
/// images. When the sweep is over, [`into_lumens`](Self::into_lumens) goes to
/// [`reconstruct_from`](crate::reconstruct_from), which uses every contour.
///
/// Beside [`reconstruct_lumen`](crate::reconstruct_lumen) the lumens are found without the images to come: what the
/// beam's thickness takes in from the other side of a stenosis is not known yet. Branches are left to the whole.
pub struct LiveLumen {
    settings: LumenSettings,
    finder: Box<dyn LumenFinder>,
    lumens: Vec<ImageLumen>,
    formed: Vec<Stamp>,
    /// Which images the view takes, and how many lie in each cube.
    viewed: Vec<usize>,
    cubes: HashMap<[i64; 3], usize>,
}

/// The vessel as far as it has been seen.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// How many images there were, and how many showed a lumen.
    pub counts: ImageCounts,
    /// The vessel; or what is missing for one.
    pub vessel: Result<VesselSoFar, ReconError>,
    /// How fast the lumen's centre moved over the last images (mm/s), when their stamps say so.
    pub speed_mm_s: Option<f64>,
    /// Whether the last images are so far apart (1.5 mm) that a short stenosis would be blurred.
    pub too_fast: bool,
}

impl fmt::Display for View {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ImageCounts { images, without_lumen, .. } = self.counts;
        write!(f, "lumen in {} of {images} images", images - without_lumen)?;
        if let Ok(vessel) = &self.vessel {
            let (length, covered) = (vessel.centreline.length_m() * 1e3, vessel.covered_percent);
            write!(f, ", {length:.0} mm of vessel ({covered:.0} % seen)")?;
            if let Some(AreaSoFar { at_mm, area_mm2, .. }) = vessel.narrowest() {
                write!(f, ", narrowest {area_mm2:.1} mm² at {at_mm:.0} mm")?;
            }
        }
        if self.too_fast { write!(f, ", too fast for a short stenosis") } else { Ok(()) }
    }
}

impl VesselSoFar {
    /// Where it is narrowest.
    pub fn narrowest(&self) -> Option<&AreaSoFar> {
        self.areas.iter().min_by(|a, b| a.area_mm2.total_cmp(&b.area_mm2))
    }
}

/// Surface, coverage and areas so far.
#[derive(Clone, Debug, PartialEq)]
pub struct VesselSoFar {
    /// The curve along its middle.
    pub centreline: Centreline,
    /// Its surface, as a grid.
    pub surface: LumenSurface,
    /// Area every millimetre where it is measured.
    pub areas: Vec<AreaSoFar>,
    /// Stretches that images show (mm along the centreline, from and to).
    pub covered_mm: Vec<(f64, f64)>,
    /// The part of the centreline that they are (%).
    pub covered_percent: f64,
    /// Stretches in which images are farther apart than 1.5 mm (mm, from and to).
    pub sparse_mm: Vec<(f64, f64)>,
    /// What has to be said about it.
    pub warnings: Vec<ReconWarning>,
}

/// Area of the lumen at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaSoFar {
    /// Along the centreline (mm).
    pub at_mm: f64,
    /// Area (mm2).
    pub area_mm2: f64,
    /// Its standard deviation, from speckle and poses (mm2).
    pub area_sd_mm2: f64,
}

impl LiveLumen {
    /// Before the first image, with our own finder.
    ///
    /// # Errors
    /// When the settings make no sense.
    pub fn new(settings: LumenSettings) -> Result<Self, ReconError> {
        let finder = Box::new(Tracker::new(settings.clone()));
        Self::with_finder(settings, finder)
    }

    /// The same with another finder.
    ///
    /// # Errors
    /// When the settings make no sense.
    pub fn with_finder(settings: LumenSettings, finder: Box<dyn LumenFinder>) -> Result<Self, ReconError> {
        settings.check()?;
        let (lumens, formed, viewed) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { settings, finder, lumens, formed, viewed, cubes: HashMap::new() })
    }

    /// Looks for the lumen in an image.
    ///
    /// # Errors
    /// When the image has no size or no place.
    pub fn push(&mut self, image: &PlacedBScan) -> Result<&ImageLumen, ReconError> {
        crate::reconstruct::check(image)?;
        let lumen = self.finder.find(image);
        let index = self.lumens.len();
        if let Ok(contour) = &lumen.lumen {
            let cube = contour.centre.vector().map(|x| (x / CUBE_M).floor() as i64);
            let here = self.cubes.entry(cube.into()).or_default();
            *here += 1;
            if *here <= PER_CUBE {
                self.viewed.push(index);
            }
        }
        self.formed.push(image.bscan.formed);
        self.lumens.push(lumen);
        self.lumens.last().ok_or(ReconError::NoImages)
    }

    /// What each image gave so far.
    pub fn lumens(&self) -> &[ImageLumen] {
        &self.lumens
    }

    /// The same, for the reconstruction that uses all of it.
    pub fn into_lumens(self) -> Vec<ImageLumen> {
        self.lumens
    }

    /// The vessel so far.
    pub fn view(&self) -> View {
        let shown =
            |i: &usize| self.lumens.get(*i)?.lumen.as_ref().ok().filter(|contour| contour.vessel == 0);
        let newest = (0..self.lumens.len()).rev().find(|i| shown(i).is_some());
        let newest = newest.filter(|newest| self.viewed.last() != Some(newest));
        let contours: Vec<&Contour> = self.viewed.iter().chain(&newest).filter_map(shown).collect();
        let (speed_mm_s, apart) = self.pace();
        View {
            counts: counts(&self.lumens),
            vessel: Fitted::to(&contours).map(|(fitted, _)| self.so_far(fitted)),
            speed_mm_s,
            too_fast: apart > SPARSE_M,
        }
    }

    fn so_far(&self, fitted: Fitted) -> VesselSoFar {
        let gap = self.settings.longest_gap_m;
        let warnings = fitted.warnings(gap);
        let length = fitted.centreline.length_m();
        let covered = stretches(&fitted.seen, |apart| apart <= gap);
        let covered_m: f64 = covered.iter().map(|(from, to)| to - from).sum();
        let sparse = stretches(&fitted.seen, |apart| apart > SPARSE_M);
        let in_mm = |of: Vec<(f64, f64)>| of.into_iter().map(|(a, b)| (a * 1e3, b * 1e3)).collect();
        let surface = fitted.grid(&self.settings);
        VesselSoFar {
            areas: areas(&fitted, gap),
            covered_percent: (100.0 * covered_m / length.max(1e-9)).min(100.0),
            covered_mm: in_mm(covered),
            sparse_mm: in_mm(sparse),
            centreline: fitted.centreline,
            surface,
            warnings,
        }
    }

    /// Speed over the last images with a lumen (mm/s), and how far apart they are (m).
    fn pace(&self) -> (Option<f64>, f64) {
        let each = self.lumens.iter().zip(&self.formed).rev();
        let last: Vec<_> =
            each.filter_map(|(l, at)| Some((l.lumen.as_ref().ok()?.centre, *at))).take(SPEED_OVER).collect();
        let steps = last.windows(2).map(|pair| pair[0].0.distance(&pair[1].0));
        let way: f64 = steps.sum();
        let apart = way / (last.len().max(2) - 1) as f64;
        let time = last.first().zip(last.last()).map_or(0.0, |(new, old)| (new.1 - old.1).seconds());
        ((time > 0.0).then(|| way * 1e3 / time), apart)
    }
}

/// Stretches over which neighbouring contours are as far apart as asked (m).
fn stretches(seen: &[Place], asked: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
    let pairs = seen.windows(2).map(|pair| (pair[0].at_m, pair[1].at_m)).filter(|(a, b)| asked(b - a));
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    for (from, to) in pairs {
        match stretches.last_mut() {
            Some(last) if last.1 >= from => last.1 = to,
            _ => stretches.push((from, to)),
        }
    }
    stretches
}

fn areas(fitted: &Fitted, gap: f64) -> Vec<AreaSoFar> {
    let count = (fitted.centreline.length_m() / AREA_STEP_M).floor() as usize + 1;
    let places = (0..count).map(|i| i as f64 * AREA_STEP_M).filter(|at| fitted.is_measured(*at, gap));
    let area = |at: f64| {
        let (area, sd) = fitted.tube.area(at);
        AreaSoFar { at_mm: at * 1e3, area_mm2: area * 1e6, area_sd_mm2: sd * 1e6 }
    };
    places.map(area).collect()
}

#[cfg(test)]
mod tests;
