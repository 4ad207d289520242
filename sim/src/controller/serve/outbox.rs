//! What waits to leave on one connection: answers always, data packages only while they are fresh.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Data packages that may wait; an overloaded controller skips the older ones and sends only the newest.
const WAITING: usize = 8;

/// Something to send.
#[derive(Debug)]
pub(super) struct Letter {
    pub(super) bytes: Vec<u8>,
    /// Not before.
    pub(super) due: Option<Instant>,
    /// A data package that may be skipped.
    pub(super) fleeting: bool,
    /// The connection ends after it.
    pub(super) last: bool,
}

/// The letters of one connection.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    letters: Mutex<(VecDeque<Letter>, bool)>,
    came: Condvar,
}

impl Outbox {
    /// Puts a letter in; how many older packages it displaced.
    pub(super) fn put(&self, letter: Letter) -> u64 {
        let mut guard = self.guard();
        let (letters, _) = &mut *guard;
        let mut displaced = 0;
        let ready = |l: &Letter| l.fleeting && l.due.is_none_or(|due| due <= Instant::now());
        if letter.fleeting && letters.iter().filter(|l| ready(l)).count() >= WAITING {
            let before = letters.len();
            letters.retain(|l| !ready(l));
            displaced = (before - letters.len()) as u64;
        }
        letters.push_back(letter);
        self.came.notify_all();
        displaced
    }

    /// Takes the next letter when it is due; `None` when there will be no more.
    pub(super) fn take(&self) -> Option<Letter> {
        let mut guard = self.guard();
        loop {
            if guard.1 {
                return None;
            }
            let now = Instant::now();
            let wait = match guard.0.front().map(|letter| letter.due) {
                Some(Some(due)) if due > now => due - now,
                Some(_) => return guard.0.pop_front(),
                None => std::time::Duration::from_secs(1),
            };
            guard = self.came.wait_timeout(guard, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// No more letters leave.
    pub(super) fn close(&self) {
        self.guard().1 = true;
        self.came.notify_all();
    }

    fn guard(&self) -> MutexGuard<'_, (VecDeque<Letter>, bool)> {
        self.letters.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
