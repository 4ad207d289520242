//! `probepath simulate`: the simulated cell, served on its real protocols.

use std::fmt;
use std::net::IpAddr;
use std::path::{Path, PathBuf};

use probepath_robot::realtime::{Figures, Grant};
use probepath_sim::controller::{
    ControllerConfig, ControllerError, ControllerServer, Counters, Ports, Running, Time,
};
use probepath_sim::igtl::{self, MachineServer, MachineServerConfig, MachineServerError, Sent};
use probepath_sim::{CellError, SimulatedCell};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::session::{CellFile, ControllerTime, IGTL_PORT, SessionError};

/// What is to be served, and where.
#[derive(Clone, Debug)]
pub struct SimulateRequest {
    /// The cell's file; the simulated leg when absent.
    pub cell: Option<PathBuf>,
    /// The cell's seed.
    pub seed: u64,
    /// The address to listen on.
    pub host: IpAddr,
    /// Whether the clock is the client's packages instead of the wall's.
    pub simulated_time: bool,
    /// Where to write the cell file with which it is scanned over the wire.
    pub write_cell: Option<PathBuf>,
}

/// A cell that is being served, until this is dropped.
#[derive(Debug, Serialize)]
pub struct Simulating {
    /// The cell's name.
    pub cell: String,
    /// Its seed.
    pub seed: u64,
    /// The address.
    pub host: IpAddr,
    /// `wall` or `simulated`.
    pub time: Time,
    /// What is served at which port.
    pub ports: Vec<ServedPort>,
    /// What a client has to know of the arm.
    pub arm: ServedArm,
    #[serde(skip)]
    running: Running,
    #[serde(skip)]
    machine: igtl::Running,
}

/// One port.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ServedPort {
    /// Its number.
    pub port: u16,
    /// What answers there.
    pub what: &'static str,
}

/// What a client has to know of the arm to measure forces with it.
#[derive(Clone, Debug, Serialize)]
pub struct ServedArm {
    /// What it carries (kg).
    pub payload_kg: f64,
    /// Where that has its centre of gravity on the flange (mm).
    pub centre_of_gravity_mm: [f64; 3],
    /// Where the probe's face is on the flange: place (mm).
    pub probe_on_flange_mm: [f64; 3],
    /// And turn about the flange's axes (rotation vector, degrees).
    pub probe_on_flange_deg: [f64; 3],
}

