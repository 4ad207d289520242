//! The calibration step: B-scans of a phantom become a calibration, and other B-scans say how good it is.

use probepath_frames::{Image, Pose, Probe, Span};
use probepath_us_capture::exam::Attachment;
use probepath_us_capture::fit::{Lag, Parameter, PhantomPlace, Scale, in_tissue, speed_of_sound_in_water};
use probepath_us_capture::label::Expect;
use probepath_us_capture::plan::Expected;
use probepath_us_capture::point_spread::{NoSpread, PointSpreadMm, read_from_wires};
use probepath_us_capture::spatial::{Doing, Evaluation, Spatial, SpatialError, SpatialOptions};
use probepath_us_capture::{
    Calibration, CalibrationError, FoundMm, PixelSpacing, PromisedMm, Quality, Setting, Water,
};
use serde::Serialize;

use super::{PhantomImages, Session, SessionError};

/// What scanners take for the speed of sound (m/s).
const ASSUMED_M_S: f64 = 1540.0;
/// How well a thermometer in the bath is read (Celsius).
const THERMOMETER_SD: f64 = 0.5;
/// No machine's stated latency is further off than this (s).
const MOST_LAG_S: f64 = 0.5;

/// How a calibration is to be made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrateWish {
    /// How warm the water is (degrees Celsius); what the cell says otherwise.
    pub water_celsius: Option<f64>,
}

/// A calibration that was made here.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The fit, and what was seen of every image.
    pub spatial: Spatial,
    /// How the machine was set.
    pub setting: Setting,
    /// Columns and rows of an image.
    pub size: (usize, usize),
    /// How warm the water was (degrees Celsius).
    pub water_celsius: f64,
    /// What the arm's own error does, were every dot exact.
    pub arm: Option<Expected>,
    /// The point spread that the wires told, or why they did not.
    pub spread: Result<PointSpreadMm, NoSpread>,
    /// What has been found on images that it has not used.
    pub held: Option<Evaluation>,
}

/// How sure a calibration is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StandardError {
    /// Of a reconstructed point in the probe, mean over the image (m).
    pub mean_m: f64,
    /// Its 95th percentile over the image (m).
    pub p95_m: f64,
    /// Its root mean square over the image (m).
    pub rms_m: f64,
    /// Of the lag (s), from the scatter of the dots.
    pub lag_s: f64,
}

/// How good a calibration is: on images that it has not used (lengths in mm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// Images.
    pub images: usize,
    /// Images whose wires were found.
    pub labelled: usize,
    /// Distance of the Zs' middle wires from where they should be: mean of the best 95 %, and their SD (mm).
    pub mid_mean95_mm: f64,
    /// See `mid_mean95_mm`.
    pub mid_sd95_mm: f64,
    /// The same, root mean square of all (mm).
    pub mid_rms_mm: f64,
    /// Distance of every dot from its wire, root mean square (mm).
    pub line_rms_mm: f64,
}

impl Checked {
    fn of(evaluation: &Evaluation) -> Self {
        Self {
            images: evaluation.images,
            labelled: evaluation.labelled,
            mid_mean95_mm: evaluation.mid.mean95_m * 1e3,
            mid_sd95_mm: evaluation.mid.sd95_m * 1e3,
            mid_rms_mm: evaluation.mid.rms_m * 1e3,
            line_rms_mm: evaluation.line.rms_m * 1e3,
        }
    }
}

impl std::fmt::Display for Checked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} of {} images labelled; Z-fiducials {:.2} ± {:.2} mm (best 95 %), {:.2} mm RMS; wires {:.2} mm RMS",
            self.labelled,
            self.images,
            self.mid_mean95_mm,
            self.mid_sd95_mm,
            self.mid_rms_mm,
            self.line_rms_mm
        )
    }
}

impl Calibrated {
    /// Standard error of a reconstructed point over the image: what the fit says from the scatter of the dots, and what
    /// the arm's accuracy does, which images at one place share.
    pub fn standard_error(&self) -> StandardError {
        let map = self.spatial.fit.uncertainty.standard_error_map(self.size.0, self.size.1);
        let squares: f64 = map.errors_m.iter().map(|error| error * error).sum();
        let rms_m = (squares / map.errors_m.len().max(1) as f64).sqrt();
        let arm = |pick: fn(&Expected) -> f64| self.arm.as_ref().map_or(0.0, pick);
        StandardError {
            mean_m: map.mean_m().hypot(arm(|e| e.point_mean_m)),
            p95_m: map.p95_m().hypot(arm(|e| e.point_p95_m)),
            rms_m: rms_m.hypot(arm(|e| e.point_rms_m)),
            lag_s: self.spatial.fit.uncertainty.standard_error_of(Parameter::LAG).unwrap_or_default(),
        }
    }

