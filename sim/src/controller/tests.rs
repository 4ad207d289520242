//! The controller without sockets, tick by tick; and `served`, with them.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]

mod codec;
mod own;
mod safety;
mod served;
mod ur_rtde;

use probepath_robot::Joints;

use super::config::{ControllerConfig, WireKnobs};
use super::core::Controller;
use super::session::{Owners, Session};
use crate::cell::{CellConfig, SimulatedCell};

/// A controller, and a client's session with it; nothing in between.
struct Rig {
    controller: Controller,
    owners: Owners,
}

impl Rig {
    fn new() -> Self {
        Self::with(WireKnobs::default())
    }

    fn with(knobs: WireKnobs) -> Self {
        let cell = SimulatedCell::new(&CellConfig::default(), 1).unwrap();
        let config = ControllerConfig { knobs, ..ControllerConfig::default() };
        Self { controller: Controller::new(cell, config), owners: Owners::new() }
    }

    /// A session that speaks version 2.
    fn session(&mut self, client: u64) -> Session {
        let mut session = Session::new(client, false);
        let reply = self.say(&mut session, b'V', &[0, 2]);
        assert_eq!(reply, [0, 4, b'V', 1]);
        session
    }

    fn say(&mut self, session: &mut Session, kind: u8, payload: &[u8]) -> Vec<u8> {
        let bytes = super::session::package(kind, payload);
        session.hear(&bytes, &mut self.controller, &mut self.owners).replies
    }

    fn ticks(&mut self, count: u32) {
        (0..count).for_each(|_| self.controller.tick());
    }

    /// Ticks until something is so; how many it took.
    fn until(&mut self, most: u32, is_so: impl Fn(&Controller) -> bool) -> u32 {
        for tick in 0..most {
            if is_so(&self.controller) {
                return tick;
            }
            self.controller.tick();
        }
        panic!("not so after {most} ticks; the program: {:?}", self.controller.ended)
    }

    fn measured(&self) -> Joints {
        *self.controller.robot.measured().0
    }

    /// An integer input, as if a package had written it.
    fn int(&mut self, index: usize, value: i32) {
        self.controller.input.set_int(index, value);
        self.controller.written[index] = self.controller.counters.ticks;
    }
}

fn apart(a: &Joints, b: &Joints) -> f64 {
    a.zip(b, |a, b| a - b).largest()
}
