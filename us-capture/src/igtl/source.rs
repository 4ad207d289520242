//! [`IgtlSource`]: a [`BScanSource`] over the network.

use std::collections::VecDeque;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use probepath_frames::{ImageClock, Stamp};

use super::clock::{Dating, MachineClock};
use super::image::Image;
use super::queue::Queue;
use super::reader::{CONNECT, Entry, Numbers, Picture, Reader, Shared, host_clock};
use crate::{BScan, BScanSource, PixelSpacing, Setting, SourceFault};

/// The port that OpenIGTLink servers listen on when nobody says otherwise.
pub const PORT: u16 = 18944;

/// Pictures that wait to be polled: a second of a fast machine, 20 MB.
const ROOM: usize = 64;

/// How long a mark may take in real time before the machine is given up.
const PATIENCE: Duration = Duration::from_secs(20);

/// A spacing on the wire is a single number: this much (relative) off the set one is the set one.
const SAME_SPACING: f64 = 1e-5;

/// Whether a poll waits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wait {
    /// Never: time is real. What is not polled for a second goes, the oldest first, and is counted.
    #[default]
    Never,
    /// Until the machine has marked the instant that is polled for with a STATUS message stamped then or later: time is
    /// simulated, by a machine that does so (the simulated one). The same commands then give the same B-scans.
    ForMarks,
}

/// Which machine, and what its messages do not say.
#[derive(Clone, Debug, PartialEq)]
pub struct IgtlSettings {
    /// Its host's name or address.
    pub host: String,
    /// Its port; [`PORT`] usually.
    pub port: u16,
    /// Only pictures of this device; any when there is none.
    pub device: Option<String>,
    /// How the machine is set. A picture whose size or spacing differ has a setting with its own, which no calibration
    /// of this one will take.
    pub setting: Setting,
    /// Whose clock it stamps with.
    pub clock: MachineClock,
    /// Whether a poll waits.
    pub wait: Wait,
}

/// What became of the messages so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IgtlCounts {
    /// Pictures that came.
    pub received: u64,
    /// Pictures that were not polled in time.
    pub dropped: u64,
    /// Messages of other types and devices.
    pub skipped: u64,
    /// Connections that were lost.
    pub lost_connections: u64,
}

/// One connection to an ultrasound machine; when it is lost it is made again, and counted.
#[derive(Debug)]
pub struct IgtlSource {
    settings: IgtlSettings,
    queue: Arc<Queue<Entry>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    zero: Instant,
    dating: Dating,
    simulated: InStep,
}

/// What waits between two marks, in simulated time.
#[derive(Debug, Default)]
struct InStep {
    marked: Stamp<ImageClock>,
    skipped: Stamp<ImageClock>,
    unmarked: Vec<Picture>,
    ready: VecDeque<Picture>,
}

