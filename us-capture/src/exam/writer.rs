//! [`ExamWriter`]: an [`ExamFile`] on a thread of its own, behind a bounded queue.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;

use probepath_frames::Stamp;

use crate::PlacedBScan;
use crate::exam::{Attachment, Event, ExamError, ExamFile, ExamHeader, Level, Surface, TickRecord, Written};

/// Room in the queue: eight seconds at 500 ticks a second.
const QUEUE: usize = 4096;

/// What happens when the disk falls behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Time is simulated: the caller waits, nothing is ever lost, the same seed gives the same bytes.
    Simulated,
    /// Time is real: the caller never waits; what finds no room is lost, counted, and said in the file.
    RealTime,
}

/// What found no room in the queue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// Ticks.
    pub ticks: u64,
    /// B-scans.
    pub bscans: u64,
    /// Events.
    pub events: u64,
}

/// Records an exam without making the control loop wait.
///
/// A tick that is recorded touches no heap here. When writing fails, [`ExamWriter::fault`] says so from then on, and
/// [`ExamWriter::finish`] gives the error: recording calls have no error of their own, because a loop that moves an
/// arm must not end between two ticks for a full disk. Stop the arm on a fault.
pub struct ExamWriter {
    queue: SyncSender<Entry>,
    /// `None` only while the writer is being dropped.
    thread: Option<JoinHandle<Result<Written, ExamError>>>,
    pace: Pace,
    shared: Arc<Shared>,
}

/// What both sides see.
#[derive(Debug, Default)]
struct Shared {
    fault: OnceLock<ExamError>,
    ticks: AtomicU64,
    bscans: AtomicU64,
    events: AtomicU64,
}

#[expect(clippy::large_enum_variant, reason = "a boxed tick would touch the heap in the control loop")]
enum Entry {
    Tick(TickRecord),
    BScan(Box<PlacedBScan>),
    Event(Box<Event>),
    Attachment(Box<Attachment>),
    Surface(Box<Surface>),
    End,
}

impl ExamWriter {
    /// Begins an exam in a new file; an old one of that name is replaced.
    ///
    /// # Errors
    /// When the file cannot be created, or the header is refused.
    pub fn create(path: &Path, header: &ExamHeader, pace: Pace) -> Result<Self, ExamError> {
        let open = |source| ExamError::Open { name: path.display().to_string(), source: Arc::new(source) };
        let file = File::create(path).map_err(open)?;
        Self::new(Disk { file: BufWriter::new(file), synced: pace == Pace::RealTime }, header, pace)
    }

