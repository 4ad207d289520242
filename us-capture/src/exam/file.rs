//! [`ExamFile`]: writes an exam, on the caller's thread.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions};
use probepath_frames::{Span, Stamp};
use prost::Message;

use super::channels::{Channels, Topic};
use super::{encode, parse};
use crate::PlacedBScan;
use crate::exam::{Attachment, Event, ExamError, ExamHeader, Surface, TickRecord};

/// A chunk is closed when its messages span this much exam time (ns)...
const CHUNK_NS: u64 = 1_000_000_000;
/// ...or hold this many bytes: three B-scans or so, which bounds what a reader has to hold.
const CHUNK_BYTES: usize = 1 << 20;
/// Viewers get a pose, a wrench and the joints about this often: 50 times a second.
const VIEWER_PERIOD: Span = Span::from_milliseconds(20);
/// Fast: pixels with speckle hardly compress further at any level.
const ZSTD_LEVEL: u32 = 1;
/// The MCAP profile of an exam.
pub(crate) const PROFILE: &str = "probepath";
/// No record of an exam is larger (bytes); a reader refuses more, so that a damaged length asks for no more memory.
pub(crate) const RECORD_LIMIT: usize = 64 << 20;

/// Writes an exam to anything that takes bytes: a file, a socket, memory.
///
/// Its bytes depend on the calls alone, never on a clock, a thread or the machine. After the first error nothing more
/// is written, so what was on the disk stays readable.
pub struct ExamFile<W: Write> {
    mcap: Result<mcap::Writer<NoSeek<W>>, ExamError>,
    channels: Channels,
    joint_names: Vec<String>,
    written: Written,
    chunk: Chunk,
    next_view: Option<Stamp>,
    buffer: Vec<u8>,
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Ticks.
    pub ticks: u64,
    /// B-scans.
    pub bscans: u64,
    /// Events.
    pub events: u64,
    /// Attachments.
    pub attachments: u64,
}

/// What the open chunk holds.
#[derive(Clone, Copy, Debug, Default)]
struct Chunk {
    first_ns: Option<u64>,
    bytes: usize,
}

impl<W: Write> ExamFile<W> {
    /// Begins an exam.
    ///
    /// # Errors
    /// When the study code could be a name, or the first bytes cannot be written.
    pub fn new(sink: W, header: &ExamHeader) -> Result<Self, ExamError> {
        let metadata = header.to_metadata()?;
        let mcap = options().create(NoSeek::new(sink)).map_err(|error| fault(error, Written::default()))?;
        let mut file = Self {
            mcap: Ok(mcap),
            channels: Channels::default(),
            joint_names: header.joint_names.clone(),
            written: Written::default(),
            chunk: Chunk::default(),
            next_view: None,
            buffer: Vec::new(),
        };
        file.metadata(ExamHeader::NAME, metadata)?;
        Ok(file)
    }

    /// Records one tick, and about 50 times a second what viewers show.
    ///
    /// # Errors
    /// When bytes could not be written, now or earlier.
    pub fn tick(&mut self, record: &TickRecord) -> Result<(), ExamError> {
        let stamp = record.stamp;
        self.begin(stamp)?;
        self.put(Topic::Tick, stamp, stamp, &encode::tick(record))?;
        if self.next_view.is_none_or(|next| stamp >= next) {
            self.next_view = Some(stamp + VIEWER_PERIOD);
            self.view(record)?;
        }
        self.written.ticks += 1;
        self.end()
    }

    /// What viewers show of a tick.
    fn view(&mut self, record: &TickRecord) -> Result<(), ExamError> {
        let stamp = record.stamp;
        let measured =
            encode::joint_states(&self.joint_names, stamp, &record.position, Some(&record.velocity));
        self.put(Topic::JointStates, stamp, stamp, &measured)?;
        let commanded = encode::joint_states(&self.joint_names, stamp, &record.commanded, None);
        self.put(Topic::JointCommands, stamp, stamp, &commanded)?;
        self.put(Topic::Wrench, stamp, stamp, &encode::wrench(&record.wrench))?;
        match &record.world_from_probe {
            Some(pose) => self.put(Topic::Transform, stamp, stamp, &encode::transform(stamp, pose)),
            None => Ok(()),
        }
    }

