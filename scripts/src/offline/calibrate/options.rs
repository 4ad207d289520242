//! From what was typed to what a calibration is told.

use probepath_frames::{Phantom, Pose, Span, World};
use probepath_us_capture::dots::Mask;
use probepath_us_capture::fit::{Lag, PhantomPlace, Scale as Scales};
use probepath_us_capture::label::Expect;
use probepath_us_capture::spatial::SpatialOptions;

use super::CalibrateError;
use super::request::{SpatialRequest, SubjectRequest};
use super::subject::{Recording, Subject};
use super::wishes::{Place, Region, Scale};

/// What scanners take for the speed of sound (m/s).
pub(super) const ASSUMED_M_S: f64 = 1540.0;
/// How well somebody with a thermometer knows the temperature of a tank (Celsius).
const SD_CELSIUS: f64 = 1.0;

/// What the calibration is told.
///
/// # Errors
/// When something has to be known and is not given, or what is given is no use.
pub(super) fn of(
    request: &SpatialRequest,
    subject: &Subject,
    recording: &Recording,
) -> Result<SpatialOptions, CalibrateError> {
    let place = place(request.place, subject.place(request.phantom_to_reference.as_ref())?)?;
    let mut options = SpatialOptions::new(place);
    options.spacing = request.pixel_mm.map(|pixel| pixel.spacing()).or(subject.spacing);
    options.scale = scale(request, options.spacing.is_some())?;
    options.expect = if request.any_side { Expect::Anything } else { subject.expect };
    options.mask = mask(recording.region, &request.subject)?;
    if let Some(lag_s) = request.lag_s {
        options.lag = Lag::Known(Span::from_seconds(lag_s));
    }
    Ok(options)
}

/// The part of the images that is looked at.
///
/// # Errors
/// When it holds nothing.
pub(super) fn mask(region: Option<Region>, request: &SubjectRequest) -> Result<Mask, CalibrateError> {
    let mut mask = Mask::whole();
    if let Some(Region { origin: [x, y], size: [width, height] }) = region {
        mask = mask.and(Mask::rectangle(x as f64, y as f64, width as f64, height as f64)?);
    }
    if let Some(fan) = request.fan {
        mask = mask.and(Mask::fan(fan.apex_px, fan.radii_px, fan.angles_deg)?);
    }
    Ok(mask)
}

fn place(
    wish: Option<Place>,
    given: Option<Pose<World, Phantom>>,
) -> Result<Option<PhantomPlace>, CalibrateError> {
    match (wish, given) {
        (Some(Place::Unknown) | None, None) | (Some(Place::Unknown), Some(_)) => Ok(None),
        (Some(Place::Prior) | None, Some(pose)) => Ok(Some(PhantomPlace::prior(pose))),
        (Some(Place::Fixed), Some(pose)) => Ok(Some(PhantomPlace::Known(pose))),
        (Some(Place::Prior), None) => Err(CalibrateError::NoPlace { wish: "prior" }),
        (Some(Place::Fixed), None) => Err(CalibrateError::NoPlace { wish: "fixed" }),
    }
}

fn scale(request: &SpatialRequest, known: bool) -> Result<Scales, CalibrateError> {
    match request.scale {
        None | Some(Scale::Estimated) => Ok(Scales::Estimated),
        Some(Scale::Known) if known => Ok(Scales::Known),
        Some(Scale::Water) if known => Ok(Scales::SpeedOfSound {
            water_celsius: request.water_celsius,
            sd_celsius: SD_CELSIUS,
            assumed_m_s: ASSUMED_M_S,
        }),
        Some(Scale::Known) => Err(CalibrateError::NoSpacing { wish: "known" }),
        Some(Scale::Water) => Err(CalibrateError::NoSpacing { wish: "water" }),
    }
}