impl IgtlSource {
    /// Connects.
    ///
    /// # Errors
    /// When the host has no address, or nobody answers there.
    #[expect(
        clippy::disallowed_methods,
        reason = "arrivals are dated by this computer's clock, and no step asks it"
    )]
    pub fn connect(settings: IgtlSettings) -> Result<Self, SourceFault> {
        let place = format!("{}:{}", settings.host, settings.port);
        let unreachable = |why: String| SourceFault::Unreachable { place: place.clone(), why };
        let found = (settings.host.as_str(), settings.port).to_socket_addrs();
        let addresses: Vec<SocketAddr> = found.map_err(|e| unreachable(e.to_string()))?.collect();
        let mut why = "the name has no address".to_owned();
        let connected = addresses.iter().find_map(|address| {
            TcpStream::connect_timeout(address, CONNECT).map_err(|e| why = e.to_string()).ok()
        });
        let socket = connected.ok_or_else(|| unreachable(why))?;
        let (queue, shared, zero) = (Arc::new(Queue::new(ROOM)), Arc::new(Shared::default()), Instant::now());
        let reader = Reader {
            addresses,
            device: settings.device.clone(),
            wait: settings.wait,
            zero,
            queue: queue.clone(),
            shared: shared.clone(),
            numbers: Numbers::default(),
        };
        let started = std::thread::Builder::new().name("igtl".into()).spawn(move || reader.run(socket));
        let thread = Some(started.map_err(|e| unreachable(e.to_string()))?);
        let dating = Dating::new(settings.clock);
        Ok(Self { settings, queue, shared, thread, zero, dating, simulated: InStep::default() })
    }

    /// What became of the messages so far.
    pub fn counts(&self) -> IgtlCounts {
        let count = |counter: &std::sync::atomic::AtomicU64| counter.load(Ordering::Relaxed);
        IgtlCounts {
            received: count(&self.shared.received),
            dropped: self.queue.dropped(),
            skipped: count(&self.shared.skipped),
            lost_connections: count(&self.shared.reconnects),
        }
    }

    /// The next picture that is here.
    fn next(&mut self) -> Result<Option<Picture>, String> {
        loop {
            match self.queue.take() {
                None => return Ok(None),
                Some(Entry::Picture(picture)) => return Ok(Some(picture)),
                Some(Entry::Mark(_)) => {}
                Some(Entry::Fault(fault)) => return Err(fault.to_string()),
            }
        }
    }

    /// The next picture that had arrived by `now`, once the machine has said that there are no others.
    fn next_marked(&mut self, now: Stamp<ImageClock>) -> Result<Option<Picture>, String> {
        while self.simulated.marked < now {
            let Some(entry) = self.queue.wait(PATIENCE) else {
                return Err(format!("it has not marked {now} for {} s", PATIENCE.as_secs()));
            };
            self.simulated.sort(entry)?;
        }
        Ok(self.simulated.ready.pop_front())
    }

    fn bscan(&mut self, picture: Picture, now: Stamp) -> Result<BScan, String> {
        let Picture { number, stamp, here, image } = picture;
        let (formed, arrived) = self.dating.of(stamp, here, now)?;
        let arrived = if self.settings.wait == Wait::ForMarks { now } else { arrived };
        let setting = setting(&self.settings.setting, &image);
        let size = (usize::from(image.columns), usize::from(image.rows));
        BScan::new(number, (formed, arrived), setting, size, image.pixels).map_err(|e| e.to_string())
    }
}

impl InStep {
    fn sort(&mut self, entry: Entry) -> Result<(), String> {
        match entry {
            Entry::Picture(picture) => self.unmarked.push(picture),
            Entry::Fault(fault) => return Err(fault.to_string()),
            Entry::Mark(stamp) => {
                self.marked = stamp;
                if stamp <= self.skipped {
                    self.unmarked.clear();
                }
                self.ready.extend(self.unmarked.drain(..));
            }
        }
        Ok(())
    }
}

/// The setting that a picture has: the given one, where its size and spacing are.
fn setting(given: &Setting, image: &Image) -> Setting {
    let [x_m, y_m] = image.spacing_mm.map(|mm| mm * 1e-3);
    let same = |a: f64, b: f64| (a - b).abs() <= SAME_SPACING * b;
    let (width, height) = (x_m * f64::from(image.columns), y_m * f64::from(image.rows));
    let size_is_same = same(width, given.window_width_m) && same(height, given.window_height_m);
    if size_is_same && same(x_m, given.spacing.x_m) && same(y_m, given.spacing.y_m) {
        return *given;
    }
    Setting { window_width_m: width, window_height_m: height, spacing: PixelSpacing { x_m, y_m }, ..*given }
}

impl BScanSource for IgtlSource {
    fn poll(&mut self, now: Stamp) -> Result<Option<BScan>, SourceFault> {
        self.dating.tick(now, host_clock(self.zero));
        let next = match self.settings.wait {
            Wait::Never => self.next(),
            Wait::ForMarks => self.next_marked(Stamp::from_nanoseconds(now.nanoseconds())),
        };
        let bscan = next.and_then(|picture| picture.map(|picture| self.bscan(picture, now)).transpose());
        bscan.map_err(|why| SourceFault::Unreadable { at: now, why })
    }

    fn skip(&mut self, now: Stamp) -> Result<(), SourceFault> {
        if self.settings.wait == Wait::Never {
            while self.poll(now)?.is_some() {}
            return Ok(());
        }
        self.simulated.skipped = Stamp::from_nanoseconds(now.nanoseconds());
        self.simulated.ready.clear();
        while let Some(entry) = self.queue.take() {
            self.simulated.sort(entry).map_err(|why| SourceFault::Unreadable { at: now, why })?;
        }
        Ok(())
    }
}

impl Drop for IgtlSource {
    fn drop(&mut self) {
        self.queue.close();
        self.shared.hang_up();
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}
