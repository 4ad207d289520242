//! The soak, in a few seconds of simulated time: replay on the wire beside image capture and recording, none lost.

use std::net::{IpAddr, Ipv4Addr};

use probepath_scripts::validate::{SoakWish, soak};
use probepath_sim::CellConfig;
use probepath_sim::controller::Time;

#[test]
fn a_short_soak_loses_nothing() {
    let process = std::process::id();
    let part = |n: u32| u8::try_from(n % 250 + 1).unwrap();
    let mut cell = CellConfig::default();
    cell.hand.length_mm = 40.0;
    let host = IpAddr::V4(Ipv4Addr::new(127, 22, part(process / 250), part(process)));
    let probepath = env!("CARGO_BIN_EXE_probepath").into();
    let goals = soak(&SoakWish { probepath, seconds: 5.0, time: Time::Simulated, host, cell }, &()).unwrap();
    assert!(goals.reached, "{goals}");
    let of = |figure: &str| goals.rows.iter().find(|row| row.figure == figure).unwrap().mean;
    assert!(of("ticks in the exam") > 2000.0, "{goals}");
    assert!(of("B-scans in the exam") >= 10.0, "{goals}");
    assert!(of("B-scans that arrived while it was looked") > 50.0, "{goals}");
}