    /// Where the image's plane is for scanning tissue, with the machine's own spacing.
    pub fn in_tissue(&self) -> Pose<Probe, Image> {
        let fit = &self.spatial.fit;
        in_tissue(&fit.probe_from_image, fit.spacing, &self.setting)
    }

    /// What was found: on images that it has not used, or, unchecked, on its own.
    pub fn found(&self) -> Checked {
        Checked::of(self.held.as_ref().unwrap_or(&self.spatial.evaluation))
    }

    fn quality(&self) -> Quality {
        let error = self.standard_error();
        let found = &self.held.as_ref().unwrap_or(&self.spatial.evaluation).found;
        Quality {
            found: FoundMm::of(found, self.held.is_some()),
            water: Some(Water {
                temperature_celsius: self.water_celsius,
                speed_of_sound_m_s: speed_of_sound_in_water(self.water_celsius),
                assumed_m_s: ASSUMED_M_S,
            }),
            point_spread: self.spread.clone().ok(),
            standard_error: PromisedMm { mean_mm: error.mean_m * 1e3, p95_mm: error.p95_m * 1e3 },
            ..Quality::of(&self.spatial.fit, self.size)
        }
    }

    /// The Z-fiducials' error; a window of 2 cm may show no Z whole, and then every dot's distance from its wire.
    fn error(&self) -> CalibrationError {
        let (found, held_out) = (self.found(), self.held.is_some());
        if found.mid_rms_mm.is_finite() {
            return CalibrationError { rms_mm: found.mid_rms_mm, sd_mm: found.mid_sd95_mm, held_out };
        }
        let line = self.held.as_ref().unwrap_or(&self.spatial.evaluation).line;
        CalibrationError { rms_mm: line.rms_m * 1e3, sd_mm: line.sd95_m * 1e3, held_out }
    }

    /// As it is stored, for scanning tissue.
    pub fn stored(&self, date: Option<&str>) -> Calibration {
        let phantom = self.spatial.phantom().name.clone();
        let (depth, focus) = (self.setting.depth_m * 1e3, self.setting.focus_m * 1e3);
        Calibration {
            id: format!("{phantom}, depth {depth:.0} mm, focus {focus:.0} mm"),
            date: date.unwrap_or("simulated").to_owned(),
            phantom,
            probe_from_image: self.in_tissue(),
            setting: self.setting,
            image_lag: self.spatial.fit.lag,
            error: self.error(),
            quality: Some(self.quality()),
        }
    }
}

impl Session {
    /// Calibrates from B-scans of a phantom: where the image's plane is on the probe, when images are formed, and a
    /// small correction of the phantom's place, from every wire that is seen.
    ///
    /// # Errors
    /// When too few images show the phantom, or something stays undetermined; the error says what to do.
    pub fn calibrate(
        &mut self,
        images: &PhantomImages,
        wish: &CalibrateWish,
    ) -> Result<Calibrated, SessionError> {
        let options = self.spatial_options(images, wish);
        let progress = self.opening.progress.clone();
        let watch = move |doing: Doing| match doing {
            Doing::Looking { done, of } => progress.at("looking for wires", done as f64 / of.max(1) as f64),
            Doing::Fitting { .. } => progress.at("calibrating", 1.0),
        };
        let phantom = &images.located.phantom;
        let mut spatial = Spatial::calibrate(&images.shots, phantom, &options, &watch);
        if spatial.as_ref().map_or(true, is_doubtful) {
            // The drawing may have led to the wrong wires: once more without it, from what the images agree on.
            let side = options.nominal.map_or(options.expect, Expect::About);
            let alone = SpatialOptions { nominal: None, expect: side, ..options };
            let again = Spatial::calibrate(&images.shots, phantom, &alone, &watch);
            spatial = better(spatial, again);
        }
        let spatial = spatial?;
        if is_doubtful(&spatial) {
            self.warn(&format!(
                "The calibration's own Z-fiducials are {:.1} mm off: wires may have been taken for others. Bring the \
                 nominal calibration or the phantom's place nearer to the truth, and calibrate again.",
                spatial.evaluation.mid.rms_m * 1e3
            ));
        }
        let arm = images.visits.error_of_the_arm(&spatial, images.setting, images.shots.size());
        let spread = self.point_spread(&spatial, images);
        let calibrated = Calibrated {
            spread,
            spatial,
            setting: images.setting,
            size: images.shots.size(),
            water_celsius: wish.water_celsius.unwrap_or(images.located.water_celsius),
            arm,
            held: None,
        };
        let (error, evaluation) = (calibrated.standard_error(), &calibrated.spatial.evaluation);
        self.say(&format!(
            "Calibrated from {} of {} images: standard error {:.3} mm over the image, {:.3} mm at its 95th \
             percentile; lag {:.1} ms.",
            evaluation.labelled,
            evaluation.images,
            error.mean_m * 1e3,
            error.p95_m * 1e3,
            calibrated.spatial.fit.lag.seconds() * 1e3
        ));
        for weak in &calibrated.spatial.fit.weak {
            self.warn(&weak.to_string());
        }
        Ok(calibrated)
    }

