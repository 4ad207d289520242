//! The spatial calibration from images to an answer: dots, labels, fit, and again with what the fit predicts.
//!
//! ```no_run
//! use probepath_us_capture::fit::PhantomPlace;
//! use probepath_us_capture::phantom::WirePhantom;
//! use probepath_us_capture::plus::PlusConfig;
//! use probepath_us_capture::sequence::{ChainNames, ReadOptions, Sequence};
//! use probepath_us_capture::shots::Shots;
//! use probepath_us_capture::spatial::{Spatial, SpatialOptions};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let config = PlusConfig::read("PlusDeviceSet_fCal.xml".as_ref())?;
//! let phantom = config.phantom.clone().ok_or("no phantom")?;
//! let place = PhantomPlace::prior(config.world_from_phantom()?.ok_or("no place")?);
//! let sequence = Sequence::read("calibration.igs.mha".as_ref(), &ReadOptions::default())?;
//! let shots = Shots::from_sequence(&sequence, &ChainNames::default())?;
//! let spatial = Spatial::calibrate(&shots, &phantom, &SpatialOptions::new(place), &|_| {})?;
//! println!("{:?}, lag {:.3} s", spatial.fit.probe_from_image, spatial.fit.lag.seconds());
//! # Ok(()) }
//! ```
//!
//! Labels need a prediction to be sure, a prediction needs a calibration, a calibration needs labels. So: every
//! image's own candidates first; the choice on which a sequence agrees; a fit; then labels once more where the fit
//! predicts them, and the fit again, until they stay the same. [`Spatial`] holds the answer and what was seen of every
//! image; [`Spatial::evaluate`] asks about images it has not used, which is the only error worth believing.
//!
//! What it does not do: read files, or know what phantom stands there.

mod error;
mod first;
mod judge;
mod look;
mod options;
mod relabel;
mod repeat;

use crate::dots::Dot;
use crate::fit::{Fit, PhantomPlace, Sighting, fit};
use crate::label::{Labeller, Labels};
use crate::phantom::WirePhantom;
use crate::shots::Shots;

pub use error::{Reason, SpatialError};
pub use judge::Evaluation;
pub use options::{Doing, SpatialOptions};

/// Labels settle in two or three rounds; more says that they never will.
const MOST_ROUNDS: usize = 6;

/// What was seen of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// The image's number in its recording.
    pub number: u64,
    /// Every dot that was found.
    pub dots: Vec<Dot>,
    /// The wires that made them, or why the image is not used.
    pub labels: Result<Labels, Reason>,
}

/// A spatial calibration, and how it came about.
#[derive(Clone, Debug)]
pub struct Spatial {
    /// The answer.
    pub fit: Fit,
    /// What was seen of every image, in the recording's order.
    pub seen: Vec<Seen>,
    /// The same images judged by the fit they made: how well it fits, not how good it is.
    pub evaluation: Evaluation,
    /// What was assumed, or found out on the way, in words.
    pub notes: Vec<String>,
    phantom: WirePhantom,
    options: SpatialOptions,
}

impl Spatial {
    /// Calibrates from images of a phantom.
    ///
    /// # Errors
    /// When an option is no use, no image shows the phantom (with every reason, counted), the sequence does not agree
    /// on one place for the image, or the fit says that something is undetermined.
    pub fn calibrate(
        shots: &Shots,
        phantom: &WirePhantom,
        options: &SpatialOptions,
        watch: &(dyn Fn(Doing) + Sync),
    ) -> Result<Self, SpatialError> {
        let notes = options.notes(shots);
        let dots = look::dots(shots, options, options.spacing, watch)?;
        let labeller = Labeller::new(phantom, options.label);
        let (mut fit, spacing) = first::fit(shots, &dots, &labeller, phantom, options)?;
        let options = &SpatialOptions { spacing: Some(spacing), ..options.clone() };
        let mut seen = Vec::new();
        for round in 1..=MOST_ROUNDS {
            watch(Doing::Fitting { round });
            let again = relabel::all(shots, &dots, &labeller, &(&fit).into(), options.gate_m);
            let settled = relabel::same(&seen, &again);
            seen = again;
            if settled {
                break;
            }
            fit = refit(shots, &sightings(shots, &seen), phantom, options, &fit)?;
        }
        let evaluation = Evaluation::of(shots, &seen, phantom, &fit);
        Ok(Self { fit, seen, evaluation, notes, phantom: phantom.clone(), options: options.clone() })
    }

    /// How good it is: the errors on images it has not used.
    ///
    /// # Errors
    /// When the images are of another size than a mask or the dots' finder can be for.
    pub fn evaluate(&self, shots: &Shots, watch: &(dyn Fn(Doing) + Sync)) -> Result<Held, SpatialError> {
        let dots = look::dots(shots, &self.options, Some(self.fit.spacing), watch)?;
        let labeller = Labeller::new(&self.phantom, self.options.label);
        let seen = relabel::all(shots, &dots, &labeller, &(&self.fit).into(), self.options.gate_m);
        let evaluation = Evaluation::of(shots, &seen, &self.phantom, &self.fit);
        Ok(Held { seen, evaluation })
    }

    /// The phantom it was made on.
    pub const fn phantom(&self) -> &WirePhantom {
        &self.phantom
    }
}

/// Images that a calibration has not used, judged by it.
#[derive(Clone, Debug)]
pub struct Held {
    /// What was seen of every image, in the recording's order.
    pub seen: Vec<Seen>,
    /// Their errors.
    pub evaluation: Evaluation,
}

/// What is seen of every image where the nominal calibration predicts its wires, nothing fitted.
pub(crate) fn predicted(
    shots: &Shots,
    phantom: &WirePhantom,
    options: &SpatialOptions,
    watch: &(dyn Fn(Doing) + Sync),
) -> Result<Vec<Seen>, SpatialError> {
    let dots = look::dots(shots, options, options.spacing, watch)?;
    let labeller = Labeller::new(phantom, options.label);
    let nominal = first::nominal(options).ok_or(SpatialError::NoAgreement(crate::label::Refusal::NoDots))?;
    Ok(relabel::all(shots, &dots, &labeller, &nominal, options.gate_m))
}

/// The fit once more, from where the last one ended.
fn refit(
    shots: &Shots,
    sightings: &[Sighting],
    phantom: &WirePhantom,
    options: &SpatialOptions,
    last: &Fit,
) -> Result<Fit, SpatialError> {
    let place = options.place.unwrap_or(PhantomPlace::Free { start: last.world_from_phantom });
    let spacing = options.spacing.unwrap_or(last.spacing);
    let options = options.fit(shots, spacing, place, Some(last));
    Ok(fit(phantom, sightings, shots.track(), &options, Some(last.probe_from_image))?)
}

/// What the labels say to the fit; dots that an edge cuts help to label and are not measured with.
pub(crate) fn sightings(shots: &Shots, seen: &[Seen]) -> Vec<Sighting> {
    let labelled = shots.shots().iter().zip(seen).enumerate();
    let one = |(image, (shot, seen)): (usize, (&crate::shots::Shot, &Seen))| {
        let labels = seen.labels.as_ref().ok()?;
        Some(Sighting { image, stamp: shot.stamp, dots: relabel::measured(labels) })
    };
    labelled.filter_map(one).filter(|s| !s.dots.is_empty()).collect()
}
