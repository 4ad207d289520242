//! The cell: its file, and the arm, the machine and the facts that come from it.

use std::path::{Path, PathBuf};

use probepath_frames::{Direction, Point, Span, World};
use probepath_robot::{
    Arm, Guard, GuardLimits, Joints, Model, MotionLimits, Operator, Plane, Workspace, probe_place,
};
use probepath_sim::{Bench, CellConfig, Nominal, SimulatedCell};
use probepath_us_capture::{BScanSource, Calibration, CalibrationError};
use serde::{Deserialize, Serialize};

use super::SessionError;
use super::recorder::Facts;

/// What a cell file says. Everything has a default, so that an empty file is the simulated cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CellFile {
    /// The cell's name, for the report.
    pub name: String,
    /// A stored calibration of this machine's setting, relative to the cell file's folder; without one the nominal one
    /// is used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// What that file holds, once it was read ([`CellFile::read`]).
    #[serde(skip)]
    pub stored: Option<StoredCalibration>,
    /// The arm's limits beyond its URDF.
    pub limits: LimitsFile,
    /// The force limits of the guard.
    pub force: ForceFile,
    /// How far above the table's top the face of the probe stays (mm).
    pub above_table_mm: f64,
    /// The simulated cell that stands in for arm, leg and ultrasound machine.
    pub simulated: CellConfig,
}

/// A calibration that a cell names.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredCalibration {
    /// Where it was read from.
    pub path: PathBuf,
    /// What is in it.
    pub calibration: Calibration,
}

/// Joint limits that no URDF holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LimitsFile {
    /// Largest joint acceleration (rad/s²).
    pub acceleration_rad_s2: f64,
    /// Largest joint jerk (rad/s³).
    pub jerk_rad_s3: f64,
    /// Share of the URDF's joint velocities that is used, 0 to 1.
    pub velocity_share: f64,
}

/// Forces at which the guard acts (`FIELD.md` section 10).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForceFile {
    /// Above it the probe yields (N).
    pub soft_n: f64,
    /// Above it the arm stops (N).
    pub hard_n: f64,
}

impl Default for CellFile {
    fn default() -> Self {
        Self {
            name: "simulated cell".into(),
            calibration: None,
            stored: None,
            limits: LimitsFile::default(),
            force: ForceFile::default(),
            above_table_mm: 20.0,
            simulated: CellConfig::default(),
        }
    }
}

impl Default for LimitsFile {
    fn default() -> Self {
        Self { acceleration_rad_s2: 10.0, jerk_rad_s3: 200.0, velocity_share: 0.5 }
    }
}

impl Default for ForceFile {
    fn default() -> Self {
        Self { soft_n: 10.0, hard_n: 15.0 }
    }
}

impl CellFile {
    /// The simulated bench with a phantom of wires in water.
    pub fn wire_phantom() -> Self {
        let simulated = CellConfig::wire_phantom();
        Self { name: "simulated calibration bench".into(), simulated, ..Self::default() }
    }

    /// The cell of a file.
    ///
    /// # Errors
    /// When it cannot be read, is no TOML, or has a field that no cell has; the error names the line. When the calibration
    /// that it names cannot be read.
    pub fn read(path: &Path) -> Result<Self, SessionError> {
        let text = std::fs::read_to_string(path).map_err(|source| SessionError::File {
            doing: "read the cell file",
            path: path.into(),
            source,
        })?;
        let file = Self::parse(&text, &path.display().to_string())?;
        file.with_calibration(path.parent().unwrap_or_else(|| Path::new("")))
    }

    /// With the calibration that it names, from a folder.
    fn with_calibration(self, folder: &Path) -> Result<Self, SessionError> {
        let Some(path) = self.calibration.as_ref().map(|path| folder.join(path)) else { return Ok(self) };
        match Calibration::read(&path) {
            Ok(calibration) => Ok(Self { stored: Some(StoredCalibration { path, calibration }), ..self }),
            Err(source) => Err(SessionError::CellCalibration { cell: self.name, path, source }),
        }
    }

    /// The cell of a text; `name` is for messages. A calibration that it names is read when a session connects, from the
    /// folder that the program runs in.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(text: &str, name: &str) -> Result<Self, SessionError> {
        let file: Self =
            toml::from_str(text).map_err(|e| SessionError::Cell { file: name.into(), why: e.to_string() })?;
        file.check(name)?;
        Ok(file)
    }

    /// Every number has to be one that a guard can keep.
    fn check(&self, name: &str) -> Result<(), SessionError> {
        let positive = [
            ("limits.acceleration_rad_s2", self.limits.acceleration_rad_s2),
            ("limits.jerk_rad_s3", self.limits.jerk_rad_s3),
            ("limits.velocity_share", self.limits.velocity_share),
            ("force.soft_n", self.force.soft_n),
            ("force.hard_n - force.soft_n", self.force.hard_n - self.force.soft_n),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                let why = format!("{field} is {value}; it must be positive and finite");
                return Err(SessionError::Cell { file: name.into(), why });
            }
        }
        if self.limits.velocity_share > 1.0 || !self.above_table_mm.is_finite() {
            let why = "limits.velocity_share is at most 1, and above_table_mm a finite number".to_owned();
            return Err(SessionError::Cell { file: name.into(), why });
        }
        Ok(())
    }

    /// The file's text, as the exam keeps it.
    ///
    /// # Errors
    /// When it cannot be written as TOML.
    pub fn text(&self) -> Result<String, SessionError> {
        toml::to_string(self).map_err(|e| SessionError::Cell { file: "cell".into(), why: e.to_string() })
    }
}

