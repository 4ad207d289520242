//! [`Queue`]: what the reader has, until it is polled; bounded.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A bounded queue of one writer and one reader.
#[derive(Debug)]
pub(super) struct Queue<T> {
    inner: Mutex<Inner<T>>,
    changed: Condvar,
    room: usize,
}

#[derive(Debug)]
struct Inner<T> {
    entries: VecDeque<T>,
    dropped: u64,
    closed: bool,
}

impl<T> Queue<T> {
    pub(super) fn new(room: usize) -> Self {
        let inner = Inner { entries: VecDeque::with_capacity(room), dropped: 0, closed: false };
        Self { inner: Mutex::new(inner), changed: Condvar::new(), room }
    }

    fn lock(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts one in; the oldest goes where there is no room, because the newest is what a live picture is for.
    pub(super) fn push(&self, entry: T) {
        let mut inner = self.lock();
        if inner.entries.len() >= self.room {
            inner.entries.pop_front();
            inner.dropped += 1;
        }
        inner.entries.push_back(entry);
        drop(inner);
        self.changed.notify_all();
    }

    /// Puts one in when there is room; gives `false` when nobody will ever take it.
    pub(super) fn push_waiting(&self, entry: T) -> bool {
        let full = |inner: &mut Inner<T>| inner.entries.len() >= self.room && !inner.closed;
        let mut inner = self.changed.wait_while(self.lock(), full).unwrap_or_else(PoisonError::into_inner);
        if inner.closed {
            return false;
        }
        inner.entries.push_back(entry);
        drop(inner);
        self.changed.notify_all();
        true
    }

    /// The oldest, if there is one.
    pub(super) fn take(&self) -> Option<T> {
        let taken = self.lock().entries.pop_front();
        self.changed.notify_all();
        taken
    }

    /// The oldest, or the next that comes within `patience`.
    pub(super) fn wait(&self, patience: Duration) -> Option<T> {
        let empty = |inner: &mut Inner<T>| inner.entries.is_empty() && !inner.closed;
        let waited = self.changed.wait_timeout_while(self.lock(), patience, empty);
        let (mut inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let taken = inner.entries.pop_front();
        drop(inner);
        self.changed.notify_all();
        taken
    }

    /// How many went for want of room.
    pub(super) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    /// Nobody takes any more.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    pub(super) fn is_closed(&self) -> bool {
        self.lock().closed
    }
}
