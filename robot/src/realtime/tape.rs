//! [`tape`]: every tick carried out of the control thread, which never waits for whoever reads it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use crate::{Observer, Tick, Wish};

/// A tick, and the mark that was put on it (where the controller was then).
pub type Marked<M> = (Tick, M);

/// Room for eight seconds at 500 ticks a second.
pub const ROOM: usize = 4096;

/// Both ends of a tape with room for `room` ticks; `mark` is asked at every tick, on the writer's thread.
///
/// The queue has one writer and one reader, no lock and no heap after this: what finds no room is lost, and counted.
pub fn tape<M: Copy, F: FnMut() -> M>(room: usize, mark: F) -> (TapeWriter<M, F>, TapeReader<M>) {
    let (writer, reader) = RingBuffer::new(room);
    let shared = Arc::new(Shared::default());
    (TapeWriter { queue: writer, mark, shared: shared.clone() }, TapeReader { queue: reader, shared })
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    lost: AtomicU64,
}

/// The control thread's end: an [`Observer`].
pub struct TapeWriter<M, F> {
    queue: Producer<Marked<M>>,
    mark: F,
    shared: Arc<Shared>,
}

impl<M: Copy, F: FnMut() -> M> Observer for TapeWriter<M, F> {
    /// Stops where the reader asked for it, or is gone: nothing would be recorded any more. The reason is the reader's
    /// to keep, because words touch the heap.
    fn tick(&mut self, tick: &Tick) -> Wish {
        if self.queue.push((*tick, (self.mark)())).is_err() {
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
        let unread = self.queue.is_abandoned();
        if unread || self.shared.stop.load(Ordering::Relaxed) {
            Wish::Stop(String::new())
        } else {
            Wish::GoOn
        }
    }
}

/// The other end, for a thread that may take its time.
pub struct TapeReader<M> {
    queue: Consumer<Marked<M>>,
    shared: Arc<Shared>,
}

impl<M> TapeReader<M> {
    /// The next tick, if one waits.
    pub fn take(&mut self) -> Option<Marked<M>> {
        self.queue.pop().ok()
    }

    /// Whether the writer is gone and every tick was taken.
    pub fn has_ended(&self) -> bool {
        // In this order: a writer that goes between the two looks has written before.
        self.queue.is_abandoned() && self.queue.is_empty()
    }

    /// Asks the loop to stop the arm at its next tick.
    pub fn stop(&self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }

    /// How many ticks found no room.
    pub fn lost(&self) -> u64 {
        self.shared.lost.load(Ordering::Relaxed)
    }
}