/// A connected cell: what moves, what sees, and what is known about both.
pub(super) struct Cell {
    pub(super) file: CellFile,
    pub(super) arm: Box<dyn Arm + Send>,
    pub(super) machine: Box<dyn BScanSource + Send>,
    pub(super) facts: Facts,
    pub(super) limits: MotionLimits,
    pub(super) calibration: Calibration,
    pub(super) urdf: String,
    /// The wire phantom on the table, where there is one, as its drawing and a tape measure have it.
    pub(super) bench: Option<Bench>,
    /// The simulated cell behind arm and machine: its hand teaches, its truth is asked after the reconstruction.
    pub(super) simulated: SimulatedCell,
}

impl Cell {
    /// Connects.
    ///
    /// # Errors
    /// When the simulated cell cannot be built, the limits cannot be kept, or the calibration that the file names belongs
    /// to another setting of the machine.
    pub(super) fn connect(file: &CellFile, seed: u64) -> Result<Self, SessionError> {
        let simulated = SimulatedCell::new(&file.simulated, seed)?;
        let nominal = simulated.nominal();
        let facts = Facts {
            model: nominal.model().clone(),
            world_from_base: nominal.world_from_base,
            flange_from_probe: nominal.flange_from_probe,
        };
        let limits = motion_limits(&facts.model, &file.limits)?;
        let calibration = calibration(file, nominal)?;
        Ok(Self {
            file: file.clone(),
            arm: Box::new(simulated.arm()),
            machine: Box::new(simulated.machine()),
            urdf: nominal.urdf.to_owned(),
            bench: nominal.bench.clone(),
            facts,
            limits,
            calibration,
            simulated,
        })
    }

    /// The guard of this cell: joints, forces, and the probe above the table.
    pub(super) fn guard(&self, operator: &Operator) -> Result<Guard, SessionError> {
        let wrong =
            |e: probepath_robot::LimitsError| SessionError::Cell { file: "cell".into(), why: e.to_string() };
        let place = probe_place(self.facts.model.clone(), self.facts.flange_from_probe);
        Ok(Guard::new(self.guard_limits(), self.limits)
            .map_err(wrong)?
            .within(self.workspace(), place)
            .listening_to(operator.clone()))
    }

    /// Above the table, with room to brake.
    pub(super) fn workspace(&self) -> Workspace {
        let base_from_world = self.facts.world_from_base.inverse();
        let above = Point::<World>::new(0.0, -self.file.above_table_mm * 1e-3, 0.0);
        let up = Direction::<World>::y().reversed();
        Workspace::new().and(Plane { through: base_from_world * above, inward: base_from_world * up })
    }

    /// What the guard watches for while the arm moves by itself.
    pub(super) fn guard_limits(&self) -> GuardLimits {
        GuardLimits {
            force_soft_n: self.file.force.soft_n,
            force_hard_n: self.file.force.hard_n,
            ..GuardLimits::default()
        }
    }
}

/// The calibration that scans use: the stored one that the file names, or the nominal one.
fn calibration(file: &CellFile, nominal: &Nominal) -> Result<Calibration, SessionError> {
    let read = || file.clone().with_calibration(Path::new(""));
    let file = if file.stored.is_none() { &read()? } else { file };
    let Some(StoredCalibration { path, calibration }) = &file.stored else {
        return Ok(nominal_calibration(file, nominal));
    };
    calibration.check_setting(&nominal.setting).map_err(|source| SessionError::CellCalibration {
        cell: file.name.clone(),
        path: path.clone(),
        source,
    })?;
    Ok(calibration.clone())
}

/// What is known before anybody calibrated.
fn nominal_calibration(file: &CellFile, nominal: &Nominal) -> Calibration {
    Calibration {
        id: "nominal".into(),
        date: "none".into(),
        phantom: "none: the holder's drawing".into(),
        probe_from_image: nominal.probe_from_image(&nominal.setting),
        setting: nominal.setting,
        image_lag: Span::ZERO,
        error: CalibrationError {
            // What the cell's file says of the calibration it gives; nobody has measured it.
            rms_mm: file.simulated.machine.calibration_error_mm,
            sd_mm: 0.0,
            held_out: false,
        },
        quality: None,
    }
}

/// The limits of every command: the URDF's, and the file's for what no URDF holds.
fn motion_limits(model: &Model, file: &LimitsFile) -> Result<MotionLimits, SessionError> {
    let n = model.joints();
    let mut limits = MotionLimits {
        lower: Joints::zeros(n),
        upper: Joints::zeros(n),
        velocity: Joints::zeros(n),
        acceleration: Joints::splat(n, file.acceleration_rad_s2),
        jerk: Joints::splat(n, file.jerk_rad_s3),
    };
    for (i, joint) in model.limits().iter().enumerate() {
        limits.lower[i] = joint.lower;
        limits.upper[i] = joint.upper;
        limits.velocity[i] = joint.velocity * file.velocity_share;
    }
    limits
        .check()
        .map_err(|e| SessionError::Cell { file: "the cell's [limits]".into(), why: e.to_string() })?;
    Ok(limits)
}

#[cfg(test)]
mod tests;
