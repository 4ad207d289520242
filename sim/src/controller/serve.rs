//! Sockets and threads around the controller: one thread ticks, two serve each RTDE connection, one each other. In wall
//! time all of them rank before a control thread of this computer: a real controller is a machine of its own, and waits
//! for nothing that is done here.

mod lines;
mod outbox;
mod pace;
mod rtde;

use std::collections::BTreeMap;
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;

use probepath_robot::realtime::{Grant, Histogram, Rank, take_rank};

use super::core::Controller;
use super::session::{Owners, Session};
use super::{ControllerError, Ports, Time};
use outbox::Outbox;

/// Everything that the threads share.
pub(super) struct Server {
    world: Mutex<World>,
    /// Something came that a tick may be waiting for.
    came: Condvar,
    stopping: AtomicBool,
    sockets: Mutex<BTreeMap<u64, TcpStream>>,
    punctuality: Mutex<Punctuality>,
    scheduling: OnceLock<Grant>,
}

/// How late the simulated controller itself was, by the wall's clock; nothing is counted in simulated time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Punctuality {
    /// From when a tick was due until it began.
    pub begun: Histogram,
    /// From when a tick was due until its package had left, for each client.
    pub left: Histogram,
}

/// What is behind the one lock.
pub(super) struct World {
    pub(super) controller: Controller,
    owners: Owners,
    clients: BTreeMap<u64, Client>,
    next_client: u64,
    /// How often each integer input was written.
    pulses: [u64; super::registers::COUNT],
    jitter: crate::random::Stream,
    /// Whoever hears what is said on the primary and the secondary interface.
    listeners: BTreeMap<u64, TcpStream>,
}

/// One RTDE connection.
struct Client {
    session: Session,
    outbox: Arc<Outbox>,
}

impl Server {
    /// Around a controller that does not tick yet.
    pub(super) fn new(controller: Controller) -> Arc<Self> {
        let world = World {
            controller,
            owners: Owners::new(),
            clients: BTreeMap::new(),
            next_client: 0,
            pulses: [0; super::registers::COUNT],
            jitter: crate::random::Stream::new(1, "wire jitter"),
            listeners: BTreeMap::new(),
        };
        Arc::new(Self {
            world: Mutex::new(world),
            came: Condvar::new(),
            stopping: AtomicBool::new(false),
            sockets: Mutex::new(BTreeMap::new()),
            punctuality: Mutex::default(),
            scheduling: OnceLock::new(),
        })
    }

    /// The world, for one caller at a time; a thread that panicked left it between two calls.
    pub(super) fn world(&self) -> MutexGuard<'_, World> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How late it was so far.
    pub(super) fn punctuality(&self) -> MutexGuard<'_, Punctuality> {
        self.punctuality.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What the system granted the thread that ticks; not asked for until it began.
    pub(super) fn scheduling(&self) -> Grant {
        self.scheduling.get().cloned().unwrap_or(Grant::NotAsked)
    }

    fn ranked(&self, grant: Grant) {
        let _ = self.scheduling.set(grant);
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.stopping.load(Ordering::SeqCst)
    }

    /// Tells every thread to end, and wakes those that wait on a socket.
    pub(super) fn stop(&self, listening: &[SocketAddr]) {
        self.stopping.store(true, Ordering::SeqCst);
        self.came.notify_all();
        for client in self.world().clients.values() {
            client.outbox.close();
        }
        self.hang_up();
        // A thread that waits for the next connection gets one, and sees that it is over.
        for address in listening {
            let _ = TcpStream::connect_timeout(address, std::time::Duration::from_millis(200));
        }
        self.hang_up();
    }

    fn hang_up(&self) {
        for socket in self.sockets().values() {
            let _ = socket.shutdown(Shutdown::Both);
        }
    }

    fn sockets(&self) -> MutexGuard<'_, BTreeMap<u64, TcpStream>> {
        self.sockets.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A number for a connection, under which it is hung up when everything stops.
    fn keep(&self, socket: &TcpStream) -> u64 {
        let mut world = self.world();
        world.next_client += 1;
        let id = world.next_client;
        drop(world);
        if let Ok(handle) = socket.try_clone() {
            self.sockets().insert(id, handle);
        }
        id
    }

    fn forget(&self, id: u64) {
        self.sockets().remove(&id);
    }
}

/// What is served on a port.
type Serve = fn(&Arc<Server>, TcpStream);

/// Listens on every port, before anything is served.
pub(super) fn listen(host: IpAddr) -> Result<Vec<(TcpListener, &'static str, Serve)>, ControllerError> {
    let all: [(u16, &str, Serve); 5] = [
        (Ports::RTDE, "RTDE", rtde::serve),
        (Ports::DASHBOARD, "dashboard", lines::dashboard),
        (Ports::PRIMARY, "primary", lines::primary),
        (Ports::SECONDARY, "secondary", lines::primary),
        (Ports::REALTIME, "scripts", lines::scripts),
    ];
    all.into_iter()
        .map(|(port, what, serve)| {
            let refused = |source| ControllerError::Port { host, port, what, source };
            let listener = TcpListener::bind(SocketAddr::new(host, port)).map_err(refused)?;
            Ok((listener, what, serve))
        })
        .collect()
}

/// Starts the thread that ticks, and those that accept.
pub(super) fn start(
    server: &Arc<Server>,
    listeners: Vec<(TcpListener, &'static str, Serve)>,
) -> Result<Vec<JoinHandle<()>>, ControllerError> {
    let mut threads = Vec::new();
    let ticking = server.clone();
    threads.push(spawn("ticks", move || pace::run(&ticking))?);
    let urgent = server.world().controller.config.time == Time::Wall;
    for (listener, what, serve) in listeners {
        let server = server.clone();
        let accepting = move || {
            if urgent {
                // Its connections' threads too; what was granted is what the ticking thread was.
                let _ = take_rank(Rank::Controller);
            }
            accept(&server, &listener, what, serve);
        };
        threads.push(spawn(what, accepting)?);
    }
    Ok(threads)
}

fn accept(server: &Arc<Server>, listener: &TcpListener, what: &'static str, serve: Serve) {
    for socket in listener.incoming() {
        if server.is_stopping() {
            return;
        }
        let Ok(socket) = socket else { continue };
        let _ = socket.set_nodelay(true);
        let serving = server.clone();
        // A thread that cannot be had costs this connection, not the others: the socket closes.
        let _ = spawn(what, move || serve(&serving, socket));
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, ControllerError> {
    let refused = |source| ControllerError::Thread { name: name.to_owned(), source };
    std::thread::Builder::new().name(format!("ur-{name}")).spawn(work).map_err(refused)
}
