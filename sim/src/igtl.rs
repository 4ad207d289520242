//! The simulated ultrasound machine on its wire: OpenIGTLink on port 18944, as a machine or a PLUS server sends it.
//!
//! ```no_run
//! use probepath_sim::igtl::{MachineServer, MachineServerConfig};
//! use probepath_sim::{CellConfig, SimulatedCell};
//!
//! let cell = SimulatedCell::new(&CellConfig::default(), 1)?;
//! let machine = MachineServer::start(&cell, MachineServerConfig::default())?;
//! println!("pictures come from {}", machine.address());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Each B-scan leaves when it has arrived by the cell's time, stamped with the instant that it was formed, as far as the
//! machine knows it, on the cell's clock: the one that the simulated controller ([`crate::controller`]) has as its own.
//!
//! Where the cell's time is simulated, a tick does not wait for the pictures. Instead the machine marks every tick with
//! a STATUS message, after the pictures that had arrived by then, and a client that wants to be in step waits for it.

use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use probepath_frames::{Span, Stamp};
use probepath_robot::realtime::{Rank, take_rank};
use probepath_us_capture::igtl::{IgtlError, Image, PORT, encode_image, encode_status};
use probepath_us_capture::{BScan, BScanSource, SourceFault};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cell::SimulatedCell;
use crate::controller::Time;
use crate::machine::SimulatedMachine;

/// How the simulated machine is served.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineServerConfig {
    /// The address that it listens on.
    pub host: IpAddr,
    /// The port.
    pub port: u16,
    /// The name that its pictures carry.
    pub device: String,
    /// What makes the cell's clock go; every tick is marked where it is simulated.
    pub time: Time,
}

impl Default for MachineServerConfig {
    fn default() -> Self {
        let host = IpAddr::V4(Ipv4Addr::LOCALHOST);
        Self { host, port: PORT, device: "Probe".into(), time: Time::Wall }
    }
}

/// Why the simulated machine cannot be served.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MachineServerError {
    /// Its port.
    #[error("the simulated ultrasound machine cannot listen on {address}: {source}; is another one running?")]
    Port {
        /// Where.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// Its thread.
    #[error("cannot start a thread for the simulated ultrasound machine: {0}")]
    Thread(std::io::Error),
}

/// Starts simulated machines.
#[derive(Clone, Copy, Debug)]
pub struct MachineServer;

/// How many pictures left, and how many were too old to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sent {
    /// Connections that were accepted.
    pub clients: u64,
    /// Pictures that left.
    pub pictures: u64,
    /// Pictures that were a second old before a client took them.
    pub stale: u64,
}

/// A machine that is served; dropped, it stops.
#[derive(Debug)]
#[must_use = "the machine stops when this is dropped"]
pub struct Running {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    cell: SimulatedCell,
    config: MachineServerConfig,
    stopping: AtomicBool,
    sockets: Mutex<Vec<TcpStream>>,
    clients: AtomicU64,
    pictures: AtomicU64,
    stale: AtomicU64,
}

/// What a client has not taken within this is old: a live picture is not kept for those who are slow.
const STALE: Span = Span::from_milliseconds(1000);

/// How often a thread that waits for the cell's next tick sees whether everything stops.
const LOOK: Duration = Duration::from_millis(100);

impl MachineServer {
    /// Serves a cell's machine until what it gives is dropped. Every client has every picture from when it connected.
    ///
    /// # Errors
    /// When the port is taken, or no thread can be started.
    pub fn start(cell: &SimulatedCell, config: MachineServerConfig) -> Result<Running, MachineServerError> {
        let address = SocketAddr::new(config.host, config.port);
        let port = |source| MachineServerError::Port { address, source };
        let listener = TcpListener::bind(address).map_err(port)?;
        let address = listener.local_addr().map_err(port)?;
        let shared = Arc::new(Shared {
            cell: cell.clone(),
            config,
            stopping: AtomicBool::new(false),
            sockets: Mutex::default(),
            clients: AtomicU64::new(0),
            pictures: AtomicU64::new(0),
            stale: AtomicU64::new(0),
        });
        let theirs = shared.clone();
        let thread = spawn(move || accept(&theirs, &listener)).map_err(MachineServerError::Thread)?;
        Ok(Running { address, shared, thread: Some(thread) })
    }
}

