//! The cell: its file, and the arm, the machine and the facts that come from it.

mod arm;
mod file;
mod line;
mod machine;
mod phantom;
mod pose;
mod served;
mod workspace;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Direction, Image, Point, Pose, Probe, Span, World};
use probepath_robot::drivers::Address;
use probepath_robot::drivers::ur::{UrArm, UrSettings};
use probepath_robot::{
    Face, Guard, GuardLimits, Joints, Model, MotionLimits, Operator, Plane, Tilt, Tool, Workspace,
    ZeroSettings, ZeroWatch, probe_place,
};
use probepath_sim::SimulatedCell;
use probepath_us_capture::exam::Pace;
use probepath_us_capture::igtl::{IgtlSettings, IgtlSource, Wait};
use probepath_us_capture::{BScanSource, Calibration, CalibrationError, Setting};

pub use arm::{ArmFile, ControllerTime};
pub use file::{CellFile, ForceFile, LimitsFile, StoredCalibration};
pub use machine::{IGTL_PORT, MachineAddress, MachineClock, MachineFile};
pub use phantom::PhantomFile;
pub use pose::PoseFile;
pub use workspace::{BoxFile, PlaneFile, WorkspaceFile};

use super::SessionError;
use super::bedside::{Bedside, SimulatedBedside};
use super::recorder::Facts;
use phantom::OnTable;

/// A connected cell: what moves, what sees, and what is known about both.
pub(super) struct Cell {
    pub(super) file: CellFile,
    pub(super) arm: Box<dyn Bedside>,
    /// The ultrasound machine, where there is one.
    pub(super) machine: Option<Box<dyn BScanSource + Send>>,
    pub(super) facts: Facts,
    pub(super) limits: MotionLimits,
    /// None where there is no machine.
    pub(super) calibration: Option<Calibration>,
    pub(super) urdf: String,
    /// From the echoes to the arrival of a B-scan, as the cell's file says it.
    pub(super) image_latency: Span,
    /// The wire phantom on the table, where there is one, as its drawing and a tape measure have it.
    pub(super) bench: Option<OnTable>,
    /// The simulated cell behind arm and machine, where they are simulated in this process: its truth is asked after
    /// the reconstruction.
    pub(super) simulated: Option<SimulatedCell>,
    /// Whether the arm waits while the disk is slow.
    pub(super) pace: Pace,
}

/// What is known of a cell before anything is connected.
struct Described {
    facts: Facts,
    urdf: String,
    /// How the machine is set, and where its image is on the probe before anybody calibrated; none where there is no
    /// machine.
    image: Option<(Setting, Pose<Probe, Image>)>,
    image_latency: Span,
    bench: Option<OnTable>,
}

impl Described {
    /// What the simulated cell's file says.
    fn simulated(file: &CellFile, simulated: &SimulatedCell) -> Self {
        let nominal = simulated.nominal();
        let image = (nominal.setting, nominal.probe_from_image(&nominal.setting));
        Self {
            facts: Facts {
                model: nominal.model().clone(),
                world_from_base: nominal.world_from_base,
                flange_from_probe: nominal.flange_from_probe,
            },
            urdf: nominal.urdf.to_owned(),
            image: (file.machine.address != MachineAddress::None).then_some(image),
            image_latency: nominal.image_latency,
            bench: nominal.bench.clone().map(|bench| OnTable {
                phantom: bench.phantom,
                world_from_phantom: bench.world_from_phantom,
                water_celsius: bench.water_celsius,
            }),
        }
    }

