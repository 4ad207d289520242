//! The calibration as a file.

use std::path::Path;

use probepath_us_capture::errors::{Found as Errors, Summary};
use probepath_us_capture::fit::{Fit, in_tissue, speed_of_sound_in_water};
use probepath_us_capture::point_spread::{NoSpread, PointSpreadMm, read_from_wires};
use probepath_us_capture::shots::Shots;
use probepath_us_capture::spatial::Spatial;
use probepath_us_capture::{Calibration, CalibrationError, FoundMm, PixelSpacing, Quality, Setting, Water};

use super::CalibrateError;
use super::options::ASSUMED_M_S;
use super::request::SpatialRequest;
use super::wishes::Scale;

/// Writes the calibration; `errors` are those on images it had not seen, where there are any (`held_out`).
///
/// One whose pixels were corrected by the water is stored for tissue, with the scanner's own spacing, as the robot's is.
///
/// # Errors
/// When the disk refuses, or a number is one that no calibration can have.
pub(super) fn write(
    path: &Path,
    request: &SpatialRequest,
    size: (usize, usize),
    (fit, spread): (&Fit, Option<PointSpreadMm>),
    phantom: &str,
    (errors, held_out): (&Errors, bool),
) -> Result<(), CalibrateError> {
    let name =
        request.sequence.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let setting = setting_of(request, size, fit);
    let calibration = Calibration {
        id: format!("{}-{}", request.date, name.trim_end_matches(".igs")),
        date: request.date.clone(),
        phantom: phantom.to_owned(),
        // Where the spacing is the fitted one this moves nothing.
        probe_from_image: in_tissue(&fit.probe_from_image, fit.spacing, &setting),
        setting,
        image_lag: fit.lag,
        error: error(errors, held_out),
        quality: Some(Quality {
            found: FoundMm::of(errors, held_out),
            water: water(request),
            point_spread: spread,
            ..Quality::of(fit, size)
        }),
    };
    Ok(calibration.write(path)?)
}

/// How wide the wires show the beam, where somebody said what grey levels stand for.
pub(super) fn point_spread(
    request: &SpatialRequest,
    shots: &Shots,
    found: &Spatial,
) -> Option<Result<PointSpreadMm, NoSpread>> {
    let setting = setting_of(request, shots.size(), &found.fit);
    Some(read_from_wires(found, shots, &setting, request.dynamic_range_db?))
}

fn setting_of(request: &SpatialRequest, size: (usize, usize), fit: &Fit) -> Setting {
    let in_water = request.scale == Some(Scale::Water);
    setting(if in_water { fit.uncertainty.nominal() } else { fit.spacing }, size)
}

/// The water, where the pixels' size was corrected by it.
fn water(request: &SpatialRequest) -> Option<Water> {
    (request.scale == Some(Scale::Water)).then(|| Water {
        temperature_celsius: request.water_celsius,
        speed_of_sound_m_s: speed_of_sound_in_water(request.water_celsius),
        assumed_m_s: ASSUMED_M_S,
    })
}

/// The middle wires' error, as the field states it; a phantom of single wires has only distances from wires.
fn error(errors: &Errors, held_out: bool) -> CalibrationError {
    let of = if errors.mids.is_empty() { &errors.lines } else { &errors.mids };
    let summary = Summary::of(of.iter().map(|dot| dot.error_m));
    let count = of.len().max(1) as f64;
    let mean = of.iter().map(|dot| dot.error_m).sum::<f64>() / count;
    let scatter = of.iter().map(|dot| (dot.error_m - mean).powi(2)).sum::<f64>();
    CalibrationError { rms_mm: summary.rms_m * 1e3, sd_mm: (scatter / count).sqrt() * 1e3, held_out }
}

/// What the size of the picture says of the machine. A sequence says no depth and no focus, nor how deep its first row
/// is: it is taken to be at the face.
fn setting(spacing: PixelSpacing, (width, height): (usize, usize)) -> Setting {
    let depth_m = spacing.y_m * height as f64;
    Setting {
        depth_m,
        focus_m: depth_m / 2.0,
        window_top_m: 0.0,
        window_height_m: depth_m,
        window_width_m: spacing.x_m * width as f64,
        spacing,
    }
}
