//! The cell file of a simulated cell that is served on its wire: what a client has to know of it.

use std::net::IpAddr;

use probepath_sim::{ArmKind, SimulatedCell, SubjectConfig};
use probepath_us_capture::SettingMm;

use super::arm::{ArmFile, ControllerTime};
use super::file::CellFile;
use super::machine::{IGTL_PORT, MachineAddress, MachineClock, MachineFile};
use super::phantom::PhantomFile;
use super::pose::PoseFile;
use probepath_robot::drivers::Address;

impl CellFile {
    /// The file with which a simulated cell is scanned over its wire, when it is served at `host`: what its own file
    /// says of arm and machine, and nothing of the truth.
    pub fn of_served(name: &str, cell: &SimulatedCell, host: IpAddr, time: ControllerTime) -> Self {
        let (nominal, config) = (cell.nominal(), cell.config());
        let host = host.to_string();
        let tool = config.arm.tool;
        let (accuracy_mm, repeatability_mm) = config.arm.kinematic_error.sheet_mm();
        let model = match config.arm.kind {
            ArmKind::Ur5e => "ur5e",
            ArmKind::SevenJoint => "seven_joint",
        };
        let arm = ArmFile {
            address: Address::Ur { host: host.clone() },
            model: Some(model.into()),
            payload_kg: Some(tool.mass_kg),
            centre_of_gravity_mm: Some(tool.centre_of_gravity_mm),
            accuracy_mm: Some(accuracy_mm),
            repeatability_mm: Some(repeatability_mm),
            // A shared computer is late now and then, the simulated controller as well as we.
            heartbeat_ms: Some(SERVED_HEARTBEAT_MS),
            time,
            world_from_base: Some(PoseFile::of(&nominal.world_from_base)),
            flange_from_probe: Some(PoseFile::of(&nominal.flange_from_probe)),
            ..ArmFile::default()
        };
        let machine = MachineFile {
            address: MachineAddress::Igtl { host, port: IGTL_PORT },
            device: None,
            latency_ms: Some(nominal.image_latency.nanoseconds() as f64 / 1e6),
            clock: Some(MachineClock::Arm),
            holder_error_mm: Some(config.machine.calibration_error_mm),
            dynamic_range_db: Some(config.machine.imaging.dynamic_range_db),
            setting: Some(SettingMm::of(&nominal.setting)),
        };
        let phantom = nominal.bench.as_ref().zip(named(cell)).map(|(bench, model)| PhantomFile {
            model,
            water_celsius: bench.water_celsius,
            world_from_phantom: PoseFile::of(&bench.world_from_phantom),
        });
        Self { name: name.into(), arm, machine, phantom, ..Self::default() }
    }
}

/// The phantom's name or file, where it is not drawn in the cell's own file.
fn named(cell: &SimulatedCell) -> Option<String> {
    let SubjectConfig::WirePhantom(config) = &cell.config().subject else { return None };
    (!config.phantom.contains('\n')).then(|| config.phantom.clone())
}

/// How late a state of a simulated controller on the same computer may be (ms).
const SERVED_HEARTBEAT_MS: f64 = 80.0;
