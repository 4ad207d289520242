//! How well the calibration repeats: the recording dealt out to several calibrations, and their points compared.

use probepath_frames::{Point, Probe};

use super::{Spatial, SpatialError, refit, sightings};
use crate::errors::{Repeatability, c_rms};
use crate::fit::Fit;
use crate::shots::Shots;

/// Columns and rows of the points that are compared, spread over the image: as many as [P1] has fiducials in one.
const POINTS: (usize, usize) = (3, 2);

impl Spatial {
    /// What `calibrations` calibrations, each from its own share of the labelled images, make of the same points of
    /// the image: C_rms in the probe's system ([P1] section II.B.3). Labels are as in the whole calibration.
    ///
    /// Images are dealt out in turn, so that every share has seen the whole motion.
    ///
    /// # Errors
    /// When a share has too few images for a fit.
    pub fn repeatability(&self, shots: &Shots, calibrations: usize) -> Result<Repeatability, SpatialError> {
        let all = sightings(shots, &self.seen);
        let fits: Result<Vec<Fit>, SpatialError> = (0..calibrations)
            .map(|share| {
                let part: Vec<_> = all.iter().skip(share).step_by(calibrations).cloned().collect();
                refit(shots, &part, &self.phantom, &self.options, &self.fit)
            })
            .collect();
        let fits = fits?;
        let (width, height) = shots.size();
        let targets: Vec<Vec<Point<Probe>>> = (0..POINTS.0 * POINTS.1)
            .map(|k| {
                let part =
                    |index: usize, of: usize, size: usize| (index as f64 + 0.5) / of as f64 * size as f64;
                let (u, v) = (part(k % POINTS.0, POINTS.0, width), part(k / POINTS.0, POINTS.1, height));
                fits.iter().map(|fit| fit.pixels().at(u, v)).collect()
            })
            .collect();
        c_rms(&targets).ok_or(SpatialError::NothingToCompare { calibrations })
    }
}
