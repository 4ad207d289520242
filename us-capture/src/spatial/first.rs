//! The first calibration: from what is nominal, or from what the images' own candidates agree on.

use super::error::Refused;
use super::look::Looked;
use super::options::Prediction;
use super::{Reason, Seen, SpatialError, SpatialOptions, relabel, sightings, vote};
use crate::fit::{Fit, PhantomPlace, fit as fit_all};
use crate::label::Labeller;
use crate::phantom::WirePhantom;
use crate::shots::Shots;

/// Fewer images say too little of a lag and of outliers.
const LEAST_IMAGES: usize = 5;
/// A probe that moved and turned less than this stood still (m, rad).
const STILL: (f64, f64) = (0.5e-3, 0.25 * std::f64::consts::PI / 180.0);

/// A first fit, with the labels it stands on.
pub(super) fn fit(
    shots: &Shots,
    looked: &[Looked],
    labeller: &Labeller,
    phantom: &WirePhantom,
    options: &SpatialOptions,
) -> Result<(Fit, Vec<Seen>), SpatialError> {
    moving(shots)?;
    let (seen, start) = match nominal(options) {
        Some(start) => (relabel::all(shots, looked, labeller, &start, options.nominal_off_m), start),
        None => vote::agree(shots, looked, labeller, options)?,
    };
    enough(&seen, phantom)?;
    let place = options.place.unwrap_or(PhantomPlace::Free { start: start.world_from_phantom });
    let fit_options = options.fit(shots, start.spacing, place, None);
    let found = fit_all(phantom, &sightings(shots, &seen), shots.track(), &fit_options, None)?;
    Ok((found, seen))
}

/// Where the image is by what is nominal, when all of it is.
fn nominal(options: &SpatialOptions) -> Option<Prediction> {
    Some(Prediction {
        probe_from_image: options.nominal?,
        world_from_phantom: options.place?.pose(),
        spacing: options.spacing?,
        lag: options.start_lag(),
    })
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

pub(super) fn enough(seen: &[Seen], phantom: &WirePhantom) -> Result<(), SpatialError> {
    let labelled = seen.iter().filter(|s| s.labels.is_ok()).count();
    if labelled >= LEAST_IMAGES {
        return Ok(());
    }
    let reasons: Vec<&Reason> = seen.iter().filter_map(|s| s.labels.as_ref().err()).collect();
    Err(SpatialError::TooFewImages {
        labelled,
        images: seen.len(),
        needed: LEAST_IMAGES,
        phantom: phantom.name.clone(),
        refused: Refused::count(reasons),
    })
}