    /// How wide the wires of the same images show the beam.
    fn point_spread(&mut self, spatial: &Spatial, images: &PhantomImages) -> Result<PointSpreadMm, NoSpread> {
        let range_db = self.cell.file.dynamic_range_db().ok_or(NoSpread::NoRange);
        let read = range_db.and_then(|db| read_from_wires(spatial, &images.shots, &images.setting, db));
        self.say(&match &read {
            Ok(found) => found.to_string(),
            Err(why) => format!("The point spread was not read from the wires: {why}."),
        });
        read
    }

    fn spatial_options(&self, images: &PhantomImages, wish: &CalibrateWish) -> SpatialOptions {
        let located = &images.located;
        let place = PhantomPlace::Prior {
            pose: located.world_from_phantom,
            sd_m: located.sd_m,
            sd_rad: located.sd_rad,
        };
        SpatialOptions {
            spacing: Some(images.setting.spacing),
            scale: Scale::SpeedOfSound {
                water_celsius: wish.water_celsius.unwrap_or(located.water_celsius),
                sd_celsius: THERMOMETER_SD,
                assumed_m_s: ASSUMED_M_S,
            },
            lag: Lag::Estimated { from: Span::from_seconds(-MOST_LAG_S), to: Span::from_seconds(MOST_LAG_S) },
            nominal: self.cell.calibration.as_ref().map(|known| known.probe_from_image),
            ..SpatialOptions::new(place)
        }
    }

    /// How good a calibration is on images that it has not used.
    ///
    /// # Errors
    /// When the images are of another size, or none shows the phantom.
    pub fn check_calibration(
        &mut self,
        calibrated: &Calibrated,
        others: &PhantomImages,
    ) -> Result<Calibrated, SessionError> {
        let held = calibrated.spatial.evaluate(&others.shots, &|_| {})?;
        let checked = Checked::of(&held.evaluation);
        self.say(&format!("Checked on images it had not used: {checked}."));
        Ok(Calibrated { held: Some(held.evaluation), ..calibrated.clone() })
    }

    /// Writes a calibration into the session's folder, and keeps it in the exam.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save_calibration(&mut self, calibrated: &Calibrated, name: &str) -> Result<(), SessionError> {
        let stored = calibrated.stored(self.opening.date.as_deref());
        let path = self.file(name);
        stored.write(&path)?;
        if let Some(exam) = &self.exam {
            exam.attach(Attachment::new(name, "application/toml", stored.to_toml()?.into_bytes()));
        }
        self.say(&format!("The calibration is in {}.", path.display()));
        Ok(())
    }
}

/// Z-fiducials this far off on the very images of the fit (m) say that wires were taken for others.
const DOUBTFUL_M: f64 = 0.5e-3;

fn is_doubtful(spatial: &Spatial) -> bool {
    let rms_m = spatial.evaluation.mid.rms_m;
    rms_m.is_nan() || rms_m > DOUBTFUL_M
}

/// The one whose own Z-fiducials are less far off.
fn better(
    one: Result<Spatial, SpatialError>,
    other: Result<Spatial, SpatialError>,
) -> Result<Spatial, SpatialError> {
    match (one, other) {
        (Ok(one), Ok(other)) if other.evaluation.mid.rms_m < one.evaluation.mid.rms_m => Ok(other),
        (Err(_), Ok(other)) => Ok(other),
        (one, _) => one,
    }
}

/// How far the pixels of one calibration are from those of another over an image: mean, 95th percentile, and root mean
/// square (m).
pub(super) fn apart(
    (ours, our_spacing): (&Pose<Probe, Image>, PixelSpacing),
    (theirs, their_spacing): (&Pose<Probe, Image>, PixelSpacing),
    (columns, rows): (usize, usize),
) -> [f64; 3] {
    const GRID: usize = 17;
    let step = |pixels: usize| pixels.saturating_sub(1) as f64 / (GRID - 1) as f64;
    let at = |i: usize| {
        let (u, v) = ((i % GRID) as f64 * step(columns), (i / GRID) as f64 * step(rows));
        (*ours * our_spacing.point(u, v)).distance(&(*theirs * their_spacing.point(u, v)))
    };
    let mut distances: Vec<f64> = (0..GRID * GRID).map(at).collect();
    distances.sort_by(f64::total_cmp);
    let p95 = distances.get(distances.len() * 95 / 100).copied().unwrap_or(f64::NAN);
    let mean = |power: i32| distances.iter().map(|d| d.powi(power)).sum::<f64>() / distances.len() as f64;
    [mean(1), p95, mean(2).sqrt()]
}
