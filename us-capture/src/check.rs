//! Whether a stored calibration still holds, from a short scan of its phantom: pass or fail, and by how much.
//!
//! ```no_run
//! use probepath_us_capture::Calibration;
//! use probepath_us_capture::check::{CheckOptions, Verdict, check_shots};
//! # use probepath_us_capture::{fit::PhantomPlace, phantom::WirePhantom, shots::Shots};
//! # fn run(shots: &Shots, phantom: &WirePhantom, place: PhantomPlace) -> Result<(), Box<dyn std::error::Error>> {
//! let calibration = Calibration::read("calibration.toml".as_ref())?;
//! let options = CheckOptions { water_celsius: Some(22.5), ..CheckOptions::default() };
//! let found = check_shots(shots, &calibration, phantom, place, &options, &|_| {})?;
//! println!("{}", found.words);
//! assert_eq!(found.verdict, Verdict::Holds);
//! # Ok(()) }
//! ```
//!
//! The short scan is fitted by itself and compared with the stored calibration over the whole image: a [`Change`] says
//! how far every pixel's point has moved in the probe, and a chi square test on the six numbers of the pose whether
//! that is more than the errors of both allow. A [`Check`] has its [`Verdict`]: what passes is not off by twice the
//! tolerance, what fails is off by more than the tolerance and more than chance, and a scan that can say neither says
//! what it lacks.
//!
//! A calibration for tissue takes sound to run at 1540 m/s; in water it is slower, so that the rows of the phantom's
//! images are smaller, and the first row is less deep under the face. The scan's answer is brought to tissue before it
//! is compared.
//!
//! Errors that a whole recording shares are in no covariance, and a probe that hardly turned lets them grow: of PLUS's
//! fCal 1.2 (freehand, 2 degrees) the validation recording, fitted by itself, differs from the calibration by 4.6 ± 0.6
//! mm at the worst pixel, though the calibration explains its dots to 0.25 mm. So what moved has to misfit too: a
//! [`Misfit`] has the errors of the scan's dots by the stored calibration beside those of the scan's own fit. When they
//! are no worse by the tolerance and the probe did not turn by 15 degrees about two axes, the calibration holds where the phantom was seen, and [`Check::seen_only`] says that
//! this is all that the scan can tell.
//!
//! What it does not do: correct a calibration; one that moved is made again.

mod change;
mod misfit;
mod report;
mod scan;
mod words;

use probepath_frames::{Probe, Span, Track, World};
use thiserror::Error;

use crate::Calibration;
use crate::dots::Mask;
use crate::fit::{
    Fit, FitError, FitOptions, Lag, PhantomPlace, Scale, Sighting, fit, speed_of_sound_in_water,
};
use crate::phantom::WirePhantom;
use crate::spatial::{Reason, SpatialError};
pub use change::Change;
pub use misfit::Misfit;
pub use report::{ChangeReport, CheckReport, MisfitReport};
pub use scan::check_shots;

/// What scanners take for the speed of sound (m/s), where a calibration does not say.
const ASSUMED_M_S: f64 = 1540.0;
/// How well a thermometer in the bath is read (Celsius).
const THERMOMETER_SD: f64 = 0.5;
/// Where the search for the rows' size starts when nobody measured the water (Celsius).
const SOME_WATER: f64 = 22.0;
/// Rows that differ by more than this part, beyond their error, are of another medium or another setting.
const SAME_ROWS: f64 = 0.01;

/// What still counts as holding, and what is known of the scan.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckOptions {
    /// The worst pixel's point may have moved so far (m).
    pub tolerance_m: f64,
    /// The lag may have changed by so much.
    pub lag_tolerance: Span,
    /// The chance with which a calibration that did not move may look as if it had.
    pub false_alarm: f64,
    /// The lag is looked for so far around the stored one.
    pub lag_reach: Span,
    /// Temperature of the water the phantom stands in (Celsius), for a calibration that is meant for tissue. `None`:
    /// the size of the rows is found from the dots, which takes more images.
    pub water_celsius: Option<f64>,
    /// The part of the images that is looked at.
    pub mask: Mask,
}

impl Default for CheckOptions {
    /// 0.5 mm, 10 ms, a chance of 0.27 % (three standard errors), 500 ms, the whole image.
    fn default() -> Self {
        Self {
            tolerance_m: 0.5e-3,
            lag_tolerance: Span::from_milliseconds(10),
            false_alarm: 0.0027,
            lag_reach: Span::from_milliseconds(500),
            water_celsius: None,
            mask: Mask::whole(),
        }
    }
}

/// What a check says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It holds.
    Holds,
    /// It does not: calibrate again.
    Moved,
    /// The scan was too short, or too uniform, to tell twice the tolerance from nothing.
    CannotTell,
}

