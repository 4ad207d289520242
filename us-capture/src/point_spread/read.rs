//! The widths, read from the images of a phantom that was calibrated on.

use nalgebra::Vector2;
use thiserror::Error;

use super::dot::{Picture, Unfit, shape};
use super::fit::{Found, Seen, Waist, Widths, fit};
use super::{FWHM, PointSpread, PointSpreadMm};
use crate::Setting;
use crate::calibration::mm;
use crate::phantom::Wire;
use crate::shots::{Shot, Shots};
use crate::spatial::Spatial;

/// Fewest dots that are read from.
const LEAST_DOTS: usize = 60;
/// An axial or lateral width that is less sure than this part of itself is not better than the setting's model.
const MOST_UNSURE: f64 = 0.1;
/// A wire that runs along the plane more than this across it is a streak, no dot.
const STEEPEST: f64 = 1.5;

/// Why no widths are read; the setting's model goes on holding.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NoSpread {
    /// Nobody said what the grey levels stand for.
    #[error(
        "the machine's dynamic range is not known, so grey levels are no decibels: say it (dynamic_range_db), \
         or the setting's model of the point spread is used"
    )]
    NoRange,
    /// A range that no machine has.
    #[error("a dynamic range of {dynamic_range_db} dB is none: 20 to 120 dB are")]
    BadRange {
        /// What was said.
        dynamic_range_db: f64,
    },
    /// Too few dots.
    #[error(
        "{used} of {dots} dots show the width of the beam, {LEAST_DOTS} are needed ({saturated} are saturated): \
         lower the gain or take more images, or the setting's model of the point spread is used"
    )]
    TooFew {
        /// Dots with a shape.
        used: usize,
        /// Dots that wires made.
        dots: usize,
        /// Dots that are white.
        saturated: usize,
    },
    /// The dots disagree.
    #[error(
        "the dots tell the beam's width only to {axial:.0} % along it and {lateral:.0} % along the array: \
         take more images, or the setting's model of the point spread is used"
    )]
    Unsure {
        /// Standard error of the axial width (%).
        axial: f64,
        /// Of the lateral width (%).
        lateral: f64,
    },
}

/// Reads the point spread from the wires' dots in the images of a calibration.
///
/// `setting` is the machine's own (its pixels as the machine says them), `dynamic_range_db` what lies between grey 0 and
/// 255. The setting's model is where the fit starts, and what it falls back to where the dots say nothing.
///
/// Widths along y are as they show, so that they hold in any medium; depths are true ones.
///
/// # Errors
/// When the range cannot be, or the dots do not tell the widths.
pub fn read_from_wires(
    spatial: &Spatial,
    shots: &Shots,
    setting: &Setting,
    dynamic_range_db: f64,
) -> Result<PointSpreadMm, NoSpread> {
    if !(20.0..=120.0).contains(&dynamic_range_db) {
        return Err(NoSpread::BadRange { dynamic_range_db });
    }
    let mut dots =
        Dots { spatial, shots, setting, range_db: dynamic_range_db, all: 0, saturated: 0, seen: Vec::new() };
    dots.look();
    let Dots { all, saturated, seen, .. } = dots;
    let too_few = NoSpread::TooFew { used: seen.len(), dots: all, saturated };
    if seen.len() < LEAST_DOTS {
        return Err(too_few);
    }
    let found = fit(&seen, &model(setting)).ok_or(too_few)?;
    let [axial, lateral, _] = found.sd;
    if axial.max(lateral) > MOST_UNSURE {
        return Err(NoSpread::Unsure { axial: 100.0 * axial, lateral: 100.0 * lateral });
    }
    Ok(stored(&found, seen.len(), dynamic_range_db))
}

