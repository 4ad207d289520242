//! From the images of a short scan to the check: dots, labels where the stored calibration predicts them, the answer.

use probepath_frames::{Image, Pose, Probe, Span};

use super::{Check, CheckError, CheckOptions, Scan, around, concluded, rows, same_phantom, too_little};
use crate::Calibration;
use crate::fit::{Fit, Lag, PhantomPlace};
use crate::phantom::WirePhantom;
use crate::shots::Shots;
use crate::spatial::{Doing, Spatial, SpatialError, SpatialOptions, sightings};

/// Labels made with a lag that is off by more than this are made again.
const LAG_MATTERS_S: f64 = 0.02;
/// A picture's sides may differ from the setting's by this (pixels, part): files round lengths.
const SAME_SIDE: (f64, f64) = (2.0, 0.01);

/// Compares a stored calibration with the images of a short scan of its phantom.
///
/// Wires are looked for where the stored calibration predicts them; when it predicts too few, the scan is calibrated
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
    let spatial = match looking.labels() {
        Err(why) if is_too_little(&why) => {
            return Ok(Check { labelled: 0, ..Check::nothing(&why.to_string(), images) });
        }
        spatial => spatial?,
    };
    let fitted = looking.fit(&spatial);
    let check = concluded(calibration, fitted, (shots.size(), images), options)?;
    let evaluation = &spatial.evaluation;
    Ok(Check { labelled: evaluation.labelled, refused: evaluation.refused.clone(), ..check })
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
    /// The labels: predicted, once more when the lag is another than predicted, from nothing when that fails.
    fn labels(&self) -> Result<Spatial, SpatialError> {
        let nominal = Some(self.calibration.probe_from_image);
        let predicted = match self.calibrate(nominal, Lag::Known(self.calibration.image_lag)) {
            Err(SpatialError::StoodStill { images, moved_mm, turned_deg }) => {
                return Err(SpatialError::StoodStill { images, moved_mm, turned_deg });
            }
            Err(why) => {
                // What the stored calibration lacks is the better word when nothing helps.
                return self.calibrate(None, around(self.calibration, self.options)).map_err(|_| why);
            }
            Ok(predicted) => predicted,
        };
        match self.fit(&predicted) {
            Ok(fit) if late(self.calibration, &fit) => {
                Ok(self.calibrate(Some(fit.probe_from_image), Lag::Known(fit.lag)).unwrap_or(predicted))
            }
            _ => Ok(predicted),
        }
    }

    fn calibrate(&self, nominal: Option<Pose<Probe, Image>>, lag: Lag) -> Result<Spatial, SpatialError> {
        let options = SpatialOptions {
            mask: self.options.mask.clone(),
            spacing: Some(self.calibration.setting.spacing),
            scale: rows(self.calibration, self.options.water_celsius),
            lag,
            nominal,
            ..SpatialOptions::new(self.place)
        };
        Spatial::calibrate(self.shots, self.phantom, &options, self.watch)
    }

    /// What these labels say, the lag free where the images have stamps.
    fn fit(&self, spatial: &Spatial) -> Result<Fit, CheckError> {
        let lag = match self.shots.stamped {
            true => around(self.calibration, self.options),
            false => Lag::Known(Span::ZERO),
        };
        let (calibration, phantom, place) = (self.calibration, self.phantom, self.place);
        let (sightings, track) = (&sightings(self.shots, &spatial.seen), self.shots.track());
        Scan { calibration, phantom, sightings, track, place, lag }.fit(self.options)
    }
}

fn late(calibration: &Calibration, fit: &Fit) -> bool {
    (fit.lag.seconds() - calibration.image_lag.seconds()).abs() > LAG_MATTERS_S
}
