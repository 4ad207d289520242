//! The exam: one MCAP file that holds a whole examination, and that Foxglove and Rerun open as it is.
//!
//! ```
//! use probepath_frames::{Span, Stamp};
//! use probepath_us_capture::exam::{Event, ExamEvent, ExamFile, ExamHeader, ExamReader, Level};
//!
//! # fn main() -> Result<(), probepath_us_capture::exam::ExamError> {
//! let header = ExamHeader {
//!     software: "probepath 0.1.0".into(),
//!     study_code: "LEG-007".into(),
//!     protocol: "femoral".into(),
//!     protocol_sha256: ExamHeader::sha256("scan(mm(200));"),
//!     calibration_id: "phantom-7cm".into(),
//!     seed: Some(1),
//!     joint_names: vec!["shoulder".into(), "elbow".into()],
//!     period: Span::from_milliseconds(2),
//! };
//! let mut file = ExamFile::new(Vec::new(), &header)?;
//! let begun = Event { stamp: Stamp::ZERO, level: Level::Info, source: "session".into(), text: "begun".into() };
//! file.event(&begun)?;
//! let (bytes, _written) = file.finish()?;
//!
//! let mut reader = ExamReader::new(bytes.as_slice(), "a test")?;
//! assert_eq!(reader.header(), &header);
//! assert_eq!(reader.next_event()?, Some(ExamEvent::Event(begun)));
//! # Ok(()) }
//! ```
//!
//! The nouns: an [`ExamFile`] writes, on the caller's thread; an [`ExamWriter`] is the same behind a bounded queue, so
//! that a control loop never waits for a disk; an [`ExamReader`] gives back [`ExamEvent`]s one after the other, its
//! memory bounded by one chunk whatever the file's size; an [`Exam`] is all of it at once.
//!
//! # What is in it
//!
//! | topic | schema | when |
//! |---|---|---|
//! | `/tick` | `probepath.Tick` | every tick, exact to the bit: command, state, wrench, the probe's pose |
//! | `/bscan` | `probepath.BScan` | every B-scan: stamps, setting, pixel spacing, poses, wrench |
//! | `/bscan/image` | `foxglove.RawImage` | its pixels (mono8), just before |
//! | `/bscan/tf` | `foxglove.FrameTransform` | World to Image, with every B-scan |
//! | `/tf` | `foxglove.FrameTransform` | World to Probe about 50 times a second |
//! | `/joint_states`, `/joint_commands` | `foxglove.JointStates` | about 50 times a second, for viewers |
//! | `/wrench` | `probepath.Wrench` | about 50 times a second, for viewers |
//! | `/events` | `foxglove.Log` | events |
//! | `/surface` | `foxglove.SceneUpdate` | the lumen's surface, once it is reconstructed, for viewers |
//!
//! Attachments: the arm's URDF, cell description, calibration, protocol, taught path, report (names in
//! [`Attachment`]). Metadata: `probepath.exam` ([`ExamHeader`]) first, `probepath.written` ([`Written`]) last.
//! Time is the exam's clock, so it starts near 1970 in viewers. Log time is when something arrived, publish time and
//! the message's own stamp are when it was formed.
//!
//! # What it survives
//!
//! A chunk is closed at least every second of exam time. A file cut anywhere gives back every chunk before the cut; a
//! damaged chunk is named and stepped over; a full disk is an error that leaves what was written readable. Chunks
//! depend on content alone, never on a clock or on threads: the same calls give the same bytes.
//!
//! # What it costs
//!
//! Measured by `--example exam_size` (dev profile, 2 busy cores): a minute of ticks at 500 a second is 6.9 MB, a B-scan
//! of 640 x 480 about 0.24 MB; handing a tick over takes 0.05 us (p99 0.15), writing it 5 to 8 us of the other thread.
//! Reading the 293 MB of a minute with 1,200 B-scans took 9 MB of memory.
//!
//! What it does not do: know any robot (a [`Row`] is plain numbers), or hold anybody's name.

mod channels;
mod content;
mod decode;
mod encode;
mod error;
mod file;
mod parse;
mod proto;
mod reader;
mod record;
mod schema;
mod whole;
mod writer;

pub use error::ExamError;
pub use file::{ExamFile, Written};
pub use reader::{Ending, ExamEvent, ExamReader};
pub use record::{Attachment, Event, ExamHeader, Level, ROW_ROOM, Row, Surface, TickRecord};
pub use whole::Exam;
pub use writer::{ExamWriter, Lost, Pace};

#[cfg(test)]
mod tests;
