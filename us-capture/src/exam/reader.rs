//! [`ExamReader`]: an exam, one event after the other.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;
use std::sync::Arc;

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::content::Content;
use super::file::{PROFILE, RECORD_LIMIT};
use super::parse;
use crate::PlacedBScan;
use crate::exam::{Attachment, Event, ExamError, ExamHeader, TickRecord};

/// Asked of the file at most at once (bytes), so that a damaged length takes no more memory than there are bytes.
const BITE: usize = 1 << 16;
/// Opcode and length in front of every record.
const RECORD_HEAD: u64 = 9;

/// Something that an exam holds, in the order it was written.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "one at a time, handed on at once: a box for every tick would cost more"
)]
pub enum ExamEvent {
    /// A tick of the control loop.
    Tick(TickRecord),
    /// A B-scan that knows where it was.
    BScan(PlacedBScan),
    /// What happened, in words.
    Event(Event),
    /// A file inside the file.
    Attachment(Attachment),
    /// A metadata record beyond the header.
    Metadata {
        /// Its name.
        name: String,
        /// Its values.
        values: BTreeMap<String, String>,
    },
    /// Bytes that were damaged and stepped over.
    Damaged {
        /// Where the damaged record begins.
        at_byte: u64,
        /// What is wrong with it.
        why: String,
    },
}

/// How a file ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// As it should: the recording was finished.
    Complete,
    /// In the middle: the recording was cut short, by a crash or a full disk.
    Cut {
        /// Everything before this byte was whole.
        whole_until_byte: u64,
        /// The file's size.
        bytes: u64,
    },
    /// At its end, but a checksum over all of it is wrong: whatever was damaged was stepped over and named.
    Damaged {
        /// Which checksum.
        why: String,
    },
    /// So damaged that what follows cannot be told from noise.
    Lost {
        /// Everything before this byte was read.
        at_byte: u64,
        /// What was found there.
        why: String,
    },
}

/// Reads an exam, whole, cut short or damaged. Holds one chunk at a time, whatever the file's size.
pub struct ExamReader<R> {
    source: R,
    name: String,
    mcap: LinearReader,
    /// Bytes taken from the source.
    read: u64,
    /// Bytes of whole records.
    whole: u64,
    content: Content,
    events: VecDeque<ExamEvent>,
    header: ExamHeader,
    ending: Option<Ending>,
}

impl ExamReader<BufReader<File>> {
    /// Opens an exam file.
    ///
    /// # Errors
    /// When it cannot be opened, is no exam, or holds nothing.
    pub fn open(path: &Path) -> Result<Self, ExamError> {
        let name = path.display().to_string();
        match File::open(path) {
            Ok(file) => Self::new(BufReader::new(file), name),
            Err(source) => Err(ExamError::Open { name, source: Arc::new(source) }),
        }
    }
}

impl<R: Read> ExamReader<R> {
    /// Reads an exam from anything that gives bytes; `name` is for messages.
    ///
    /// # Errors
    /// When it is no exam, or ends before its header.
    pub fn new(source: R, name: impl Into<String>) -> Result<Self, ExamError> {
        let mut reader = Self {
            source,
            name: name.into(),
            mcap: LinearReader::new_with_options(options().with_emit_chunks(true)),
            read: 0,
            whole: 8,
            content: Content::default(),
            events: VecDeque::new(),
            header: ExamHeader::unknown(),
            ending: None,
        };
        reader.begin()?;
        Ok(reader)
    }

    /// What the exam is.
    pub const fn header(&self) -> &ExamHeader {
        &self.header
    }

    /// How the file ends; `None` until everything was read.
    pub const fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// The next event; `None` at the end, and then [`ExamReader::ending`] says how it ends.
    ///
    /// # Errors
    /// When bytes could not be read. Damage is no error: it is an event, or the ending.
    pub fn next_event(&mut self) -> Result<Option<ExamEvent>, ExamError> {
        while self.events.is_empty() && self.ending.is_none() {
            self.record()?;
        }
        Ok(self.events.pop_front())
    }

    /// The MCAP header and the exam's own, which is the first record after it.
    fn begin(&mut self) -> Result<(), ExamError> {
        let missing = |reader: &Self, why: &str| ExamError::NoHeader {
            name: reader.name.clone(),
            byte: reader.read,
            why: why.into(),
        };
        let Some((op::HEADER, body)) = self.take_record()? else {
            return Err(missing(self, &self.why_ended()));
        };
        let profile = parse::profile(&body).unwrap_or_default();
        if profile != PROFILE {
            return Err(ExamError::NotAnExam { name: self.name.clone(), profile: profile.into() });
        }
        let Some((op::METADATA, body)) = self.take_record()? else {
            return Err(missing(self, &self.why_ended()));
        };
        match parse::metadata(&body) {
            Some((name, values)) if name == ExamHeader::NAME => {
                self.header = ExamHeader::from_metadata(&values)?
            }
            _ => return Err(missing(self, "its first record is damaged")),
        }
        Ok(())
    }

    fn why_ended(&self) -> String {
        match &self.ending {
            Some(Ending::Lost { why, .. }) => why.clone(),
            Some(Ending::Cut { .. }) => "it is cut short".into(),
            _ => "another record stands there".into(),
        }
    }

    /// One record, its events queued.
    fn record(&mut self) -> Result<(), ExamError> {
        let at_byte = self.whole;
        if let Some((opcode, body)) = self.take_record()? {
            self.content.record(opcode, &body, at_byte, &mut self.events);
        }
        Ok(())
    }

    /// The next whole record; `None` at the end, with the ending set.
    fn take_record(&mut self) -> Result<Option<(u8, Vec<u8>)>, ExamError> {
        loop {
            let wanted = match self.mcap.next_event() {
                None => {
                    self.ending = Some(Ending::Complete);
                    return Ok(None);
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.whole += RECORD_HEAD + data.len() as u64;
                    return Ok(Some((opcode, data.to_vec())));
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => wanted,
                Some(Err(error)) => return self.end_by(error),
            };
            self.feed(wanted)?;
        }
    }

    fn end_by(&mut self, error: McapError) -> Result<Option<(u8, Vec<u8>)>, ExamError> {
        self.ending = Some(match error {
            McapError::UnexpectedEof => {
                Ending::Cut { whole_until_byte: self.whole.min(self.read), bytes: self.read }
            }
            McapError::BadMagic if self.whole == 8 => {
                let why = "it does not begin with the eight bytes of one".into();
                return Err(ExamError::NotMcap { name: self.name.clone(), why });
            }
            McapError::BadDataCrc { .. } | McapError::BadSummaryCrc { .. } => {
                Ending::Damaged { why: error.to_string() }
            }
            error => Ending::Lost { at_byte: self.whole, why: error.to_string() },
        });
        Ok(None)
    }

    fn feed(&mut self, wanted: usize) -> Result<(), ExamError> {
        let room = self.mcap.insert(wanted.min(BITE));
        let count = loop {
            match self.source.read(room) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Ok(count) => break count,
                Err(source) => {
                    let (name, byte) = (self.name.clone(), self.read);
                    return Err(ExamError::Read { name, byte, source: Arc::new(source) });
                }
            }
        };
        self.mcap.notify_read(count);
        self.read += count as u64;
        Ok(())
    }
}

/// Every checksum, and a limit on every length.
pub(crate) fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_record_length_limit(RECORD_LIMIT)
        .with_prevalidate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
}
