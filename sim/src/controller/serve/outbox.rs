//! What waits to leave on one connection: answers always, data packages only while they are fresh.

#![allow(
    clippy::disallowed_methods,
    reason = "a server in wall time is what the wall's clock is for; simulated time asks none"
)]

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
    /// When the tick was due that it tells of, in wall time.
    pub(super) of_tick: Option<Instant>,
    /// A data package that may be skipped.
    pub(super) fleeting: bool,
    /// The connection ends after it.
    pub(super) last: bool,
}

impl Letter {
    /// What is said once, and never skipped.
    pub(super) const fn answer(bytes: Vec<u8>, last: bool) -> Self {
        Self { bytes, due: None, of_tick: None, fleeting: false, last }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn letter(number: u8, fleeting: bool) -> Letter {
        Letter { bytes: vec![number], due: None, of_tick: None, fleeting, last: false }
    }

    #[test]
    fn an_overloaded_client_gets_every_answer_and_only_the_newest_data() {
        let outbox = Outbox::default();
        let displaced: u64 = (0..100).map(|number| outbox.put(letter(number, number % 10 != 0))).sum();
        outbox.put(Letter { last: true, ..letter(100, false) });
        let mut read = Vec::new();
        while read.last() != Some(&100) {
            read.extend(outbox.take().map(|letter| letter.bytes[0]));
        }
        assert!(read.windows(2).all(|pair| pair[0] < pair[1]), "in order");
        assert_eq!(read.iter().filter(|number| **number % 10 == 0).count(), 11, "answers are never skipped");
        assert_eq!(displaced, 101 - read.len() as u64);
        assert!(displaced > 70 && read.contains(&99), "{read:?}");
        outbox.close();
        assert!(outbox.take().is_none());
    }
}
