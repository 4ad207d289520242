//! What a simulated cell is made of, as its file says it.

use serde::{Deserialize, Serialize};

use super::CellError;
use crate::arm::{KinematicError, SensorConfig, ToolConfig};
use crate::disturbance::DisturbanceConfig;
use crate::hand::HandConfig;
use crate::knobs::Knobs;
use crate::leg::LegConfig;
use crate::phantom::PhantomConfig;
use crate::skin::SkinConfig;
use crate::tank::{self, WirePhantomConfig};
use crate::ultrasound::ImagingConfig;

/// A simulated cell. The default is a UR5e beside the table with a left leg on it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CellConfig {
    /// What lies on the table.
    pub subject: SubjectConfig,
    /// The arm.
    pub arm: ArmConfig,
    /// The force sensor.
    pub sensor: SensorConfig,
    /// The skin, or the phantom's top.
    pub skin: SkinConfig,
    /// The ultrasound machine.
    pub machine: MachineConfig,
    /// The hand that guides.
    pub hand: HandConfig,
    /// What disturbs the contact.
    pub disturbance: DisturbanceConfig,
    /// What fails.
    pub knobs: Knobs,
}

/// What lies on the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SubjectConfig {
    /// A leg.
    Leg(LegConfig),
    /// The straight vascular phantom of [P1].
    Phantom(PhantomConfig),
    /// A phantom of wires in water, for calibrating.
    WirePhantom(WirePhantomConfig),
}

impl Default for SubjectConfig {
    fn default() -> Self {
        Self::Leg(LegConfig::default())
    }
}

/// Which arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ArmKind {
    /// The UR5e, 6 joints.
    #[default]
    Ur5e,
    /// The 7-joint arm.
    SevenJoint,
}

/// The arm, and how it errs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmConfig {
    /// Which arm.
    pub kind: ArmKind,
    /// How far the joints follow behind a steady command (ms), a tick of 2 ms aside.
    pub servo_lag_ms: f64,
    /// Noise of a measured position, one standard deviation (rad).
    pub position_noise_rad: f64,
    /// Noise of a measured velocity, one standard deviation (rad/s).
    pub velocity_noise_rad_s: f64,
    /// How the true chain differs from the model.
    pub kinematic_error: KinematicError,
    /// How fast a joint slows down when the arm brakes by its own means (rad/s²).
    pub braking_rad_s2: f64,
    /// The arm stops by itself when it is pushed harder than this (N).
    pub stops_above_n: f64,
    /// What it carries.
    pub tool: ToolConfig,
}

impl Default for ArmConfig {
    fn default() -> Self {
        Self {
            kind: ArmKind::Ur5e,
            servo_lag_ms: 10.0,
            position_noise_rad: 1e-5,
            velocity_noise_rad_s: 5e-4,
            kinematic_error: KinematicError::default(),
            braking_rad_s2: 8.0,
            stops_above_n: 100.0,
            tool: ToolConfig::default(),
        }
    }
}

/// The ultrasound machine: its setting, and how it errs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MachineConfig {
    /// B-scans a second.
    pub rate_hz: f64,
    /// From the echoes to the arrival of the B-scan (ms).
    pub latency_ms: f64,
    /// Scan depth (mm).
    pub depth_mm: f64,
    /// Depth of the transmit focus (mm).
    pub focus_mm: f64,
    /// What part of the depth the picture shows.
    pub window: Window,
    /// How far the calibration that the software knows is from the truth: place (mm), in a direction from the seed.
    pub calibration_error_mm: f64,
    /// And orientation (degrees).
    pub calibration_error_deg: f64,
    /// How its pictures are formed.
    pub imaging: ImagingConfig,
}

/// What part of the depth the picture shows; never wider than the array.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Window {
    /// All of it.
    Whole,
    /// A window, enlarged.
    Zoom {
        /// Depth of its top under the face (mm).
        top_mm: f64,
        /// Its height (mm).
        height_mm: f64,
    },
}