/// The setting's model; the distance of the lines is a part of the waist.
fn model(setting: &Setting) -> Widths {
    let usual = PointSpread::default();
    let wider = (usual.lines_m(setting) / usual.lateral_fwhm_m).hypot(1.0);
    Widths {
        axial: usual.axial_fwhm_m / FWHM,
        lateral: Waist {
            width: usual.lateral_fwhm_m * wider / FWHM,
            at: usual.lateral_waist_of_focus * setting.focus_m,
            length: usual.lateral_depth_of_field_m * wider,
        },
        elevational: Waist {
            width: usual.elevational_fwhm_m / FWHM,
            at: usual.elevational_focus_m,
            length: usual.elevational_depth_of_field_m,
        },
    }
}

fn stored(found: &Found, dots: usize, dynamic_range_db: f64) -> PointSpreadMm {
    let Widths { axial, lateral, elevational } = found.widths;
    let [axial_sd, lateral_sd, elevational_sd] = found.sd;
    PointSpreadMm {
        dots,
        dynamic_range_db,
        axial_fwhm_mm: mm(axial * FWHM),
        axial_sd_mm: mm(axial * FWHM * axial_sd),
        lateral_fwhm_mm: mm(lateral.width * FWHM),
        lateral_sd_mm: mm(lateral.width * FWHM * lateral_sd),
        lateral_waist_depth_mm: mm(lateral.at),
        lateral_depth_of_field_mm: mm(lateral.length),
        elevational_fwhm_mm: mm(elevational.width * FWHM),
        elevational_sd_mm: mm(elevational.width * FWHM * elevational_sd),
        elevational_waist_depth_mm: mm(elevational.at),
        elevational_depth_of_field_mm: mm(elevational.length),
    }
}

/// The dots of all images.
struct Dots<'a> {
    spatial: &'a Spatial,
    shots: &'a Shots,
    setting: &'a Setting,
    range_db: f64,
    all: usize,
    saturated: usize,
    seen: Vec<Seen>,
}

impl Dots<'_> {
    fn look(&mut self) {
        let (spatial, shots) = (self.spatial, self.shots);
        for (shot, seen) in shots.shots().iter().zip(&spatial.seen) {
            let (Ok(pixels), Ok(labels)) = (&shot.pixels, &seen.labels) else { continue };
            let picture = Picture { pixels, width: shots.size().0, db_per_grey: self.range_db / 255.0 };
            for (wire, dot) in labels.dots.iter().enumerate() {
                let Some(dot) = dot.filter(|dot| !dot.cut) else { continue };
                let Some(slope) = self.slope(shot, wire) else { continue };
                self.all += 1;
                match shape(picture, &dot) {
                    Ok(shape) => self.seen.push(self.one(wire, dot.at_px[1], slope, &shape)),
                    Err(Unfit::Saturated) => self.saturated += 1,
                    Err(Unfit::Shapeless) => {}
                }
            }
        }
    }

    fn one(&self, wire: usize, row: f64, slope: Vector2<f64>, shape: &nalgebra::Matrix2<f64>) -> Seen {
        let (x, y) = (self.setting.spacing.x_m, self.setting.spacing.y_m);
        let depth = (self.setting.window_top_m + row * y) / self.shown_per_m();
        let shape = [shape[(0, 0)] * x * x, shape[(1, 1)] * y * y, shape[(0, 1)] * x * y];
        Seen { wire, depth, slope, shape }
    }

    /// How much deeper than it is something shows: the machine takes water for tissue.
    fn shown_per_m(&self) -> f64 {
        self.setting.spacing.y_m / self.spatial.fit.spacing.y_m
    }

    /// How far the wire goes along x and y, as they show, for each metre across the plane; nothing where no pose is
    /// known, or the wire hardly crosses.
    fn slope(&self, shot: &Shot, wire: usize) -> Option<Vector2<f64>> {
        let fit = &self.spatial.fit;
        let wire: &Wire = self.spatial.phantom().wires.get(wire)?;
        let world_from_probe = self.shots.track().at(shot.stamp + fit.lag).ok()?;
        let image_from_world = (world_from_probe * fit.probe_from_image).inverse();
        let run = (image_from_world * fit.world_from_phantom).isometry().rotation * wire.run();
        let slope = Vector2::new(run.x, run.y * self.shown_per_m()) / run.z;
        (slope.norm() < STEEPEST).then_some(slope)
    }
}