    /// What the file of a cell on its wire says; `urdf` is the model's text, where it need not be read.
    fn on_its_wire(file: &CellFile, urdf: Option<&str>) -> Result<Self, SessionError> {
        let refused = |why: String| SessionError::Cell { file: file.name.clone(), why };
        let recorded = urdf.is_some();
        let places = file.arm.places().map_err(|wrong| refused(wrong.told("")))?;
        let (model, urdf) = file.arm.model(urdf, &file.folder).map_err(|error| refused(error.to_string()))?;
        let setting = file.machine.setting.map(|setting| setting.metres());
        // A recording needs none, and the drawing may be elsewhere by now.
        let phantom = file.phantom.as_ref().filter(|_| !recorded);
        let bench = phantom.map(|phantom| phantom.on_table(&file.folder)).transpose();
        let bench = bench.map_err(|wrong| refused(wrong.told("")))?;
        Ok(Self {
            facts: Facts {
                model,
                world_from_base: places.world_from_base,
                flange_from_probe: places.flange_from_probe,
            },
            urdf,
            image: setting.map(|setting| (setting, as_drawn(&setting))),
            image_latency: Span::from_seconds(file.machine.latency_ms.unwrap_or_default() * 1e-3),
            bench,
        })
    }
}

/// Connects to a UR controller.
fn ur(file: &CellFile, host: &str, facts: &Facts) -> Result<UrArm, SessionError> {
    Ok(UrArm::connect(host, ur_settings(file, facts)?)?)
}

/// What a UR controller is told.
fn ur_settings(file: &CellFile, facts: &Facts) -> Result<UrSettings, SessionError> {
    let refused = |wrong: line::Wrong| SessionError::Cell { file: file.name.clone(), why: wrong.told("") };
    let carried = file.arm.carried().map_err(refused)?;
    let centre = Vector3::from(carried.centre_of_gravity_m);
    let usual = UrSettings::new(facts.model.clone(), facts.flange_from_probe, carried.payload_kg, centre);
    // The robot's own watchdog waits no less than our guard does: whichever is first, the arm stops.
    let heartbeat = file.arm.heartbeat_ms.map_or(Span::ZERO, |ms| Span::from_seconds(ms * 1e-3));
    let watchdog = usual.watchdog.max(heartbeat);
    Ok(UrSettings { stepped: file.arm.time == ControllerTime::Simulated, watchdog, ..usual })
}

/// Connects to an ultrasound machine.
fn igtl(file: &CellFile, host: &str, port: u16, setting: Setting) -> Result<IgtlSource, SessionError> {
    let (host, device) = (host.to_owned(), file.machine.device.clone());
    let clock = file.machine.clock.unwrap_or_default().of_stamps();
    let wait = if file.arm.time == ControllerTime::Simulated { Wait::ForMarks } else { Wait::Never };
    Ok(IgtlSource::connect(IgtlSettings { host, port, device, setting, clock, wait })?)
}

/// Where the image is on the probe by the holder's drawing: its middle column under the middle of the face, rows along
/// the beam.
fn as_drawn(setting: &Setting) -> Pose<Probe, Image> {
    let left_m = (setting.spacing.x_m - setting.window_width_m) / 2.0;
    let first = Translation3::new(left_m, 0.0, setting.window_top_m + setting.spacing.y_m / 2.0);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    // FRAMES: Image x is Probe x, Image y is Probe z, so Image z is -Probe y; the origin is the first pixel's centre.
    Pose::assume(Isometry3::from_parts(first, turn))
}

impl Cell {
    /// Connects.
    ///
    /// # Errors
    /// When the simulated cell cannot be built, the arm or the machine cannot be reached, the limits cannot be kept, or
    /// the calibration that the file names belongs to another setting of the machine.
    pub(super) fn connect(file: &CellFile, seed: u64) -> Result<Self, SessionError> {
        match &file.arm.address {
            Address::Simulated => Self::simulated(file, seed),
            Address::Ur { host } => Self::on_its_wire(file, host),
        }
    }

    /// The arm of a cell, and nothing else of it.
    pub(super) fn arm_alone(file: &CellFile) -> Result<Box<dyn Bedside>, SessionError> {
        match &file.arm.address {
            Address::Simulated => {
                Ok(Box::new(SimulatedBedside::new(&SimulatedCell::new(&file.simulated, 1)?)))
            }
            Address::Ur { host } => Ok(Box::new(ur(file, host, &Described::on_its_wire(file, None)?.facts)?)),
        }
    }