/// Why nothing is served.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// The cell's file.
    #[error(transparent)]
    File(#[from] SessionError),
    /// The cell.
    #[error("the simulated cell cannot be built: {0}")]
    Cell(#[from] CellError),
    /// The controller.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// The ultrasound machine.
    #[error(transparent)]
    Machine(#[from] MachineServerError),
    /// The cell file that was to be written.
    #[error("cannot write the cell file {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Serves a cell.
///
/// # Errors
/// When its file cannot be read, it cannot be built, or a port is taken.
pub fn simulate(request: &SimulateRequest) -> Result<Simulating, SimulateError> {
    let file = request.cell.as_deref().map_or_else(|| Ok(CellFile::default()), CellFile::read)?;
    let cell = SimulatedCell::new(&file.simulated, request.seed)?;
    let time = if request.simulated_time { Time::Simulated } else { Time::Wall };
    let arm = described(&cell);
    if let Some(path) = &request.write_cell {
        write_cell(&file.name, &cell, request, path)?;
    }
    let host = request.host;
    // A cell may be served for days.
    let remembers_s = Some(REMEMBERS_S);
    let running = ControllerServer::start(
        cell.clone(),
        ControllerConfig { host, time, remembers_s, ..ControllerConfig::default() },
    )?;
    let machine = MachineServer::start(&cell, MachineServerConfig { host, time, ..Default::default() })?;
    let ports = PORTS.map(|(port, what)| ServedPort { port, what }).to_vec();
    Ok(Simulating { cell: file.name, seed: request.seed, host, time, ports, arm, running, machine })
}

/// The file with which whoever comes over the wire scans the cell.
fn write_cell(
    name: &str,
    cell: &SimulatedCell,
    request: &SimulateRequest,
    path: &Path,
) -> Result<(), SimulateError> {
    let time = if request.simulated_time { ControllerTime::Simulated } else { ControllerTime::Wall };
    let text = CellFile::of_served(&format!("{name} on its wire"), cell, request.host, time).text()?;
    std::fs::write(path, text).map_err(|source| SimulateError::Write { path: path.into(), source })
}

/// How much of what truly was is kept (s).
const REMEMBERS_S: f64 = 120.0;

const PORTS: [(u16, &str); 6] = [
    (Ports::RTDE, "RTDE: real-time data, 500 Hz"),
    (Ports::DASHBOARD, "dashboard: power, brakes, protective stops, popups"),
    (Ports::PRIMARY, "primary: version, messages, scripts"),
    (Ports::SECONDARY, "secondary: version, messages, scripts"),
    (Ports::REALTIME, "scripts"),
    (IGTL_PORT, "OpenIGTLink: B-scans"),
];

fn described(cell: &SimulatedCell) -> ServedArm {
    let tool = cell.config().arm.tool;
    let probe = cell.nominal().flange_from_probe;
    let turn = probe.isometry().rotation.scaled_axis();
    ServedArm {
        payload_kg: tool.mass_kg,
        centre_of_gravity_mm: tool.centre_of_gravity_mm,
        probe_on_flange_mm: (probe.origin().vector() * 1e3).into(),
        probe_on_flange_deg: [turn.x.to_degrees(), turn.y.to_degrees(), turn.z.to_degrees()],
    }
}

/// What happened while a cell was served.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Served {
    /// The controller: ticks, packages, scripts.
    pub controller: Counters,
    /// The ultrasound machine.
    pub machine: Sent,
    /// Whether the system let the controller's ticks run before all other work of this computer.
    pub scheduling: Grant,
    /// From when a tick was due by the wall's clock until it began.
    pub ticks_begun: Option<Figures>,
    /// From when a tick was due until its package had left.
    pub packages_left: Option<Figures>,
}

impl Simulating {
    /// What happened so far.
    pub fn so_far(&self) -> Served {
        let late = self.running.punctuality();
        Served {
            controller: self.running.counters(),
            machine: self.machine.sent(),
            scheduling: self.running.scheduling(),
            ticks_begun: late.begun.figures(),
            packages_left: late.left.figures(),
        }
    }
}

impl fmt::Display for Served {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { controller: all, machine: sent, .. } = self;
        writeln!(
            f,
            "served {} ticks, {} packages and {} scripts to {} RTDE clients; {} packages were skipped, the clock fell \
             behind the machine's {} times; {} B-scans left, {} were too old to",
            all.ticks,
            all.packages,
            all.scripts,
            all.rtde_clients,
            all.skipped,
            all.slips,
            sent.pictures,
            sent.stale
        )?;
        writeln!(f, "before all other work of this computer: {}", self.scheduling)?;
        let late = |figures: &Option<Figures>| figures.map_or("never".into(), |late| late.to_string());
        write!(
            f,
            "ticks begun late: {}\npackages left late: {}",
            late(&self.ticks_begun),
            late(&self.packages_left)
        )
    }
}

impl fmt::Display for Simulating {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = match self.time {
            Time::Wall => "500 Hz by the wall's clock",
            Time::Simulated => "a tick for each package of its client",
        };
        writeln!(f, "{} (seed {}), a simulated UR5e: {time}", self.cell, self.seed)?;
        for ServedPort { port, what } in &self.ports {
            writeln!(f, "  {}:{port}  {what}", self.host)?;
        }
        let ServedArm { payload_kg, centre_of_gravity_mm: [x, y, z], .. } = self.arm;
        writeln!(
            f,
            "It carries {payload_kg} kg, centre of gravity {x}, {y}, {z} mm from the flange: tell it so."
        )?;
        write!(f, "No hardware moves. Ctrl-C ends it.")
    }
}
