//! The cell's file.

use std::path::{Path, PathBuf};

use probepath_recon::Tracking;
use probepath_robot::drivers::Address;
use probepath_sim::CellConfig;
use probepath_us_capture::Calibration;
use serde::{Deserialize, Serialize};

use super::arm::ArmFile;
use super::line::{Wrong, line_of, positive, within};
use super::machine::{MachineAddress, MachineFile};
use super::phantom::PhantomFile;
use super::workspace::WorkspaceFile;
use crate::session::SessionError;

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
    /// The folder that the cell's file is in, for the files that it names.
    #[serde(skip)]
    pub folder: PathBuf,
    /// The arm: where it is, which one, and what it carries.
    pub arm: ArmFile,
    /// The ultrasound machine: where it is, and how it is set.
    pub machine: MachineFile,
    /// The phantom of wires on the table, for a cell on its wire.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phantom: Option<PhantomFile>,
    /// The arm's limits beyond its URDF.
    pub limits: LimitsFile,
    /// The force limits of the guard.
    pub force: ForceFile,
    /// How far above the table's top the face of the probe stays (mm).
    pub above_table_mm: f64,
    /// Where else the probe may not be.
    pub workspace: WorkspaceFile,
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
            folder: PathBuf::new(),
            arm: ArmFile::default(),
            machine: MachineFile::default(),
            phantom: None,
            limits: LimitsFile::default(),
            force: ForceFile::default(),
            above_table_mm: 20.0,
            workspace: WorkspaceFile::default(),
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
    /// What lies between grey 0 and 255 (dB), as the machine's panel says it.
    pub(in crate::session) fn dynamic_range_db(&self) -> Option<f64> {
        match self.machine.address {
            MachineAddress::Sim => Some(self.simulated.machine.imaging.dynamic_range_db),
            MachineAddress::Igtl { .. } => self.machine.dynamic_range_db,
            MachineAddress::None => None,
        }
    }

    /// How well the arm knows where the probe is, as its data sheet says it.
    pub(in crate::session) fn tracking(&self) -> Option<Tracking> {
        match self.arm.address {
            Address::Simulated => {
                let (accuracy_mm, repeatability_mm) = self.simulated.arm.kinematic_error.sheet_mm();
                Some(Tracking { accuracy_m: accuracy_mm * 1e-3, repeatability_m: repeatability_mm * 1e-3 })
            }
            Address::Ur { .. } => self.arm.tracking().ok().flatten(),
        }
    }

    /// The simulated bench with a phantom of wires in water.
    pub fn wire_phantom() -> Self {
        let simulated = CellConfig::wire_phantom();
        Self { name: "simulated calibration bench".into(), simulated, ..Self::default() }
    }

    /// Whether arm and machine are simulated in this process.
    pub fn is_simulated(&self) -> bool {
        self.arm.address == Address::Simulated
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
        let folder = path.parent().unwrap_or_else(|| Path::new("")).to_owned();
        Self { folder, ..file }.with_calibration()
    }

    /// With the calibration that it names, from its folder.
    pub(super) fn with_calibration(self) -> Result<Self, SessionError> {
        let Some(path) = self.calibration.as_ref().map(|path| self.folder.join(path)) else {
            return Ok(self);
        };
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
        let refused = |why: String| SessionError::Cell { file: name.into(), why };
        let file: Self = toml::from_str(text).map_err(|e| refused(e.to_string()))?;
        file.check().map_err(|wrong| refused(wrong.told(text)))?;
        if let (false, Some(line)) = (file.is_simulated(), line_of(text, "simulated")) {
            return Err(refused(format!(
                "line {line}: [simulated] describes a cell that is simulated in this process, and the arm's address is \
                 \"{}\": leave one of them out",
                file.arm.address
            )));
        }
        Ok(file)
    }

    /// Every number has to be one that a guard can keep.
    fn check(&self) -> Result<(), Wrong> {
        positive("limits.acceleration_rad_s2", self.limits.acceleration_rad_s2)?;
        positive("limits.jerk_rad_s3", self.limits.jerk_rad_s3)?;
        positive("limits.velocity_share", self.limits.velocity_share)?;
        within("limits.velocity_share", self.limits.velocity_share, (0.0, 1.0), "of the URDF's velocities")?;
        positive("force.soft_n", self.force.soft_n)?;
        positive("force.hard_n", self.force.hard_n - self.force.soft_n).map_err(|_| {
            let (hard_n, soft_n) = (self.force.hard_n, self.force.soft_n);
            Wrong::new(
                "force.hard_n",
                format!("is {hard_n}; it must be above force.soft_n, which is {soft_n}"),
            )
        })?;
        within("above_table_mm", self.above_table_mm, (-1e4, 1e4), "mm")?;
        self.arm.check()?;
        self.machine.check()?;
        self.workspace.check()?;
        self.phantom.as_ref().map_or(Ok(()), PhantomFile::check)?;
        self.together()
    }

    /// A machine that is simulated in this process sees only an arm that is.
    fn together(&self) -> Result<(), Wrong> {
        let (arm, machine) = (&self.arm.address, &self.machine.address);
        if let (Address::Simulated, Some(_)) = (arm, &self.phantom) {
            let why = "is given, and the arm's address is \"sim\": the phantom of a cell that is simulated in this process \
                       is described under [simulated.subject.wire_phantom]";
            return Err(Wrong::new("phantom", why));
        }
        let why = match (arm, machine) {
            (Address::Ur { .. }, MachineAddress::Sim) => {
                "is \"sim\", and the arm's is not: a machine simulated in this process cannot see an arm on its wire; \
                 write \"igtl://host\" (`probepath simulate` serves one beside its arm), or \"none\""
            }
            (Address::Simulated, MachineAddress::Igtl { .. }) => {
                "is on its wire, and the arm is simulated in this process, where time is simulated: they never meet"
            }
            _ => return Ok(()),
        };
        Err(Wrong::new("machine.address", why))
    }

    /// The file's text, as the exam keeps it.
    ///
    /// # Errors
    /// When it cannot be written as TOML.
    pub fn text(&self) -> Result<String, SessionError> {
        let wrong = |why: String| SessionError::Cell { file: "cell".into(), why };
        if self.is_simulated() {
            return toml::to_string(self).map_err(|e| wrong(e.to_string()));
        }
        let mut table = toml::Table::try_from(self).map_err(|e| wrong(e.to_string()))?;
        table.remove("simulated");
        toml::to_string(&table).map_err(|e| wrong(e.to_string()))
    }
}
