//! The simulated arm's controller on its wire: RTDE 30004, dashboard 29999, primary 30001, scripts 30002 and 30003.
//!
//! ```no_run
//! use probepath_sim::controller::{ControllerConfig, ControllerServer};
//! use probepath_sim::{CellConfig, SimulatedCell};
//!
//! let cell = SimulatedCell::new(&CellConfig::default(), 1)?;
//! let running = ControllerServer::start(cell, ControllerConfig::default())?;
//! println!("a UR5e answers on {}", running.host());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The nouns: a [`ControllerServer`] starts what [`Running`] holds, as a [`ControllerConfig`] says; [`WireKnobs`] make
//! it fail; [`Script`] is what was uploaded.
//!
//! Behind the sockets is the cell's own physics: the arm with its servo's lag, the tool's weight against the payload
//! that was told, skin, hand. There is no URScript interpreter: the scripts of probepath and of ur_rtde are recognised
//! by their first line and emulated over the registers; any other is refused in words.
//!
//! What it does not do: dynamics of the arm's links, currents and temperatures (constants), blends of paths (the arm
//! stands at each point), the binary state stream of the ports 30001 to 30003. Power and brakes take no time.

mod config;
mod core;
mod dashboard;
mod error;
mod outputs;
mod pose;
mod program;
mod registers;
mod robot;
mod scripts;
mod serve;
mod session;
#[cfg(test)]
mod tests;

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::thread::JoinHandle;

pub use config::{ControllerConfig, Helper, Time, Version, WireKnobs};
pub use core::Counters;
pub use error::ControllerError;
pub use program::{Script, recognise};

use probepath_robot::realtime::Grant;

use self::core::Controller;
pub use self::serve::Punctuality;
use self::serve::Server;
use crate::cell::SimulatedCell;

/// The standard ports.
#[derive(Clone, Copy, Debug)]
pub struct Ports;

impl Ports {
    /// Lines: power, brakes, stops, popups.
    pub const DASHBOARD: u16 = 29999;
    /// Says its version, takes scripts.
    pub const PRIMARY: u16 = 30001;
    /// The same.
    pub const SECONDARY: u16 = 30002;
    /// Takes scripts.
    pub const REALTIME: u16 = 30003;
    /// Real-time data exchange.
    pub const RTDE: u16 = 30004;
}

/// Starts simulated controllers.
#[derive(Clone, Copy, Debug)]
pub struct ControllerServer;

impl ControllerServer {
    /// Serves a cell's arm until what it gives is dropped. Nobody else may move that arm meanwhile.
    ///
    /// # Errors
    /// When the arm has not six joints, a number of the set-up is impossible, or a port is taken.
    pub fn start(cell: SimulatedCell, config: ControllerConfig) -> Result<Running, ControllerError> {
        config.check()?;
        let joints = cell.nominal().model().joints();
        if joints != 6 {
            return Err(ControllerError::Joints { joints });
        }
        let host = config.host;
        let listeners = serve::listen(host)?;
        let listening = listeners.iter().filter_map(|(l, ..)| l.local_addr().ok()).collect();
        let server = Server::new(Controller::new(cell.clone(), config));
        let mut running = Running { server, cell, host, listening, threads: Vec::new() };
        running.threads = serve::start(&running.server, listeners)?;
        Ok(running)
    }
}

/// A controller that serves; dropped, it stops.
#[must_use = "the controller stops when this is dropped"]
pub struct Running {
    server: Arc<Server>,
    cell: SimulatedCell,
    host: IpAddr,
    listening: Vec<SocketAddr>,
    threads: Vec<JoinHandle<()>>,
}

impl std::fmt::Debug for Running {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Running").field("host", &self.host).finish_non_exhaustive()
    }
}

impl Running {
    /// Where it listens.
    pub const fn host(&self) -> IpAddr {
        self.host
    }

    /// The cell behind it: its machine, its hand, and the truth, for tests.
    pub const fn cell(&self) -> &SimulatedCell {
        &self.cell
    }

    /// What happened so far.
    pub fn counters(&self) -> Counters {
        self.server.world().controller.counters.clone()
    }

    /// How late it was itself so far, by the wall's clock.
    pub fn punctuality(&self) -> Punctuality {
        self.server.punctuality().clone()
    }

    /// Whether the system lets its ticks run before all other work of this computer; not asked for in simulated time.
    pub fn scheduling(&self) -> Grant {
        self.server.scheduling()
    }

    /// Why the last program ended; empty before one did.
    pub fn last_ending(&self) -> String {
        self.server.world().controller.ended.clone()
    }

    /// The popup on the pendant.
    pub fn popup(&self) -> Option<String> {
        self.server.world().controller.popup.clone()
    }

    /// Whether the arm stands: its target, and the motors behind it.
    pub fn is_at_rest(&self) -> bool {
        !self.server.world().controller.is_moving()
    }

    /// What fails from now on.
    pub fn set_knobs(&self, knobs: WireKnobs) {
        self.server.world().controller.config.knobs = knobs;
    }

    /// Somebody makes the arm stop by itself, now.
    pub fn stop_protectively(&self, why: &str) {
        self.server.world().controller.robot.protective_stop(why.to_owned());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.server.stop(&self.listening);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}
