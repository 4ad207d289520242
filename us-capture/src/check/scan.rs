//! From the images of a short scan to the check: dots, labels where the stored calibration predicts them, the answer.

use probepath_frames::{Image, Pose, Probe, Span};

use super::{Check, CheckError, CheckOptions, Scan, around, assumed_m_s, rows, same_phantom, too_little};
use crate::Calibration;
use crate::fit::{Lag, PhantomPlace, Sighting, speed_of_sound_in_water};
use crate::phantom::WirePhantom;
use crate::shots::Shots;
use crate::spatial::{Doing, Seen, Spatial, SpatialError, SpatialOptions, predicted, sightings};

/// Wires are looked for so far from where the stored calibration predicts them (m).
const NEAR_M: f64 = 3e-3;
/// A picture's sides may differ from the setting's by this (pixels, part): files round lengths.
const SAME_SIDE: (f64, f64) = (2.0, 0.01);

/// Compares a stored calibration with the images of a short scan of its phantom.
///
/// Wires are looked for where the stored calibration predicts them; when images are left out, the scan is calibrated
/// from nothing, so that a holder that slipped by centimetres is found out too. Images without stamps tell no lag.
///
/// # Errors
/// As [`check`](super::check), and when the images are of another size than the calibration's, or their labels show
/// something else than this phantom (mirrored images, a sequence that does not agree). Too few images with wires are no
/// error: the verdict says so.
pub fn check_shots(
    shots: &Shots,
    calibration: &Calibration,
    phantom: &WirePhantom,
    place: PhantomPlace,
    options: &CheckOptions,
    watch: &(dyn Fn(Doing) + Sync),
) -> Result<Check, CheckError> {
    options.check()?;
    same_phantom(calibration, phantom)?;
    same_size(calibration, shots.size())?;
    let looking = Looking { shots, calibration, phantom, place, options, watch };
    let images = shots.shots().len();
    let seen = match looking.labels() {
        Err(why) if is_too_little(&why) => {
            return Ok(Check { labelled: 0, ..Check::nothing(&why.to_string(), images) });
        }
        seen => seen?,
    };
    let sightings = sightings(shots, &seen);
    let check = looking.scan(&sightings).concluded((shots.size(), images), options)?;
    let refused = seen.iter().filter_map(|s| s.labels.as_ref().err().map(|why| (s.number, why.clone())));
    Ok(Check { labelled: labelled(&seen), refused: refused.collect(), ..check })
}

/// The pictures have to be those the calibration belongs to.
fn same_size(calibration: &Calibration, (width, height): (usize, usize)) -> Result<(), CheckError> {
    let setting = &calibration.setting;
    let columns = setting.window_width_m / setting.spacing.x_m;
    let rows = setting.window_height_m / setting.spacing.y_m;
    let same = |ours: f64, theirs: usize| (ours - theirs as f64).abs() <= SAME_SIDE.0.max(SAME_SIDE.1 * ours);
    if same(columns, width) && same(rows, height) {
        return Ok(());
    }
    Err(CheckError::OtherSize { columns, rows, width, height })
}

/// Whether more or other images would do.
const fn is_too_little(why: &SpatialError) -> bool {
    match why {
        SpatialError::TooFewImages { .. } | SpatialError::StoodStill { .. } => true,
        SpatialError::Fit(why) => too_little(why),
        _ => false,
    }
}

struct Looking<'a> {
    shots: &'a Shots,
    calibration: &'a Calibration,
    phantom: &'a WirePhantom,
    place: PhantomPlace,
    options: &'a CheckOptions,
    watch: &'a (dyn Fn(Doing) + Sync),
}

impl Looking<'_> {
    /// The labels: where the stored calibration predicts them, once more where their own fit does; from nothing when
    /// that leaves images out.
    fn labels(&self) -> Result<Vec<Seen>, SpatialError> {
        let (pose, lag) = (self.calibration.probe_from_image, self.calibration.image_lag);
        let mut seen = self.predicted(pose, lag)?;
        // A place of the phantom that the calibration had corrected predicts badly too.
        if 20 * labelled(&seen) < 19 * seen.len() {
            let anew = Spatial::calibrate(self.shots, self.phantom, &self.options_for(None), self.watch);
            match anew {
                Ok(anew) if labelled(&anew.seen) > labelled(&seen) => return Ok(anew.seen),
                Err(why) if labelled(&seen) == 0 => return Err(why),
                _ => {}
            }
        }
        if let Ok(fit) = self.scan(&sightings(self.shots, &seen)).fit(self.options) {
            let again = self.predicted(fit.probe_from_image, fit.lag)?;
            if labelled(&again) > labelled(&seen) {
                seen = again;
            }
        }
        Ok(seen)
    }

    fn predicted(&self, pose: Pose<Probe, Image>, lag: Span) -> Result<Vec<Seen>, SpatialError> {
        let lag = Lag::Known(if self.shots.stamped { lag } else { Span::ZERO });
        let options = SpatialOptions { lag, ..self.options_for(Some(pose)) };
        predicted(self.shots, self.phantom, &options, self.watch)
    }

    fn options_for(&self, nominal: Option<Pose<Probe, Image>>) -> SpatialOptions {
        let mut spacing = self.calibration.setting.spacing;
        if let (Some(celsius), Some(_)) = (self.options.water_celsius, nominal) {
            spacing.y_m *= speed_of_sound_in_water(celsius) / assumed_m_s(self.calibration);
        }
        SpatialOptions {
            mask: self.options.mask.clone(),
            spacing: Some(spacing),
            scale: rows(self.calibration, self.options.water_celsius),
            lag: around(self.calibration, self.options),
            nominal,
            gate_m: NEAR_M,
            ..SpatialOptions::new(self.place)
        }
    }

    /// The labelled dots, the lag free where the images have stamps.
    fn scan<'s>(&'s self, sightings: &'s [Sighting]) -> Scan<'s> {
        let lag = match self.shots.stamped {
            true => around(self.calibration, self.options),
            false => Lag::Known(Span::ZERO),
        };
        let (calibration, phantom, place) = (self.calibration, self.phantom, self.place);
        Scan { calibration, phantom, sightings, track: self.shots.track(), place, lag }
    }
}

fn labelled(seen: &[Seen]) -> usize {
    seen.iter().filter(|s| s.labels.is_ok()).count()
}
