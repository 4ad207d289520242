//! The first calibration: from what is nominal, or from what the images' own candidates agree on.

use probepath_frames::Span;

use super::error::Refused;
use super::look::Looked;
use super::options::Prediction;
use super::{Reason, Seen, SpatialError, SpatialOptions, relabel, sightings};
use crate::PixelSpacing;
use crate::fit::{Fit, FitOptions, Lag, PhantomPlace, Sighting, fit as fit_all};
use crate::label::{AgreeOptions, Candidates, Expect, Labeller, agree, find_spacing};
use crate::phantom::WirePhantom;
use crate::shots::{Shot, Shots};

/// Fewer images say too little of a lag and of outliers.
const LEAST_IMAGES: usize = 5;
/// A probe that moved and turned less than this stood still (m, rad).
const STILL: (f64, f64) = (0.5e-3, 0.25 * std::f64::consts::PI / 180.0);
/// Images that are asked for every choice of wires that they allow; the others are labelled where these predict.
const ELECTORS: usize = 60;

/// A first fit, and the size of a pixel that it started from.
pub(super) fn fit(
    shots: &Shots,
    looked: &[Looked],
    labeller: &Labeller,
    phantom: &WirePhantom,
    options: &SpatialOptions,
) -> Result<(Fit, PixelSpacing), SpatialError> {
    moving(shots)?;
    let start = match nominal(options) {
        Some(start) => start,
        None => agreed(shots, looked, labeller, phantom, options)?,
    };
    let seen = relabel::all(shots, looked, labeller, &start, options.nominal_off_m);
    enough(&seen, phantom)?;
    let place = options.place.unwrap_or(PhantomPlace::Free { start: start.world_from_phantom });
    let fit_options = options.fit(shots, start.spacing, place, None);
    let found = from_start(shots, &sightings(shots, &seen), phantom, &fit_options, &start)?;
    Ok((found, start.spacing))
}

/// Zs give a start of their own, lag and all, which is nearer than what single images agree on.
fn from_start(
    shots: &Shots,
    sightings: &[Sighting],
    phantom: &WirePhantom,
    options: &FitOptions,
    start: &Prediction,
) -> Result<Fit, SpatialError> {
    let own = fit_all(phantom, sightings, shots.track(), options, None);
    own.or_else(|_| fit_all(phantom, sightings, shots.track(), options, Some(start.probe_from_image)))
        .map_err(Into::into)
}

/// Where the image is by what is nominal, when all of it is.
pub(super) fn nominal(options: &SpatialOptions) -> Option<Prediction> {
    Some(Prediction {
        probe_from_image: options.nominal?,
        world_from_phantom: options.place?.pose(),
        spacing: options.spacing?,
        lag: options.start_lag(),
    })
}

/// Where the image is by what the images agree on.
fn agreed(
    shots: &Shots,
    looked: &[Looked],
    labeller: &Labeller,
    phantom: &WirePhantom,
    options: &SpatialOptions,
) -> Result<Prediction, SpatialError> {
    let spacing = match options.spacing {
        Some(spacing) => spacing,
        None => {
            let dots: Vec<_> = looked.iter().filter_map(|looked| looked.as_ref().ok().cloned()).collect();
            find_spacing(phantom, &dots, options.label).map_err(SpatialError::NoAgreement)?
        }
    };
    let candidates = candidates(shots, looked, labeller, spacing, phantom)?;
    let agreement = agree(phantom, &candidates, shots.track(), &agree_options(shots, options))
        .map_err(SpatialError::NoAgreement)?;
    Ok(Prediction {
        probe_from_image: agreement.probe_from_image,
        world_from_phantom: agreement.world_from_phantom,
        spacing,
        lag: agreement.lag,
    })
}

fn agree_options(shots: &Shots, options: &SpatialOptions) -> AgreeOptions {
    let widest = match options.lag {
        _ if !shots.stamped => 0,
        Lag::Known(lag) => lag.nanoseconds().abs(),
        Lag::Estimated { from, to } => from.nanoseconds().abs().max(to.nanoseconds().abs()),
    };
    let usual = AgreeOptions::default();
    AgreeOptions {
        world_from_phantom: options.place.map(|place| place.pose()),
        expect: options.nominal.map_or(options.expect, Expect::About),
        widest_lag: Span::from_nanoseconds(widest),
        ..usual
    }
}

/// Every choice of wires of some images, spread over the recording.
fn candidates(
    shots: &Shots,
    looked: &[Looked],
    labeller: &Labeller,
    spacing: PixelSpacing,
    phantom: &WirePhantom,
) -> Result<Vec<Candidates>, SpatialError> {
    let every = looked.len().div_ceil(ELECTORS).max(1);
    let mut reasons: Vec<Reason> = Vec::new();
    let mut one = |(shot, looked): (&Shot, &Looked)| {
        let dots = looked.as_ref().map_err(Clone::clone);
        let labels = dots.and_then(|dots| labeller.candidates(dots, spacing).map_err(Reason::from));
        let labels = labels.map_err(|reason| reasons.push(reason)).unwrap_or_default();
        Candidates { stamp: shot.stamp, labels }
    };
    let all: Vec<Candidates> = shots.shots().iter().zip(looked).step_by(every).map(&mut one).collect();
    let labelled = all.iter().filter(|c| !c.labels.is_empty()).count();
    if labelled < LEAST_IMAGES.min(all.len()) || all.len() < LEAST_IMAGES {
        return Err(too_few(labelled, all.len(), phantom, &reasons));
    }
    Ok(all)
}

fn moving(shots: &Shots) -> Result<(), SpatialError> {
    let samples = shots.track().samples();
    let Some((_, first)) = samples.first() else { return Ok(()) };
    let off = samples.iter().map(|(_, pose)| first.distance(pose));
    let (moved, turned) = off.fold((0.0_f64, 0.0_f64), |most, one| (most.0.max(one.0), most.1.max(one.1)));
    if moved < STILL.0 && turned < STILL.1 {
        let (moved_mm, turned_deg) = (moved * 1e3, turned.to_degrees());
        return Err(SpatialError::StoodStill { images: shots.shots().len(), moved_mm, turned_deg });
    }
    Ok(())
}

fn enough(seen: &[Seen], phantom: &WirePhantom) -> Result<(), SpatialError> {
    let labelled = seen.iter().filter(|s| s.labels.is_ok()).count();
    if labelled >= LEAST_IMAGES {
        return Ok(());
    }
    let reasons: Vec<Reason> = seen.iter().filter_map(|s| s.labels.as_ref().err().cloned()).collect();
    Err(too_few(labelled, seen.len(), phantom, &reasons))
}

fn too_few(labelled: usize, images: usize, phantom: &WirePhantom, reasons: &[Reason]) -> SpatialError {
    let (phantom, refused) = (phantom.name.clone(), Refused::count(reasons));
    SpatialError::TooFewImages { labelled, images, needed: LEAST_IMAGES, phantom, refused }
}