impl Running {
    /// Where it listens.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// What left so far.
    pub fn sent(&self) -> Sent {
        let count = |counter: &AtomicU64| counter.load(Ordering::SeqCst);
        Sent {
            clients: count(&self.shared.clients),
            pictures: count(&self.shared.pictures),
            stale: count(&self.shared.stale),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shared.stopping.store(true, Ordering::SeqCst);
        self.shared.hang_up();
        // The thread that waits for the next client gets one, and sees that it is over.
        let _ = TcpStream::connect_timeout(&self.address, LOOK);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn is_stopping(&self) -> bool {
        self.stopping.load(Ordering::SeqCst)
    }

    fn hang_up(&self) {
        for socket in self.sockets.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
            let _ = socket.shutdown(Shutdown::Both);
        }
    }

    fn keep(&self, socket: &TcpStream) {
        let kept = socket.try_clone().ok();
        self.sockets.lock().unwrap_or_else(PoisonError::into_inner).extend(kept);
        // It came while everything was hung up.
        if self.is_stopping() {
            self.hang_up();
        }
    }
}

fn spawn(work: impl FnOnce() + Send + 'static) -> std::io::Result<JoinHandle<()>> {
    std::thread::Builder::new().name("machine".into()).spawn(work)
}

fn accept(shared: &Arc<Shared>, listener: &TcpListener) {
    let mut serving = Vec::new();
    for socket in listener.incoming() {
        if shared.is_stopping() {
            break;
        }
        let Ok(socket) = socket else { continue };
        let _ = socket.set_nodelay(true);
        shared.keep(&socket);
        let mine = shared.clone();
        // From here on: what forms while the thread starts is this client's too.
        let machine = shared.cell.machine();
        shared.clients.fetch_add(1, Ordering::SeqCst);
        // A thread that cannot be had costs this client, not the others: its socket closes.
        serving.extend(spawn(move || Client { shared: mine, machine, socket }.serve()));
    }
    for thread in serving {
        let _ = thread.join();
    }
}

/// One client.
struct Client {
    shared: Arc<Shared>,
    machine: SimulatedMachine,
    socket: TcpStream,
}

/// Why a client is left.
#[derive(Debug, Error)]
enum Left {
    #[error(transparent)]
    Socket(#[from] std::io::Error),
    #[error(transparent)]
    Machine(#[from] SourceFault),
    #[error(transparent)]
    Words(#[from] IgtlError),
}

impl Client {
    /// Tick by tick, until the client or the machine is gone.
    fn serve(mut self) {
        if self.shared.config.time == Time::Wall {
            // The threads that draw are started before, lest they rank with this one.
            let _ = rayon::current_num_threads();
            let _ = take_rank(Rank::Device);
        }
        let mut served = Stamp::from_nanoseconds(i64::MIN);
        while !self.shared.is_stopping() {
            let now = self.shared.cell.shared().wait_beyond(served, LOOK);
            if now > served {
                if self.send(now).is_err() {
                    return;
                }
                served = now;
            }
        }
    }

    /// Everything that has arrived by `now`, and the mark.
    fn send(&mut self, now: Stamp) -> Result<(), Left> {
        let stale = self.machine.drop_until(now - STALE);
        self.shared.stale.fetch_add(stale as u64, Ordering::SeqCst);
        while let Some(bscan) = self.machine.poll(now)? {
            let bytes = picture(&bscan, &self.shared.config.device)?;
            self.socket.write_all(&bytes)?;
            self.shared.pictures.fetch_add(1, Ordering::SeqCst);
        }
        if self.shared.config.time == Time::Simulated {
            self.socket.write_all(&encode_status(&self.shared.config.device, now.nanoseconds())?)?;
        }
        Ok(())
    }
}

/// A B-scan as a message; it is numbered from one, because zero is no number there.
fn picture(bscan: &BScan, device: &str) -> Result<Vec<u8>, IgtlError> {
    let size = |pixels: usize| u16::try_from(pixels).unwrap_or(u16::MAX);
    let spacing = bscan.setting.spacing;
    let image = Image {
        columns: size(bscan.width()),
        rows: size(bscan.height()),
        spacing_mm: [spacing.x_m * 1e3, spacing.y_m * 1e3],
        pixels: bscan.pixels().to_vec(),
    };
    let id = u32::try_from(bscan.number + 1).unwrap_or(0);
    encode_image(device, id, bscan.formed.nanoseconds(), &image)
}

#[cfg(test)]
mod tests;