    /// Begins an exam in anything that takes bytes.
    ///
    /// # Errors
    /// When the header is refused, the first bytes cannot be written, or no thread can be started.
    pub fn new<W: Write + Send + 'static>(
        sink: W,
        header: &ExamHeader,
        pace: Pace,
    ) -> Result<Self, ExamError> {
        Self::with_room(sink, header, pace, QUEUE)
    }

    pub(crate) fn with_room<W: Write + Send + 'static>(
        sink: W,
        header: &ExamHeader,
        pace: Pace,
        room: usize,
    ) -> Result<Self, ExamError> {
        let file = ExamFile::new(sink, header)?;
        let (queue, entries) = sync_channel(room);
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("exam".into())
            .spawn(move || Drain { file, shared: theirs, told: Lost::default(), refused: None }.run(&entries))
            .map_err(|source| ExamError::Write { ticks: 0, bscans: 0, source: Arc::new(source) })?;
        Ok(Self { queue, thread: Some(thread), pace, shared })
    }

    /// Records one tick.
    pub fn tick(&self, record: TickRecord) {
        self.offer(Entry::Tick(record), &self.shared.ticks);
    }

    /// Records one B-scan.
    pub fn bscan(&self, placed: PlacedBScan) {
        self.offer(Entry::BScan(Box::new(placed)), &self.shared.bscans);
    }

    /// Records what happened, in words.
    pub fn event(&self, event: Event) {
        self.offer(Entry::Event(Box::new(event)), &self.shared.events);
    }

    /// Puts a file into the exam file; waits for room, so not while an arm moves.
    pub fn attach(&self, attachment: Attachment) {
        // A thread that is gone says why in `finish`.
        let _ = self.queue.send(Entry::Attachment(Box::new(attachment)));
    }

    /// Records a surface for viewers; waits for room, so not while an arm moves.
    pub fn surface(&self, surface: Surface) {
        let _ = self.queue.send(Entry::Surface(Box::new(surface)));
    }

    /// Why nothing is written any more, if so. One atomic load: cheap enough for every tick.
    pub fn fault(&self) -> Option<&ExamError> {
        self.shared.fault.get()
    }

    /// What found no room so far.
    pub fn lost(&self) -> Lost {
        self.shared.lost()
    }

    /// Ends the exam and waits until everything is written.
    ///
    /// # Errors
    /// The first that writing met; or, when only a record was refused (an attachment that is too large), why: the
    /// rest is in the file.
    pub fn finish(mut self) -> Result<Written, ExamError> {
        self.end().unwrap_or(Err(ExamError::WriterGone))
    }

    fn end(&mut self) -> Option<Result<Written, ExamError>> {
        let thread = self.thread.take()?;
        // A thread that is gone says why by what it returns.
        let _ = self.queue.send(Entry::End);
        thread.join().ok()
    }

    fn offer(&self, entry: Entry, lost: &AtomicU64) {
        let taken = match self.pace {
            Pace::Simulated => self.queue.send(entry).is_ok(),
            Pace::RealTime => match self.queue.try_send(entry) {
                Ok(()) => true,
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => false,
            },
        };
        if !taken {
            lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// An exam that is left by an error is still ended: its index is written and nothing waits in the queue.
impl Drop for ExamWriter {
    fn drop(&mut self) {
        let _ = self.end();
    }
}

/// A file whose chunks reach the disk itself, not only the system, when time is real: a power cut costs a second.
struct Disk {
    file: BufWriter<File>,
    synced: bool,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()?;
        if self.synced { self.file.get_ref().sync_data() } else { Ok(()) }
    }
}

impl Shared {
    fn lost(&self) -> Lost {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Lost { ticks: count(&self.ticks), bscans: count(&self.bscans), events: count(&self.events) }
    }
}

/// The thread's side.
struct Drain<W: Write> {
    file: ExamFile<W>,
    shared: Arc<Shared>,
    told: Lost,
    /// The first record that was refused for what it is, not for the disk.
    refused: Option<ExamError>,
}

impl<W: Write> Drain<W> {
    fn run(mut self, entries: &Receiver<Entry>) -> Result<Written, ExamError> {
        let mut now = Stamp::ZERO;
        for entry in entries {
            if matches!(entry, Entry::End) {
                break;
            }
            match self.write(&entry, &mut now) {
                Ok(()) => {}
                // Nothing is written after this; the rest is still taken, so that nobody waits for room.
                Err(error @ ExamError::Write { .. }) => drop(self.shared.fault.set(error)),
                Err(error) => self.refuse(error, now),
            }
        }
        self.end(now)
    }

    fn write(&mut self, entry: &Entry, now: &mut Stamp) -> Result<(), ExamError> {
        match entry {
            Entry::Tick(record) => {
                *now = record.stamp;
                self.file.tick(record)?;
            }
            Entry::BScan(placed) => self.file.bscan(placed)?,
            Entry::Event(event) => self.file.event(event)?,
            Entry::Surface(surface) => self.file.surface(surface)?,
            Entry::Attachment(attachment) => self.file.attach(attachment)?,
            Entry::End => {}
        }
        self.tell_lost(*now)
    }

    /// Says in the file what found no room, when more did since the last time.
    fn tell_lost(&mut self, now: Stamp) -> Result<(), ExamError> {
        let lost = self.shared.lost();
        if lost == self.told {
            return Ok(());
        }
        let text = format!(
            "the disk was too slow: {} ticks, {} B-scans and {} events were not recorded",
            lost.ticks - self.told.ticks,
            lost.bscans - self.told.bscans,
            lost.events - self.told.events
        );
        self.told = lost;
        self.file.event(&Event { stamp: now, level: Level::Error, source: "exam".into(), text })
    }

    /// Says in the file what it does not hold, and keeps the reason for `finish`.
    fn refuse(&mut self, error: ExamError, now: Stamp) {
        let event = Event { stamp: now, level: Level::Error, source: "exam".into(), text: error.to_string() };
        self.refused.get_or_insert(error);
        if let Err(error) = self.file.event(&event) {
            let _ = self.shared.fault.set(error);
        }
    }

    fn end(mut self, now: Stamp) -> Result<Written, ExamError> {
        let fault = self.shared.fault.get().cloned();
        self.tell_lost(now).ok();
        let finished = self.file.finish();
        match fault.or(self.refused) {
            Some(error) => Err(error),
            None => finished.map(|(_, written)| written),
        }
    }
}
