//! [`Words`]: what a controller says on its primary interface, heard on a thread of its own, kept for whoever asks why.

use std::io::Read;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::clock;
use super::primary::{PORT, PrimaryReader, Said};
use super::socket::Socket;

/// So many words are kept.
const KEPT: usize = 4;
/// How long a read waits before it looks whether anybody still wants to know.
const LOOKS_EVERY: Duration = Duration::from_millis(200);

/// Hears a controller's words. Without a primary interface there are none, and that is all.
#[derive(Debug)]
pub(super) struct Words {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    wanted: AtomicBool,
    hears: AtomicBool,
    said: Mutex<Vec<(Instant, String)>>,
}

impl Words {
    /// Begins to listen; where no thread can be had, nothing is heard.
    pub(super) fn of(host: &str) -> Self {
        let shared = Arc::new(Shared { wanted: AtomicBool::new(true), ..Shared::default() });
        let (host, hearing) = (host.to_owned(), Arc::clone(&shared));
        let listen = move || {
            hearing.listen(&host);
            hearing.hears.store(false, Ordering::SeqCst);
        };
        let _ = std::thread::Builder::new().name("ur-words".into()).spawn(listen);
        Self { shared }
    }

    /// What was said within the last `before`, waiting for `patience` at most until something is; empty when nothing.
    pub(super) fn lately(&self, before: Duration, patience: Duration) -> String {
        let asked = clock::now();
        loop {
            let said = self.shared.since(asked, before);
            let waits = self.shared.hears.load(Ordering::SeqCst) && asked.elapsed() < patience;
            if !said.is_empty() || !waits {
                return said;
            }
            clock::wait(Duration::from_millis(2));
        }
    }
}

impl Drop for Words {
    fn drop(&mut self) {
        self.shared.wanted.store(false, Ordering::SeqCst);
    }
}

impl Shared {
    fn listen(&self, host: &str) {
        let Ok(mut socket) = Socket::open(host, PORT, "primary interface", LOOKS_EVERY) else { return };
        self.hears.store(true, Ordering::SeqCst);
        let (mut reader, mut bytes) = (PrimaryReader::default(), [0; 4096]);
        while self.wanted.load(Ordering::SeqCst) {
            let count = match socket.stream.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => count,
                Err(error) if is_only_late(error.kind()) => continue,
                Err(_) => return,
            };
            let heard = bytes.get(..count).map(|bytes| reader.feed(bytes, |said| self.keep(&said)));
            if !matches!(heard, Some(Ok(()))) {
                return;
            }
        }
    }

    fn keep(&self, said: &Said) {
        if said.explains() {
            let mut all = self.said.lock().unwrap_or_else(PoisonError::into_inner);
            if all.len() == KEPT {
                all.remove(0);
            }
            all.push((clock::now(), said.to_string()));
        }
    }

    fn since(&self, asked: Instant, before: Duration) -> String {
        let all = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let lately = all.iter().filter(|(when, _)| asked.saturating_duration_since(*when) <= before);
        lately.map(|(_, words)| words.as_str()).collect::<Vec<_>>().join("; ")
    }
}

/// Nothing came in time; the connection stands.
const fn is_only_late(kind: std::io::ErrorKind) -> bool {
    use std::io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(kind, Interrupted | TimedOut | WouldBlock)
}
