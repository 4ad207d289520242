//! No exchange with a UR arm touches the heap, once it is connected.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test may stop at the first surprise, its helpers too"
)]

mod support;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use probepath_robot::drivers::ur::UrArm;
use probepath_robot::{Arm, Command};
use support::{Controller, Lies, settings};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn no_exchange_touches_the_heap() {
    let controller = Controller::start(Lies { skip: 300..304, burst: 100..120, ..Lies::default() });
    let mut arm = UrArm::connect(&controller.host, settings()).unwrap();
    let here = arm.exchange(&Command::Stay).unwrap().commanded;
    let mut together = 0;
    let last = assert_no_alloc(|| {
        let mut last = None;
        for n in 0..600_u32 {
            let command = match n % 3 {
                0 => Command::Stay,
                1 => Command::Position(here.map(|q| q + 1e-6 * f64::from(n))),
                _ => Command::Freedrive,
            };
            last = Some(arm.exchange(&command));
            together += arm.overtaken().len();
        }
        last
    });
    assert!(last.unwrap().is_ok());
    assert_eq!(together, 60);
    assert!(arm.counts().packages > 500 && arm.counts().gaps == 4);
}
