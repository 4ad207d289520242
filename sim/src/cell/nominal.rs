//! What the software may know: the cell as its file describes it.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Image, Pose, Probe, Span, World};
use probepath_robot::{Joints, Model, PANDA_URDF, UR5E_URDF};
use probepath_us_capture::Setting;

use super::config::{ArmKind, CellConfig, MachineConfig, SubjectConfig, Window};
use super::{CellError, TICK};
use crate::leg::Side;
use crate::tank::Bench;
use crate::ultrasound::settings;

/// What the software may know about the cell: what a real cell's file would say, errors included.
#[derive(Clone, Debug, PartialEq)]
pub struct Nominal {
    /// The arm's URDF.
    pub urdf: &'static str,
    /// The URDF's link that is `Base`.
    pub base_link: &'static str,
    /// The URDF's link that is `Flange`.
    pub tip_link: &'static str,
    /// Where the arm stands.
    pub world_from_base: Pose<World, Base>,
    /// Where the probe is on the flange.
    pub flange_from_probe: Pose<Flange, Probe>,
    /// From the echoes to the arrival of a B-scan.
    pub image_latency: Span,
    /// How the ultrasound machine is set.
    pub setting: Setting,
    /// Between two ticks of the arm.
    pub period: Span,
    /// Where the arm is found: the probe over the groin (or over the phantom), looking down.
    pub start: Joints,
    /// The wire phantom, where one is on the table.
    pub bench: Option<Bench>,
    model: Model,
}

impl Nominal {
    pub(super) fn new(config: &CellConfig) -> Result<Self, CellError> {
        let side = match &config.subject {
            SubjectConfig::Leg(leg) if leg.side == Side::Right => -1.0,
            _ => 1.0,
        };
        let arm = config.arm.kind.described(side);
        let aside = if matches!(config.subject, SubjectConfig::Leg(_)) { 0.10 } else { 0.0 };
        let mut nominal = Self {
            urdf: arm.urdf,
            base_link: arm.base_link,
            tip_link: arm.tip_link,
            world_from_base: beside_the_table(side, aside + arm.away_m),
            flange_from_probe: tool(arm.turn_deg),
            image_latency: Span::from_seconds(config.machine.latency_ms * 1e-3),
            setting: config.machine.setting(),
            period: TICK,
            start: arm.near,
            bench: match &config.subject {
                SubjectConfig::WirePhantom(wires) => Some(Bench::new(wires)?),
                _ => None,
            },
            model: arm.model,
        };
        let over = looking_down(Vector3::new(side * aside, -0.30, 0.0));
        let base_from_probe = nominal.world_from_base.inverse() * over;
        let tool = nominal.flange_from_probe;
        nominal.start = nominal.model.inverse(&base_from_probe, &tool, &arm.near, &Default::default())?;
        Ok(nominal)
    }

    /// The arm's model, of the URDF.
    pub const fn model(&self) -> &Model {
        &self.model
    }

    /// The calibration: where the B-scan's plane is on the probe, for a setting. Columns run along the array, rows
    /// along the beam; the picture's middle column lies under the middle of the face.
    pub fn probe_from_image(&self, setting: &Setting) -> Pose<Probe, Image> {
        let first = Translation3::new(
            -setting.window_width_m / 2.0 + setting.spacing.x_m / 2.0,
            0.0,
            setting.window_top_m + setting.spacing.y_m / 2.0,
        );
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        // FRAMES: Image x is Probe x, Image y is Probe z, so Image z is -Probe y; the origin is the first pixel's centre.
        Pose::assume(Isometry3::from_parts(first, turn))
    }

    /// Where the model says the probe is.
    pub fn world_from_probe(&self, joints: &Joints) -> Pose<World, Probe> {
        self.world_from_base * self.model.forward(joints) * self.flange_from_probe
    }
}

/// What is known about an arm.
struct Described {
    urdf: &'static str,
    base_link: &'static str,
    tip_link: &'static str,
    model: Model,
    /// How far the base stands from the leg's middle (m).
    away_m: f64,
    /// How far the holder is turned about the flange's axis (degrees), so that the last joint stays in its range.
    turn_deg: f64,
    /// A posture near the start, elbow up.
    near: Joints,
}

impl ArmKind {
    fn described(self, side: f64) -> Described {
        match self {
            Self::Ur5e => Described {
                urdf: UR5E_URDF,
                base_link: "base_link",
                tip_link: "tool0",
                model: Model::ur5e(),
                away_m: 0.50,
                turn_deg: 30.0,
                near: joints(&[0.0, -1.9, 2.1, -1.8, -1.57, 0.0]),
            },
            Self::SevenJoint => Described {
                urdf: PANDA_URDF,
                base_link: "panda_link0",
                tip_link: "panda_link8",
                model: Model::seven_joint(),
                away_m: 0.50,
                turn_deg: 79.0,
                near: joints(&[0.0, 0.0, 0.0, -2.1, 0.0, 2.1, 1.57 * side]),
            },
        }
    }
}

fn joints(values: &[f64]) -> Joints {
    let mut all = Joints::zeros(values.len());
    all.as_mut_slice().copy_from_slice(values);
    all
}

/// The base on the table's edge, `away_m` from the midline on the patient's `side` (left is positive), its x toward the
/// patient, half way down the thigh.
fn beside_the_table(side: f64, away_m: f64) -> Pose<World, Base> {
    let (x, z) = (-Vector3::x() * side, -Vector3::y());
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    let place = Translation3::new(side * away_m, 0.0, -0.11);
    // FRAMES: columns are Base's axes in World: x toward the patient, z up (World y is down).
    Pose::assume(Isometry3::from_parts(place, UnitQuaternion::from_rotation_matrix(&axes)))
}

/// The probe's holder: 165 mm long, on the flange's axis but for 12 mm, turned about it.
fn tool(turn_deg: f64) -> Pose<Flange, Probe> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_deg.to_radians());
    // FRAMES: the cell's own drawing of the holder: Probe z along Flange z.
    Pose::assume(Isometry3::from_parts(Translation3::new(0.012, 0.0, 0.165), turn))
}

/// A probe at `place` that looks down, its array across the body: x to the patient's left.
fn looking_down(place: Vector3<f64>) -> Pose<World, Probe> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    // FRAMES: Probe z on World y (down), Probe x on World x.
    Pose::assume(Isometry3::from_parts(Translation3::from(place), turn))
}

impl MachineConfig {
    /// The setting that it describes.
    pub(crate) fn setting(&self) -> Setting {
        let (depth_m, focus_m) = (self.depth_mm * 1e-3, self.focus_mm * 1e-3);
        match self.window {
            Window::Whole => settings::whole_depth(depth_m, focus_m),
            Window::Zoom { top_mm, height_mm } => {
                settings::zoomed(depth_m, focus_m, height_mm * 1e-3, (top_mm + height_mm / 2.0) * 1e-3)
            }
        }
    }
}
