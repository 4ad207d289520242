//! How sure an area is: what is left open at each place by itself, and what the whole scan shares.

use crate::Section;

/// How many independent causes a whole scan shares.
pub(crate) const COMMON: usize = 11;
/// Two places this far apart have hardly any random error in common (mm): the beam's thickness and the surface's
/// smoothing.
pub(crate) const ALONE_MM: f64 = 2.5;

/// The errors of one section's area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AreaError {
    /// Standard deviation of what its neighbours share only in part: speckle, noise of the poses (mm2).
    pub(crate) random_mm2: f64,
    /// What each common cause, of standard deviation one and independent of the others, moves the area by (mm2).
    pub(crate) common_mm2: [f64; COMMON],
}

impl AreaError {
    /// The random errors of a section.
    pub(crate) fn of(section: &Section) -> Self {
        Self::random(section.measure.as_ref().map_or(0.0, |measure| measure.area_sd_mm2))
    }

    /// Only random errors.
    pub(crate) const fn random(sd_mm2: f64) -> Self {
        Self { random_mm2: sd_mm2, common_mm2: [0.0; COMMON] }
    }

    /// Standard deviation from what the whole scan shares (mm2).
    pub(crate) fn common_sd_mm2(&self) -> f64 {
        self.common_mm2.iter().map(|part| part * part).sum::<f64>().sqrt()
    }

    /// Standard deviation from everything (mm2).
    pub(crate) fn total_mm2(&self) -> f64 {
        self.random_mm2.hypot(self.common_sd_mm2())
    }
}

/// How much of their random errors two places `apart_mm` share.
pub(crate) fn shared(apart_mm: f64) -> f64 {
    (-(apart_mm / ALONE_MM).powi(2)).exp()
}