    /// The arm of a cell on its wire after it stopped by itself: unlocked on a person's word, and connected; with what was
    /// done, in words.
    pub(super) fn arm_released(file: &CellFile) -> Result<(UrArm, Facts, String), SessionError> {
        let Address::Ur { host } = &file.arm.address else {
            return Err(SessionError::Order("only an arm on its wire can be unlocked"));
        };
        let facts = Described::on_its_wire(file, None)?.facts;
        let arm = UrArm::connect_released(host, ur_settings(file, &facts)?)?;
        let version = arm.report().version;
        Ok((arm, facts, format!("The controller (PolyScope {version}) is unlocked, and lets the arm move.")))
    }

    /// The cell that an exam was recorded in, its recording in place of arm and machine; `urdf` is the exam's.
    ///
    /// # Errors
    /// As [`Self::connect`], but nothing is reached.
    pub(super) fn recorded(
        file: &CellFile,
        seed: u64,
        urdf: Option<&str>,
        arm: Box<dyn Bedside>,
        machine: Box<dyn BScanSource + Send>,
    ) -> Result<Self, SessionError> {
        let machine = (file.machine.address != MachineAddress::None).then_some(machine);
        if file.is_simulated() {
            let simulated = SimulatedCell::new(&file.simulated, seed)?;
            return Self::of(file, Described::simulated(file, &simulated), arm, machine, Some(simulated));
        }
        Self::of(file, Described::on_its_wire(file, urdf)?, arm, machine, None)
    }

    /// A cell whose arm, and machine if there is one, are reached over their wires.
    fn on_its_wire(file: &CellFile, host: &str) -> Result<Self, SessionError> {
        let described = Described::on_its_wire(file, None)?;
        // The machine first: the arm is the one that would stand there waiting.
        let machine = match (&file.machine.address, described.image) {
            (MachineAddress::Igtl { host, port }, Some((setting, _))) => {
                Some(Box::new(igtl(file, host, *port, setting)?) as Box<dyn BScanSource + Send>)
            }
            _ => None,
        };
        let arm = Box::new(ur(file, host, &described.facts)?);
        let cell = Self::of(file, described, arm, machine, None)?;
        let pace = if file.arm.time == ControllerTime::Wall { Pace::RealTime } else { Pace::Simulated };
        Ok(Self { pace, ..cell })
    }

    /// The cell that is simulated in this process.
    fn simulated(file: &CellFile, seed: u64) -> Result<Self, SessionError> {
        let simulated = SimulatedCell::new(&file.simulated, seed)?;
        let machine = || -> Box<dyn BScanSource + Send> { Box::new(simulated.machine()) };
        let machine = (file.machine.address != MachineAddress::None).then(machine);
        let arm = Box::new(SimulatedBedside::new(&simulated));
        Self::of(file, Described::simulated(file, &simulated), arm, machine, Some(simulated))
    }

    fn of(
        file: &CellFile,
        described: Described,
        arm: Box<dyn Bedside>,
        machine: Option<Box<dyn BScanSource + Send>>,
        simulated: Option<SimulatedCell>,
    ) -> Result<Self, SessionError> {
        let limits = motion_limits(&described.facts.model, &file.limits)?;
        let calibration = described.image.map(|image| calibration(file, image)).transpose()?;
        let Described { facts, urdf, image_latency, bench, .. } = described;
        let file = file.clone();
        let pace = Pace::Simulated;
        Ok(Self {
            file,
            arm,
            machine,
            facts,
            limits,
            calibration,
            urdf,
            image_latency,
            bench,
            simulated,
            pace,
        })
    }

    /// The calibration of the machine.
    ///
    /// # Errors
    /// When there is no machine.
    pub(super) fn calibrated(&self) -> Result<&Calibration, SessionError> {
        self.calibration.as_ref().ok_or(SessionError::NoMachine)
    }

    /// The guard of this cell: joints, forces, and the probe above the table.
    pub(super) fn guard(&self, operator: &Operator) -> Result<Guard, SessionError> {
        let wrong =
            |e: probepath_robot::LimitsError| SessionError::Cell { file: "cell".into(), why: e.to_string() };
        let place = probe_place(self.facts.model.clone(), self.facts.flange_from_probe);
        Ok(Guard::new(self.guard_limits(), self.limits)
            .map_err(wrong)?
            .within(self.workspace(), place)
            .leaning_at_most(self.tilt())
            .pressing_with(Face::default())
            .listening_to(operator.clone()))
    }