    /// Records one B-scan: its pixels, its plane's pose for viewers, then everything else.
    ///
    /// # Errors
    /// When it is larger than a record may be, or bytes could not be written, now or earlier.
    pub fn bscan(&mut self, placed: &PlacedBScan) -> Result<(), ExamError> {
        let (formed, arrived) = (placed.bscan.formed, placed.bscan.arrived);
        check_size(&format!("B-scan {}", placed.bscan.number), placed.bscan.pixels().len())?;
        self.begin(arrived)?;
        self.put(Topic::Image, arrived, formed, &encode::raw_image(&placed.bscan))?;
        // A topic of its own: viewers want each topic in order, and images come later than the ticks beside them.
        self.put(
            Topic::ImageTransform,
            arrived,
            formed,
            &encode::transform(formed, &placed.world_from_image),
        )?;
        self.put(Topic::BScan, arrived, formed, &encode::bscan(placed))?;
        self.written.bscans += 1;
        self.end()
    }

    /// Records what happened, in words.
    ///
    /// # Errors
    /// When bytes could not be written, now or earlier.
    pub fn event(&mut self, event: &Event) -> Result<(), ExamError> {
        self.begin(event.stamp)?;
        self.put(Topic::Events, event.stamp, event.stamp, &encode::log(event))?;
        self.written.events += 1;
        self.end()
    }

    /// Records a surface for viewers.
    ///
    /// # Errors
    /// When a triangle names a corner that is not there, it is larger than a record may be, or bytes could not be
    /// written, now or earlier.
    pub fn surface(&mut self, surface: &Surface) -> Result<(), ExamError> {
        let corners = surface.vertices.len();
        if let Some(wrong) = surface.triangles.iter().flatten().find(|index| **index as usize >= corners) {
            let why = format!("a triangle names corner {wrong} of {corners}");
            return Err(ExamError::BadRecord { what: format!("surface {}", surface.name), why });
        }
        // Three doubles and their keys; three indices of four bytes.
        check_size(&surface.name, corners * 29 + surface.triangles.len() * 12)?;
        self.begin(surface.stamp)?;
        self.put(Topic::Surface, surface.stamp, surface.stamp, &encode::scene(surface))?;
        self.end()
    }

