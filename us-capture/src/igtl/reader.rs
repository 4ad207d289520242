//! The thread that reads the socket, and connects again when it is lost.

use std::io::Read;
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use probepath_frames::{HostClock, ImageClock, Stamp};

use super::decoder::{Decoder, Message};
use super::error::IgtlError;
use super::header::Header;
use super::image::Image;
use super::queue::Queue;
use super::source::Wait;

/// A picture as it came.
#[derive(Debug)]
pub(super) struct Picture {
    pub(super) number: u64,
    pub(super) stamp: Stamp<ImageClock>,
    pub(super) here: Stamp<HostClock>,
    pub(super) image: Image,
}

/// What the source finds in its queue.
#[derive(Debug)]
pub(super) enum Entry {
    Picture(Picture),
    /// Everything that had arrived by then was sent before this.
    Mark(Stamp<ImageClock>),
    Fault(IgtlError),
}

/// Between two tries to connect.
const AGAIN: Duration = Duration::from_millis(200);

/// How long a connection may take to be made.
pub(super) const CONNECT: Duration = Duration::from_secs(2);

/// A connection that is silent for so long is made anew: a pulled cable says nothing.
const SILENCE: Duration = Duration::from_secs(3);

/// What both sides see.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub(super) received: AtomicU64,
    pub(super) skipped: AtomicU64,
    pub(super) reconnects: AtomicU64,
    socket: Mutex<Option<TcpStream>>,
}

impl Shared {
    /// Wakes a reader that waits on its socket.
    pub(super) fn hang_up(&self) {
        if let Some(socket) = &*self.socket.lock().unwrap_or_else(PoisonError::into_inner) {
            let _ = socket.shutdown(Shutdown::Both);
        }
    }

    fn keep(&self, socket: &TcpStream) {
        *self.socket.lock().unwrap_or_else(PoisonError::into_inner) = socket.try_clone().ok();
    }
}

pub(super) struct Reader {
    pub(super) addresses: Vec<SocketAddr>,
    pub(super) device: Option<String>,
    pub(super) wait: Wait,
    pub(super) zero: Instant,
    pub(super) queue: Arc<Queue<Entry>>,
    pub(super) shared: Arc<Shared>,
    pub(super) numbers: Numbers,
}

impl Reader {
    pub(super) fn run(mut self, first: TcpStream) {
        let mut socket = Some(first);
        while !self.queue.is_closed() {
            let Some(connected) = socket.take().or_else(|| self.connect()) else {
                thread::park_timeout(AGAIN);
                continue;
            };
            self.shared.keep(&connected);
            if !self.queue.is_closed() {
                self.read(connected);
                self.shared.reconnects.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    fn connect(&self) -> Option<TcpStream> {
        self.addresses.iter().find_map(|address| TcpStream::connect_timeout(address, CONNECT).ok())
    }

    /// Until the connection ends, or what comes is no OpenIGTLink.
    fn read(&mut self, mut socket: TcpStream) {
        let patience = (self.wait == Wait::Never).then_some(SILENCE);
        let (mut decoder, mut bytes) = (Decoder::default(), vec![0; 1 << 16]);
        if socket.set_read_timeout(patience).is_err() {
            return;
        }
        while let Ok(count @ 1..) = socket.read(&mut bytes) {
            let here = host_clock(self.zero);
            let mut unread = bytes.get(..count).unwrap_or_default();
            while !unread.is_empty() {
                match decoder.feed(&mut unread) {
                    Ok(None) => {}
                    Ok(Some(message)) => self.take(message, here),
                    Err(fault) => return self.put(Entry::Fault(fault)),
                }
            }
        }
    }

    fn take(&mut self, message: Message, here: Stamp<HostClock>) {
        match message {
            Message::Image(header, image) if self.is_wanted(&header) => {
                self.shared.received.fetch_add(1, Ordering::Relaxed);
                let number = self.numbers.next(header.id);
                self.put(Entry::Picture(Picture { number, stamp: header.stamp, here, image }));
            }
            Message::Other(header) if self.wait == Wait::ForMarks && header.kind == "STATUS" => {
                self.put(Entry::Mark(header.stamp));
            }
            _ => drop(self.shared.skipped.fetch_add(1, Ordering::Relaxed)),
        }
    }

    fn is_wanted(&self, header: &Header) -> bool {
        self.device.as_ref().is_none_or(|device| *device == header.device)
    }

    fn put(&self, entry: Entry) {
        match self.wait {
            Wait::Never => self.queue.push(entry),
            Wait::ForMarks => drop(self.queue.push_waiting(entry)),
        }
    }
}

/// Numbers the pictures: by the messages' own numbers where they have any, so that one that was lost on the way leaves
/// a gap; by counting where not. A machine that begins anew goes on counting here.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Numbers {
    last: u64,
    /// What is added to the messages' own.
    base: u64,
}

impl Numbers {
    pub(super) fn next(&mut self, id: u32) -> u64 {
        let following = self.last + 1;
        let own = u64::from(id);
        if id == 0 {
            self.last = following;
            return following;
        }
        if own + self.base <= self.last {
            self.base = following - own.min(following);
        }
        self.last = (own + self.base).max(following);
        self.last
    }
}

/// This computer's clock, from `zero`.
pub(super) fn host_clock(zero: Instant) -> Stamp<HostClock> {
    Stamp::from_nanoseconds(i64::try_from(zero.elapsed().as_nanos()).unwrap_or(i64::MAX))
}
