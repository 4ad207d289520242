//! The parameters of the fit: their names, their values, and a step of them.

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Pose, Probe, Span};

use super::FitOptions;
use crate::PixelSpacing;

/// All that can be fitted; what is not, keeps its place and is left out of the solving.
pub(super) const COUNT: usize = 16;
/// A number a parameter.
pub(super) type Step = SVector<f64, COUNT>;

/// Where each group begins.
pub(super) const TURN: usize = 0;
pub(super) const SHIFT: usize = 3;
pub(super) const COLUMN_SCALE: usize = 6;
pub(super) const ROW_SCALE: usize = 7;
pub(super) const SHEAR: usize = 8;
pub(super) const LAG: usize = 9;
pub(super) const PLACE_TURN: usize = 10;
pub(super) const PLACE_SHIFT: usize = 13;

/// A parameter of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its unit: `rad` (rotation vector), `m`, `s`, or `1` (a factor).
    pub unit: &'static str,
}

const fn parameter(name: &'static str, unit: &'static str) -> Parameter {
    Parameter { name, unit }
}

impl Parameter {
    /// All, in their order. Rotations are rotation vectors applied on the right: `probe_from_image` turns in the
    /// Image's axes about the Image's origin and shifts in the Probe's axes; the phantom turns and shifts in its own
    /// axes about the middle of its wires. Scales are factors on the nominal spacing.
    pub const ALL: [Self; COUNT] = [
        parameter("image_turn_x", "rad"),
        parameter("image_turn_y", "rad"),
        parameter("image_turn_z", "rad"),
        parameter("image_shift_x", "m"),
        parameter("image_shift_y", "m"),
        parameter("image_shift_z", "m"),
        parameter("column_scale", "1"),
        parameter("row_scale", "1"),
        parameter("shear", "rad"),
        parameter("lag", "s"),
        parameter("phantom_turn_x", "rad"),
        parameter("phantom_turn_y", "rad"),
        parameter("phantom_turn_z", "rad"),
        parameter("phantom_shift_x", "m"),
        parameter("phantom_shift_y", "m"),
        parameter("phantom_shift_z", "m"),
    ];

    /// The lag.
    pub const LAG: Self = Self::ALL[LAG];

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name == name)
    }

    pub(super) fn index(self) -> Option<usize> {
        Self::ALL.iter().position(|p| *p == self)
    }
}

/// What the parameters are at some point of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    pub(super) probe_from_image: Isometry3<f64>,
    pub(super) column_scale: f64,
    pub(super) row_scale: f64,
    pub(super) shear: f64,
    pub(super) lag_s: f64,
    pub(super) place_turn: UnitQuaternion<f64>,
    pub(super) place_shift: Vector3<f64>,
}

impl Values {
    pub(super) fn start(probe_from_image: &Pose<Probe, Image>, lag: Span, options: &FitOptions) -> Self {
        let (column_scale, row_scale) = options.start_scale();
        Self {
            probe_from_image: *probe_from_image.isometry(),
            column_scale,
            row_scale,
            shear: 0.0,
            lag_s: lag.seconds(),
            place_turn: UnitQuaternion::identity(),
            place_shift: Vector3::zeros(),
        }
    }

    /// The values a step further.
    pub(super) fn moved(&self, step: &Step) -> Self {
        let three = |at: usize| Vector3::new(step[at], step[at + 1], step[at + 2]);
        let turn = self.probe_from_image.rotation * UnitQuaternion::from_scaled_axis(three(TURN));
        let shift = self.probe_from_image.translation.vector + three(SHIFT);
        Self {
            probe_from_image: Isometry3::from_parts(Translation3::from(shift), turn),
            column_scale: self.column_scale + step[COLUMN_SCALE],
            row_scale: self.row_scale + step[ROW_SCALE],
            shear: self.shear + step[SHEAR],
            lag_s: self.lag_s + step[LAG],
            place_turn: self.place_turn * UnitQuaternion::from_scaled_axis(three(PLACE_TURN)),
            place_shift: self.place_shift + three(PLACE_SHIFT),
        }
    }

    /// How far the values are from where a prior expects them: the scales from `scales`, the correction from none.
    pub(super) fn off_prior(&self, scales: (f64, f64)) -> Step {
        let mut off = Step::zeros();
        off[COLUMN_SCALE] = self.column_scale - scales.0;
        off[ROW_SCALE] = self.row_scale - scales.1;
        off.fixed_rows_mut::<3>(PLACE_TURN).copy_from(&self.place_turn.scaled_axis());
        off.fixed_rows_mut::<3>(PLACE_SHIFT).copy_from(&self.place_shift);
        off
    }

    pub(super) fn spacing(&self, nominal: PixelSpacing) -> PixelSpacing {
        PixelSpacing { x_m: nominal.x_m * self.column_scale, y_m: nominal.y_m * self.row_scale }
    }

    /// The correction of the phantom's place, about the middle of its wires.
    pub(super) fn place(&self) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::from(self.place_shift), self.place_turn)
    }
}