/// A check's answer.
#[derive(Clone, Debug)]
pub struct Check {
    /// Whether the calibration holds.
    pub verdict: Verdict,
    /// It holds where the phantom was seen: the scan's own fit says otherwise, but not by what its dots show.
    pub seen_only: bool,
    /// What moved, or what is missing, in words, and what to do.
    pub words: String,
    /// Images of the scan.
    pub images: usize,
    /// Images whose dots were given wires.
    pub labelled: usize,
    /// Why the others were not, by their number.
    pub refused: Vec<(u64, Reason)>,
    /// How far the image is from where it was calibrated; `None` when the scan says nothing of it.
    pub change: Option<Change>,
    /// How the stored calibration explains the dots; `None` when they could not be fitted.
    pub misfit: Option<Misfit>,
    /// The scan's own fit, in the medium the phantom stood in.
    pub fit: Option<Fit>,
}

/// A check that could not be made.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum CheckError {
    /// Another phantom.
    #[error("the calibration was made on phantom {stored:?}, this is {given:?}: check on the same phantom")]
    OtherPhantom {
        /// The calibration's.
        stored: String,
        /// The one given.
        given: String,
    },
    /// Images of another size.
    #[error(
        "the calibration belongs to images of {columns:.0} x {rows:.0} pixels, the scan has {width} x {height}: \
         set the machine as it was calibrated"
    )]
    OtherSize {
        /// Columns of the calibration.
        columns: f64,
        /// Its rows.
        rows: f64,
        /// Columns of the scan.
        width: usize,
        /// Its rows.
        height: usize,
    },
    /// Rows of another size than the water explains.
    #[error(
        "the rows of these images are {found:.4} +- {error:.4} times as high as the calibration's; {because}: \
         is the machine set to the same depth, and the water's temperature right?"
    )]
    OtherRows {
        /// What the dots say.
        found: f64,
        /// Its standard error.
        error: f64,
        /// What was expected, and why.
        because: String,
    },
    /// An option that makes no sense.
    #[error("option {field} is {found}; it has to be {wanted}")]
    Option {
        /// The option.
        field: &'static str,
        /// What it is.
        found: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// The images do not give labels.
    #[error(transparent)]
    Images(#[from] SpatialError),
    /// The scan does not determine the image's place.
    #[error("the check's own fit: {0}")]
    Fit(#[from] FitError),
    /// The covariances of both do not make one.
    #[error("stored and found covariance add up to none: the stored one is damaged")]
    Covariance,
}

/// Compares a stored calibration with what labelled dots of a short scan of its phantom say.
///
/// `size` is the image's columns and rows; `place` says where the phantom stands, or that it is not known. A
/// calibration without a stored covariance counts as exact, so that everything above the tolerance is its fault.
/// Dots that determine too little are no error: the verdict is [`Verdict::CannotTell`], with what to do.
///
/// # Errors
/// When the phantom is another one, an option makes no sense, the rows are of another size than the water explains, or
/// the scan cannot be fitted.
pub fn check(
    calibration: &Calibration,
    phantom: &WirePhantom,
    sightings: &[Sighting],
    track: &Track<World, Probe>,
    (size, place): ((usize, usize), PhantomPlace),
    options: &CheckOptions,
) -> Result<Check, CheckError> {
    options.check()?;
    same_phantom(calibration, phantom)?;
    let lag = around(calibration, options);
    Scan { calibration, phantom, sightings, track, place, lag }.concluded((size, sightings.len()), options)
}

/// Whether more or other images would do.
const fn too_little(why: &FitError) -> bool {
    matches!(
        why,
        FitError::TooFew { .. }
            | FitError::Undetermined { .. }
            | FitError::OutsideTrack { .. }
            | FitError::NoStart { .. }
    )
}

impl Check {
    /// Nothing could be fitted.
    fn nothing(why: &str, images: usize) -> Self {
        let words = format!("this scan cannot tell: {why}");
        let refused = Vec::new();
        Self {
            verdict: Verdict::CannotTell,
            seen_only: false,
            words,
            images,
            labelled: images,
            refused,
            change: None,
            misfit: None,
            fit: None,
        }
    }

    /// The answer in millimetres, degrees and milliseconds.
    pub fn report(&self) -> CheckReport {
        CheckReport::of(self)
    }
}

impl CheckOptions {
    fn check(&self) -> Result<(), CheckError> {
        let bad = |good: bool, field, found, wanted| {
            if good { Ok(()) } else { Err(CheckError::Option { field, found, wanted }) }
        };
        let length = self.tolerance_m;
        bad((1e-6..=0.1).contains(&length), "tolerance_m", length, "between 1 micrometre and 10 cm")?;
        let (lag, reach) = (self.lag_tolerance.seconds(), self.lag_reach.seconds());
        bad(lag > 0.0 && lag <= 10.0, "lag_tolerance_s", lag, "above zero and up to 10 s")?;
        bad(reach >= lag && reach <= 5.0, "lag_reach_s", reach, "at least lag_tolerance and up to 5 s")?;
        let chance = self.false_alarm;
        bad(chance > 0.0 && chance < 0.5, "false_alarm", chance, "between 0 and 0.5")?;
        let celsius = self.water_celsius.unwrap_or(SOME_WATER);
        bad((0.0..=95.0).contains(&celsius), "water_celsius", celsius, "between 0 and 95 degrees Celsius")
    }
}

fn same_phantom(calibration: &Calibration, phantom: &WirePhantom) -> Result<(), CheckError> {
    if calibration.phantom == phantom.name {
        return Ok(());
    }
    let (stored, given) = (calibration.phantom.clone(), phantom.name.clone());
    Err(CheckError::OtherPhantom { stored, given })
}

/// Lags around the stored one.
fn around(calibration: &Calibration, options: &CheckOptions) -> Lag {
    let by = |s: f64| Span::from_seconds(calibration.image_lag.seconds() + s);
    let reach = options.lag_reach.seconds();
    Lag::Estimated { from: by(-reach), to: by(reach) }
}

/// What the machine takes for the speed of sound.
fn assumed_m_s(calibration: &Calibration) -> f64 {
    let water = calibration.quality.as_ref().and_then(|q| q.water.as_ref());
    water.map_or(ASSUMED_M_S, |water| water.assumed_m_s)
}

/// The rows' size: by the water, or found from the dots.
fn rows(calibration: &Calibration, water_celsius: Option<f64>) -> Scale {
    Scale::SpeedOfSound {
        water_celsius: water_celsius.unwrap_or(SOME_WATER),
        sd_celsius: if water_celsius.is_some() { THERMOMETER_SD } else { f64::INFINITY },
        assumed_m_s: assumed_m_s(calibration),
    }
}

/// A scan with its labels.
struct Scan<'a> {
    calibration: &'a Calibration,
    phantom: &'a WirePhantom,
    sightings: &'a [Sighting],
    track: &'a Track<World, Probe>,
    place: PhantomPlace,
    lag: Lag,
}

impl Scan<'_> {
    /// The answer of the scan's own fit, or that there is none.
    fn concluded(
        &self,
        (size, images): ((usize, usize), usize),
        options: &CheckOptions,
    ) -> Result<Check, CheckError> {
        let fit = match self.fit(options) {
            Err(CheckError::Fit(why)) if too_little(&why) => {
                return Ok(Check::nothing(&why.to_string(), images));
            }
            fitted => fitted?,
        };
        let change = Change::of(self.calibration, &fit, size)?;
        let misfit = Misfit::of(self, &fit);
        let seen_only = change.verdict(options) == Verdict::Moved && misfit.is_explained(options);
        let verdict = if seen_only { Verdict::Holds } else { change.verdict(options) };
        let words = if seen_only {
            words::seen_only(&change, &misfit, options)
        } else {
            words::told(verdict, &change, options)
        };
        let (change, misfit, fit) = (Some(change), Some(misfit), Some(fit));
        let (labelled, refused) = (images, Vec::new());
        Ok(Check { verdict, seen_only, words, images, labelled, refused, change, misfit, fit })
    }

    /// The fit with what is known of the water, which the dots have to agree to.
    fn fit(&self, options: &CheckOptions) -> Result<Fit, CheckError> {
        let Some(celsius) = options.water_celsius else {
            let free = self.fit_rows(rows(self.calibration, None))?;
            self.same_rows(&free, (0.9, 1.02), || "water and tissue make them 0.9 to 1.02 times".into())?;
            return Ok(free);
        };
        // Dots too few to say how large the rows are do not contradict the thermometer.
        if let Ok(free) = self.fit_rows(rows(self.calibration, None)) {
            let by = speed_of_sound_in_water(celsius) / assumed_m_s(self.calibration);
            let because = || format!("water of {celsius} degrees makes them {by:.4} times");
            self.same_rows(&free, (by - SAME_ROWS, by + SAME_ROWS), because)?;
        }
        Ok(self.fit_rows(rows(self.calibration, Some(celsius)))?)
    }

    fn same_rows(
        &self,
        free: &Fit,
        (least, most): (f64, f64),
        because: impl Fn() -> String,
    ) -> Result<(), CheckError> {
        let found = free.spacing.y_m / self.calibration.setting.spacing.y_m;
        let variance = crate::Covariance::of(&free.uncertainty).about(&["row_scale"])[(0, 0)];
        let error = variance.max(0.0).sqrt();
        if found + 3.0 * error >= least && found - 3.0 * error <= most {
            return Ok(());
        }
        Err(CheckError::OtherRows { found, error, because: because() })
    }

    /// With the lag free; shots of a probe that stood still tell none, and the stored one stands then.
    fn fit_rows(&self, scale: Scale) -> Result<Fit, FitError> {
        let with = |lag: Lag| {
            let nominal = FitOptions::new(self.calibration.setting.spacing, self.place);
            let options = FitOptions { scale, lag, ..nominal };
            let start = Some(self.calibration.probe_from_image);
            fit(self.phantom, self.sightings, self.track, &options, start)
        };
        match with(self.lag) {
            Err(FitError::Undetermined { parameter: "lag", .. }) => {
                with(Lag::Known(self.calibration.image_lag))
            }
            found => found,
        }
    }
}