    /// Puts a file into the exam file. It closes the chunk: attach at the beginning, at the end, and seldom between.
    ///
    /// # Errors
    /// When it is larger than a record may be, or bytes could not be written, now or earlier.
    pub fn attach(&mut self, attachment: &Attachment) -> Result<(), ExamError> {
        check_size(&attachment.name, attachment.bytes.len())?;
        // No stamps of the wall clock: the same exam has the same bytes.
        let record = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: attachment.name.clone(),
            media_type: attachment.media_type.clone(),
            data: Cow::Borrowed(&attachment.bytes),
        };
        self.write(|mcap, _| mcap.attach(&record).and_then(|()| mcap.flush()))?;
        self.written.attachments += 1;
        self.chunk = Chunk::default();
        Ok(())
    }

    /// Writes a metadata record: names and values of your own, in the order of the names, and a value `checksum` over
    /// them (MCAP has none for metadata).
    ///
    /// # Errors
    /// When bytes could not be written, now or earlier.
    pub fn metadata(&mut self, name: &str, values: BTreeMap<String, String>) -> Result<(), ExamError> {
        let mut metadata = values;
        metadata.remove(parse::CHECKSUM);
        let checksum = parse::metadata_checksum(name, &metadata);
        metadata.insert(parse::CHECKSUM.into(), checksum);
        let record = Metadata { name: name.into(), metadata };
        self.write(|mcap, _| mcap.write_metadata(&record).and_then(|()| mcap.flush()))?;
        self.chunk = Chunk::default();
        Ok(())
    }

    /// What was written so far.
    pub const fn written(&self) -> Written {
        self.written
    }

    /// Ends the exam: closes the chunk, writes the index that viewers seek by, and gives back the sink.
    ///
    /// # Errors
    /// When bytes could not be written, now or earlier.
    pub fn finish(mut self) -> Result<(W, Written), ExamError> {
        let written = self.written;
        self.metadata(Written::NAME, written.to_metadata())?;
        self.write(|mcap, _| mcap.finish().map(|_| ()))?;
        let mcap = self.mcap?;
        Ok((mcap.into_inner().into_inner(), written))
    }

    /// Before a record of this stamp: closes a chunk that spans its second.
    fn begin(&mut self, stamp: Stamp) -> Result<(), ExamError> {
        let now = log_time(stamp);
        match self.chunk.first_ns {
            Some(first) if now >= first.saturating_add(CHUNK_NS) => self.close_chunk()?,
            _ => {}
        }
        self.chunk.first_ns.get_or_insert(now);
        Ok(())
    }

    /// After a record: closes a chunk that is full.
    fn end(&mut self) -> Result<(), ExamError> {
        if self.chunk.bytes >= CHUNK_BYTES { self.close_chunk() } else { Ok(()) }
    }

    fn close_chunk(&mut self) -> Result<(), ExamError> {
        self.chunk = Chunk::default();
        self.write(|mcap, _| mcap.flush())
    }

    fn put(
        &mut self,
        topic: Topic,
        logged: Stamp,
        published: Stamp,
        message: &impl Message,
    ) -> Result<(), ExamError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        message.encode_raw(&mut buffer);
        let (log_time, publish_time) = (log_time(logged), log_time(published));
        let done = self.write(|mcap, channels| {
            let (channel_id, sequence) = (topic.id(), channels.next(topic, mcap)?);
            mcap.write_to_known_channel(
                &MessageHeader { channel_id, sequence, log_time, publish_time },
                &buffer,
            )
        });
        self.chunk.bytes += buffer.len();
        self.buffer = buffer;
        done
    }

    /// The one place that writes. The first error is the last: a writer that went on behind a half-written record
    /// would make what follows unreadable, and one that is dropped would try to finish the file.
    fn write(
        &mut self,
        write: impl FnOnce(&mut mcap::Writer<NoSeek<W>>, &mut Channels) -> Result<(), McapError>,
    ) -> Result<(), ExamError> {
        let mcap = self.mcap.as_mut().map_err(|error| error.clone())?;
        let Err(error) = write(mcap, &mut self.channels) else { return Ok(()) };
        let error = fault(error, self.written);
        if let Ok(broken) = std::mem::replace(&mut self.mcap, Err(error.clone())) {
            drop(broken.into_inner());
        }
        Err(error)
    }
}

impl Written {
    /// Name of its metadata record.
    pub(crate) const NAME: &str = "probepath.written";

    fn to_metadata(self) -> BTreeMap<String, String> {
        let counts = [
            ("ticks", self.ticks),
            ("bscans", self.bscans),
            ("events", self.events),
            ("attachments", self.attachments),
        ];
        counts.into_iter().map(|(name, count)| (name.to_owned(), count.to_string())).collect()
    }
}

/// Chunks are buffered and written whole, so that the length in front of a chunk is always true; compressed on this
/// thread, because the number of compressing threads would show in the bytes.
fn options() -> WriteOptions {
    WriteOptions::new()
        .profile(PROFILE)
        .library(concat!("probepath-us-capture/", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0)
        .disable_seeking(true)
        .chunk_size(None)
}

fn fault(error: McapError, written: Written) -> ExamError {
    let source = match error {
        McapError::Io(source) => source,
        other => std::io::Error::other(other),
    };
    ExamError::Write { ticks: written.ticks, bscans: written.bscans, source: Arc::new(source) }
}

/// MCAP counts from zero: what lies before the exam's zero is logged at zero.
fn log_time(stamp: Stamp) -> u64 {
    stamp.nanoseconds().max(0).unsigned_abs()
}

fn check_size(what: &str, bytes: usize) -> Result<(), ExamError> {
    let most = RECORD_LIMIT / 2;
    if bytes > most {
        return Err(ExamError::TooLarge { what: what.into(), bytes, most });
    }
    Ok(())
}
