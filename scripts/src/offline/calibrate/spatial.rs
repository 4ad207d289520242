//! `probepath calibrate spatial`: from a sequence of a phantom to a calibration.

use std::path::Path;

use probepath_us_capture::RepeatabilityMm;
use probepath_us_capture::fit::{Fit, Parameter};
use probepath_us_capture::spatial::{Doing, Seen, Spatial as Found};

use super::document::{Covariance, OverImage, PlusMatrices, Section, Spatial};
use super::pictures::Album;
use super::request::SpatialRequest;
use super::subject::{Recording, Subject};
use super::{CalibrateError, alone, nominal, options, store};
use crate::progress::Progress;

/// As many as [P1] made of every setting.
const CALIBRATIONS: usize = 10;

/// Calibrates from a sequence, measures the calibration on another, and leaves what was asked for.
///
/// # Errors
/// When a file cannot be read or written, or the images give no calibration; each error says which, where, and what to
/// do.
pub fn spatial(request: &SpatialRequest, progress: &dyn Progress) -> Result<Spatial, CalibrateError> {
    progress.at("reading", 0.0);
    let subject = Subject::read(&request.subject)?;
    let recording = subject.record(&request.sequence, &request.subject)?;
    let other = request.validate.as_deref().map(|path| subject.record(path, &request.subject)).transpose()?;
    let options = options::of(request, &subject, &recording)?;
    let watch = watching(progress, "calibrating", 0.05, 0.7);
    let found = match Found::calibrate(&recording.shots, &subject.phantom, &options, &watch) {
        Ok(found) => found,
        Err(source) => {
            // Who gets no calibration needs the pictures most.
            if request.overlay.is_some() {
                let seen = alone::seen(&recording.shots, &subject.phantom, &options)?;
                pictures(request, &subject, &recording, "calibration", None, &seen)?;
            }
            let (path, phantom) = (request.sequence.clone(), subject.phantom.name.clone());
            return Err(CalibrateError::Spatial { path, phantom, source });
        }
    };
    let nominal = request.nominal.as_deref().map(nominal::read).transpose()?;
    if let Some(nominal) = nominal.or(subject.probe_from_image) {
        nominal::check(&nominal, &found.fit.probe_from_image)?;
    }
    let mut document = document(request, &subject, &recording, &found);
    match store::point_spread(request, &recording.shots, &found) {
        Some(Ok(read)) => document.point_spread = Some(read),
        Some(Err(why)) => document.notes.push(format!("the point spread was not read from the wires: {why}")),
        None => {}
    }
    let mut errors = (found.evaluation.found.clone(), false);
    if let (Some(other), Some(path)) = (&other, &request.validate) {
        let watch = watching(progress, "validating", 0.7, 0.9);
        let held = found.evaluate(&other.shots, &watch).map_err(|source| CalibrateError::Spatial {
            path: path.clone(),
            phantom: subject.phantom.name.clone(),
            source,
        })?;
        document.validation = Some(Section::of(path, &held.seen, &held.evaluation.found, request.dots));
        document.notes.extend(other.notes.iter().cloned());
        pictures(request, &subject, other, "validation", Some(&found.fit), &held.seen)?;
        errors = (held.evaluation.found, true);
    }
    progress.at("writing", 0.9);
    pictures(request, &subject, &recording, "calibration", Some(&found.fit), &found.seen)?;
    if let Some(path) = &request.out {
        let size = recording.shots.size();
        let (fit, spread) = (&found.fit, document.point_spread);
        store::write(path, request, size, (fit, spread), &subject.phantom.name, (&errors.0, errors.1))?;
        document.stored = Some(path.clone());
    }
    Ok(document)
}

/// What the calibration's own progress is to the listener.
pub(super) fn watching<'a>(
    progress: &'a dyn Progress,
    step: &'a str,
    from: f64,
    until: f64,
) -> impl Fn(Doing) + Sync + 'a {
    move |doing| {
        let part = match doing {
            Doing::Looking { done, of } => 0.7 * done as f64 / of.max(1) as f64,
            Doing::Fitting { round } => 0.7 + 0.3 * (1.0 - 1.0 / round.max(1) as f64),
        };
        progress.at(step, from + part * (until - from));
    }
}

fn document(request: &SpatialRequest, subject: &Subject, recording: &Recording, found: &Found) -> Spatial {
    let (fit, (width, height)) = (&found.fit, recording.shots.size());
    let error = fit.uncertainty.standard_error_map(width, height);
    let calibration = Section::of(&request.sequence, &found.seen, &found.evaluation.found, request.dots);
    let notes = [&subject.notes, &recording.notes, &found.notes];
    Spatial {
        plus: PlusMatrices::of(&fit.probe_from_image, fit.spacing, &fit.world_from_phantom),
        lag_s: fit.lag.seconds(),
        lag_standard_error_s: fit.uncertainty.standard_error_of(Parameter::LAG),
        standard_error_mm: OverImage { mean: error.mean_m() * 1e3, p95: error.p95_m() * 1e3 },
        // A recording that is too short to be dealt out ten times has no repeatability, and is still a calibration.
        repeatability: (found.repeatability(&recording.shots, CALIBRATIONS).ok())
            .map(|repeat| RepeatabilityMm::of(CALIBRATIONS, &repeat)),
        pixel_mm: [fit.spacing.x_m * 1e3, fit.spacing.y_m * 1e3],
        phantom: subject.phantom.name.clone(),
        poses: recording.poses.clone(),
        dots: calibration.dots.clone(),
        calibration,
        validation: None,
        point_spread: None,
        covariance: Covariance::of(&fit.uncertainty),
        weak: fit.weak.iter().map(ToString::to_string).collect(),
        notes: notes.into_iter().flatten().cloned().collect(),
        stored: None,
        overlay: request.overlay.clone(),
    }
}

fn pictures(
    request: &SpatialRequest,
    subject: &Subject,
    recording: &Recording,
    name: &str,
    fit: Option<&Fit>,
    seen: &[Seen],
) -> Result<(), CalibrateError> {
    let Some(folder) = request.overlay.as_deref().map(Path::new) else { return Ok(()) };
    let album = Album { phantom: &subject.phantom, fit, region: recording.region };
    album.write(folder, name, &recording.shots, seen)?;
    album.write_error(folder, recording.shots.size())
}