impl Default for MachineConfig {
    /// [P1]'s depth 7 cm, focus 4-5 cm, zoom 4:7, which holds the artery from groin to knee.
    fn default() -> Self {
        Self {
            rate_hz: 25.0,
            latency_ms: 60.0,
            depth_mm: 70.0,
            focus_mm: 45.0,
            window: Window::Zoom { top_mm: 2.0, height_mm: 40.0 },
            calibration_error_mm: 0.2,
            calibration_error_deg: 0.2,
            imaging: ImagingConfig::default(),
        }
    }
}

impl CellConfig {
    /// The phantom bench of [P1]: the straight phantom, depth 7 cm, focus 4-5 cm, zoom 3:7 around its vessel; an even
    /// top of 1.5 N/mm; a hand that goes 100 mm along it without mishaps.
    pub fn phantom() -> Self {
        let window = Window::Zoom { top_mm: 16.0, height_mm: 30.0 };
        Self {
            subject: SubjectConfig::Phantom(PhantomConfig::default()),
            skin: SkinConfig { friction: 0.06, ..SkinConfig::even(1.5) },
            machine: MachineConfig { window, ..MachineConfig::default() },
            hand: HandConfig { start_mm: 15.0, length_mm: 100.0, mishaps: false, ..HandConfig::default() },
            ..Self::default()
        }
    }

    /// The calibration bench of [P1]: its 19 Zs in a tank of water at 20 degrees, depth 7 cm, focus 4-5 cm, no zoom.
    /// The machine's gain suits water: bright wires over faint noise. What the software knows of the image's plane is
    /// a drawing of the holder, 3 mm and 3 degrees from the truth; what the probe knocks against is hard.
    pub fn wire_phantom() -> Self {
        let imaging = ImagingConfig { noise_db: 1.0, dynamic_range_db: 50.0, ..ImagingConfig::default() };
        let machine = MachineConfig {
            window: Window::Whole,
            calibration_error_mm: 3.0,
            calibration_error_deg: 3.0,
            imaging,
            ..MachineConfig::default()
        };
        Self {
            subject: SubjectConfig::WirePhantom(WirePhantomConfig::default()),
            skin: SkinConfig { gel_mm: 0.0, ..SkinConfig::even(20.0) },
            machine,
            ..Self::default()
        }
    }

