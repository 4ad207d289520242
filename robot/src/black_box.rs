//! [`BlackBox`]: the last ticks before a fault, kept without touching the heap.

use crate::Tick;

/// How many ticks are kept when nobody says otherwise: two seconds at 500 Hz.
const KEPT: usize = 1000;

/// A ring of the last ticks, allocated once.
#[derive(Clone, PartialEq)]
pub struct BlackBox {
    ticks: Vec<Tick>,
    room: usize,
    /// Where the oldest is, once the ring is full.
    oldest: usize,
    seen: u64,
}

impl BlackBox {
    /// Keeps the last `room` ticks (at least one).
    pub fn new(room: usize) -> Self {
        let room = room.max(1);
        Self { ticks: Vec::with_capacity(room), room, oldest: 0, seen: 0 }
    }

    /// Keeps a tick, and forgets the oldest when there is no more room.
    pub fn push(&mut self, tick: &Tick) {
        self.seen += 1;
        if self.ticks.len() < self.room {
            self.ticks.push(*tick);
        } else if let Some(slot) = self.ticks.get_mut(self.oldest) {
            *slot = *tick;
            self.oldest = (self.oldest + 1) % self.room;
        }
    }

    /// Forgets everything; the room stays.
    pub fn clear(&mut self) {
        self.ticks.clear();
        (self.oldest, self.seen) = (0, 0);
    }

    /// The ticks kept, oldest first.
    pub fn ticks(&self) -> impl Iterator<Item = &Tick> {
        let (newer, older) = self.ticks.split_at(self.oldest.min(self.ticks.len()));
        older.iter().chain(newer)
    }

    /// The last tick.
    pub fn last(&self) -> Option<&Tick> {
        self.ticks().last()
    }

    /// How many ticks were seen, kept or not.
    pub const fn seen(&self) -> u64 {
        self.seen
    }
}

impl Default for BlackBox {
    fn default() -> Self {
        Self::new(KEPT)
    }
}

/// Short, because it travels inside errors: a thousand ticks in a message help nobody.
impl std::fmt::Debug for BlackBox {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "BlackBox({} of {} ticks)", self.ticks.len(), self.seen)
    }
}
