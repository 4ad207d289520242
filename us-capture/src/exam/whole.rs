//! [`Exam`]: everything of an exam at once.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use crate::PlacedBScan;
use crate::exam::{Attachment, Ending, Event, ExamError, ExamEvent, ExamHeader, ExamReader, TickRecord};

/// An exam in memory: about 0.3 MB for every B-scan of 640 x 480. Use an [`ExamReader`] where that is too much.
#[derive(Clone, Debug, PartialEq)]
pub struct Exam {
    /// What it is.
    pub header: ExamHeader,
    /// Ticks, in order.
    pub ticks: Vec<TickRecord>,
    /// B-scans, in order.
    pub bscans: Vec<PlacedBScan>,
    /// Events, in order.
    pub events: Vec<Event>,
    /// Attachments, in order.
    pub attachments: Vec<Attachment>,
    /// Metadata records beyond the header, by name.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Where bytes were damaged, and how.
    pub damaged: Vec<(u64, String)>,
    /// How the file ends.
    pub ending: Ending,
}

impl Exam {
    /// Reads a whole exam file.
    ///
    /// # Errors
    /// When it cannot be opened or read, is no exam, or holds nothing. A cut or damaged file is read as far as it is
    /// whole: look at [`Exam::ending`] and [`Exam::damaged`].
    pub fn open(path: &Path) -> Result<Self, ExamError> {
        Self::collect(ExamReader::open(path)?)
    }

    /// The same without its ticks: a minute of them takes more memory than a hundred B-scans.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn without_ticks(path: &Path) -> Result<Self, ExamError> {
        let mut reader = ExamReader::open(path)?;
        let mut exam = Self::empty(reader.header().clone());
        while let Some(event) = reader.next_event()? {
            if !matches!(event, ExamEvent::Tick(_)) {
                exam.add(event);
            }
        }
        exam.ending = reader.ending().cloned().unwrap_or(Ending::Complete);
        Ok(exam)
    }

    /// Reads everything that a reader still has.
    ///
    /// # Errors
    /// When bytes could not be read.
    pub fn collect<R: Read>(mut reader: ExamReader<R>) -> Result<Self, ExamError> {
        let mut exam = Self::empty(reader.header().clone());
        while let Some(event) = reader.next_event()? {
            exam.add(event);
        }
        exam.ending = reader.ending().cloned().unwrap_or(Ending::Complete);
        Ok(exam)
    }

    fn empty(header: ExamHeader) -> Self {
        Self {
            header,
            ticks: Vec::new(),
            bscans: Vec::new(),
            events: Vec::new(),
            attachments: Vec::new(),
            metadata: BTreeMap::new(),
            damaged: Vec::new(),
            ending: Ending::Complete,
        }
    }

    fn add(&mut self, event: ExamEvent) {
        match event {
            ExamEvent::Tick(tick) => self.ticks.push(tick),
            ExamEvent::BScan(placed) => self.bscans.push(placed),
            ExamEvent::Event(event) => self.events.push(event),
            ExamEvent::Attachment(attachment) => self.attachments.push(attachment),
            ExamEvent::Metadata { name, values } => {
                self.metadata.insert(name, values);
            }
            ExamEvent::Damaged { at_byte, why } => self.damaged.push((at_byte, why)),
        }
    }

    /// The attachment of that name, the last if there are several.
    pub fn attachment(&self, name: &str) -> Option<&Attachment> {
        self.attachments.iter().rev().find(|attachment| attachment.name == name)
    }
}