    /// Whether every number can be what it says.
    pub(super) fn check(&self) -> Result<(), CellError> {
        let (arm, machine, skin, hand) = (&self.arm, &self.machine, &self.skin, &self.hand);
        within("arm.servo_lag_ms", arm.servo_lag_ms, 1.0, 200.0)?;
        within("arm.position_noise_rad", arm.position_noise_rad, 0.0, 0.1)?;
        within("arm.velocity_noise_rad_s", arm.velocity_noise_rad_s, 0.0, 1.0)?;
        within("arm.braking_rad_s2", arm.braking_rad_s2, 0.1, 100.0)?;
        within("arm.stops_above_n", arm.stops_above_n, 1.0, 1e4)?;
        within("arm.tool.mass_kg", arm.tool.mass_kg, 0.0, 20.0)?;
        for (axis, mm) in ["x", "y", "z"].iter().zip(arm.tool.centre_of_gravity_mm) {
            within(&format!("arm.tool.centre_of_gravity_mm.{axis}"), mm, -1000.0, 1000.0)?;
        }
        if let KinematicError::Figures { accuracy_mm, repeatability_mm } = arm.kinematic_error {
            within("arm.kinematic_error.accuracy_mm", accuracy_mm, 0.0, 20.0)?;
            within("arm.kinematic_error.repeatability_mm", repeatability_mm, 0.0, 5.0)?;
        }
        within("sensor.force_noise_n", self.sensor.force_noise_n, 0.0, 50.0)?;
        within("sensor.torque_noise_n_m", self.sensor.torque_noise_n_m, 0.0, 10.0)?;
        within("sensor.drift_n_min", self.sensor.drift_n_min, 0.0, 100.0)?;
        within("sensor.latency_ms", self.sensor.latency_ms, 0.0, 500.0)?;
        within("skin.softest_n_mm", skin.softest_n_mm, 0.01, 100.0)?;
        within("skin.hardest_n_mm", skin.hardest_n_mm, skin.softest_n_mm, 100.0)?;
        within("skin.bumps_mm", skin.bumps_mm, 0.0, 20.0)?;
        within("skin.bump_spacing_mm", skin.bump_spacing_mm, 5.0, 1000.0)?;
        within("skin.friction", skin.friction, 0.0, 2.0)?;
        within("skin.sliding_n_s_m", skin.sliding_n_s_m, 0.0, 1000.0)?;
        within("skin.pressing_n_s_m", skin.pressing_n_s_m, 0.0, 1000.0)?;
        within("skin.gel_mm", skin.gel_mm, 0.0, 20.0)?;
        within("hand.length_mm", hand.length_mm, 5.0, 400.0)?;
        within("hand.start_mm", hand.start_mm, -20.0, 400.0)?;
        within("hand.speed_mm_s", hand.speed_mm_s, 1.0, 250.0)?;
        within("hand.press_n", hand.press_n, 0.5, 30.0)?;
        within("hand.unsteadiness", hand.unsteadiness, 0.0, 10.0)?;
        within("hand.turn_deg", hand.turn_deg, -45.0, 45.0)?;
        within("hand.lean_deg", hand.lean_deg, -15.0, 15.0)?;
        for (field, value, low, high) in self.disturbance.numbers() {
            within(field, value, low, high)?;
        }
        machine.check()?;
        if let SubjectConfig::WirePhantom(wires) = &self.subject {
            tank::refuse(wires, within)?;
        }
        self.knobs.check()
    }
}

impl MachineConfig {
    fn check(&self) -> Result<(), CellError> {
        within("machine.rate_hz", self.rate_hz, 1.0, 200.0)?;
        within("machine.latency_ms", self.latency_ms, 0.0, 2000.0)?;
        within("machine.depth_mm", self.depth_mm, 10.0, 300.0)?;
        within("machine.focus_mm", self.focus_mm, 1.0, 300.0)?;
        within("machine.calibration_error_mm", self.calibration_error_mm, 0.0, 20.0)?;
        within("machine.calibration_error_deg", self.calibration_error_deg, 0.0, 20.0)?;
        let Window::Zoom { top_mm, height_mm } = self.window else { return Ok(()) };
        within("machine.window.zoom.top_mm", top_mm, 0.0, self.depth_mm)?;
        within("machine.window.zoom.height_mm", height_mm, 3.0, self.depth_mm - top_mm)
    }
}

impl Knobs {
    fn check(&self) -> Result<(), CellError> {
        let machine = &self.machine;
        within("knobs.machine.dropped", machine.dropped, 0.0, 1.0)?;
        within("knobs.machine.unknown_latency_ms", machine.unknown_latency_ms, -2000.0, 2000.0)?;
        within("knobs.machine.connection_lost_at_s", machine.connection_lost_at_s.unwrap_or(0.0), 0.0, 1e6)?;
        for (field, interval) in [("stall", machine.stall), ("frozen", machine.frozen)] {
            let Some(interval) = interval else { continue };
            within(&format!("knobs.machine.{field}.from_s"), interval.from_s, 0.0, 1e6)?;
            within(&format!("knobs.machine.{field}.lasts_s"), interval.lasts_s, 0.0, 1e6)?;
        }
        Ok(())
    }
}

fn within(field: &str, value: f64, low: f64, high: f64) -> Result<(), CellError> {
    // Written so that NaN is refused as well.
    if value >= low && value <= high {
        return Ok(());
    }
    Err(CellError::Config { field: field.into(), value, low, high })
}