    /// Above the table and within what the file says, with room to brake.
    pub(super) fn workspace(&self) -> Workspace {
        let base_from_world = self.facts.world_from_base.inverse();
        let above = Point::<World>::new(0.0, -self.file.above_table_mm * 1e-3, 0.0);
        let up = Direction::<World>::y().reversed();
        let table = Plane { through: base_from_world * above, inward: base_from_world * up };
        self.file.workspace.with(Workspace::new().and(table), &base_from_world)
    }

    /// Where things fall to.
    pub(super) fn down(&self) -> Direction<Base> {
        self.facts.world_from_base.inverse() * Direction::<World>::y()
    }

    /// A watch over the force sensor's zero, for a tool that hangs on it.
    pub(super) fn zero_watch(&self, tool: Tool) -> ZeroWatch {
        ZeroWatch::new(tool, self.down(), ZeroSettings::default(), self.arm.period())
    }

    /// How far the probe may lean over.
    fn tilt(&self) -> Tilt {
        let usual = Tilt::around(self.down());
        let most_rad = self.file.workspace.tilt_deg.map_or(usual.most_rad, f64::to_radians);
        Tilt { most_rad, ..usual }
    }

    /// What the guard watches for while the arm moves by itself.
    pub(super) fn guard_limits(&self) -> GuardLimits {
        self.as_the_file_says(GuardLimits {
            force_soft_n: self.file.force.soft_n,
            force_hard_n: self.file.force.hard_n,
            ..GuardLimits::default()
        })
    }

    /// Limits of whatever motion, as old as this cell's states may be.
    pub(super) fn as_the_file_says(&self, limits: GuardLimits) -> GuardLimits {
        let heartbeat =
            self.file.arm.heartbeat_ms.map_or(limits.heartbeat, |ms| Span::from_seconds(ms * 1e-3));
        GuardLimits { heartbeat, ..limits }
    }
}

/// The calibration that scans use: the stored one that the file names, or the nominal one.
fn calibration(
    file: &CellFile,
    (setting, probe_from_image): (Setting, Pose<Probe, Image>),
) -> Result<Calibration, SessionError> {
    let read = || file.clone().with_calibration();
    let file = if file.stored.is_none() { &read()? } else { file };
    let Some(StoredCalibration { path, calibration }) = &file.stored else {
        return Ok(nominal_calibration(file, setting, probe_from_image));
    };
    calibration.check_setting(&setting).map_err(|source| SessionError::CellCalibration {
        cell: file.name.clone(),
        path: path.clone(),
        source,
    })?;
    Ok(calibration.clone())
}

/// What is known before anybody calibrated.
fn nominal_calibration(
    file: &CellFile,
    setting: Setting,
    probe_from_image: Pose<Probe, Image>,
) -> Calibration {
    // What the cell's file says of the calibration it gives; nobody has measured it.
    let simulated_mm = file.simulated.machine.calibration_error_mm;
    Calibration {
        id: "nominal".into(),
        date: "none".into(),
        phantom: "none: the holder's drawing".into(),
        probe_from_image,
        setting,
        image_lag: nominal_lag(&file.machine),
        error: CalibrationError {
            rms_mm: file.machine.holder_error_mm.unwrap_or(simulated_mm),
            sd_mm: 0.0,
            held_out: false,
        },
        quality: None,
    }
}

/// What is known of the lag before anybody calibrated: a machine's own clock is brought to the arm's by when B-scans
/// arrive, so that a B-scan is stamped as late as it is under way.
fn nominal_lag(machine: &MachineFile) -> Span {
    match (&machine.address, machine.clock.unwrap_or_default()) {
        (MachineAddress::Igtl { .. }, MachineClock::Own) => {
            Span::from_seconds(-machine.latency_ms.unwrap_or_default() * 1e-3)
        }
        _ => Span::ZERO,
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
