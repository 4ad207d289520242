#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use probepath_robot::{Arm, Command};
use probepath_us_capture::igtl::{IgtlSettings, IgtlSource, MachineClock, Wait};

use super::*;
use crate::cell::CellConfig;

fn served(cell: &SimulatedCell) -> Running {
    let config = MachineServerConfig { port: 0, time: Time::Simulated, ..MachineServerConfig::default() };
    MachineServer::start(cell, config).unwrap()
}

fn connect(machine: &Running, cell: &SimulatedCell) -> IgtlSource {
    let settings = IgtlSettings {
        host: machine.address().ip().to_string(),
        port: machine.address().port(),
        device: None,
        setting: cell.nominal().setting,
        clock: MachineClock::OfArm,
        wait: Wait::ForMarks,
    };
    IgtlSource::connect(settings).unwrap()
}

#[test]
fn over_the_wire_come_the_same_pictures_at_the_same_ticks() {
    let cell = SimulatedCell::new(&CellConfig::default(), 3).unwrap();
    let machine = served(&cell);
    let mut here = cell.machine();
    let mut there = connect(&machine, &cell);
    let mut arm = cell.arm();
    // The accepting thread asks for its machine when it gets to it; nothing moves before the first mark has come.
    assert_eq!(there.poll(cell.now()).unwrap(), None);
    let mut seen = 0;
    for _ in 0..150 {
        let state = arm.exchange(&Command::Stay).unwrap();
        loop {
            let (wanted, came) = (here.poll(state.stamp).unwrap(), there.poll(state.stamp).unwrap());
            let Some(wanted) = wanted else {
                assert_eq!(came, None);
                break;
            };
            let came = came.unwrap();
            assert_eq!((came.number, came.formed), (wanted.number + 1, wanted.formed));
            assert_eq!((came.arrived, came.setting), (state.stamp, wanted.setting));
            assert_eq!(came.pixels(), wanted.pixels());
            seen += 1;
        }
    }
    assert!(seen > 3, "only {seen} pictures");
    assert_eq!(machine.sent(), Sent { clients: 1, pictures: seen, stale: 0 });
}

#[test]
fn a_machine_that_is_dropped_lets_go_of_its_port_and_its_client() {
    let cell = SimulatedCell::new(&CellConfig::default(), 3).unwrap();
    let machine = served(&cell);
    let mut client = connect(&machine, &cell);
    assert_eq!(client.poll(cell.now()).unwrap(), None);
    let address = machine.address();
    drop(machine);
    let config =
        MachineServerConfig { host: address.ip(), port: address.port(), ..MachineServerConfig::default() };
    drop(MachineServer::start(&cell, config).unwrap());
}
