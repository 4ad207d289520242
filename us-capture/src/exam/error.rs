//! What can be wrong with an exam file.

use std::io;
use std::sync::Arc;

use thiserror::Error;

/// Why an exam could not be written or read. Cloneable, so that the fault of the writing thread can be shown at once
/// and returned again at the end.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum ExamError {
    /// The file cannot be created or opened.
    #[error("exam {name}: cannot be opened: {source}")]
    Open {
        /// The file.
        name: String,
        /// The cause.
        source: Arc<io::Error>,
    },
    /// Bytes could not be written: a full disk, most often.
    #[error(
        "the exam could not be written after {ticks} ticks and {bscans} B-scans: {source}; \
         what was written before is readable; free some space, then scan again"
    )]
    Write {
        /// Ticks written, the last of them perhaps not yet on the disk.
        ticks: u64,
        /// B-scans written.
        bscans: u64,
        /// The cause.
        source: Arc<io::Error>,
    },
    /// The writing thread is gone.
    #[error("the exam's writing thread ended before the exam did")]
    WriterGone,
    /// Bytes could not be read.
    #[error("exam {name}: cannot be read after byte {byte}: {source}")]
    Read {
        /// The file.
        name: String,
        /// Bytes read so far.
        byte: u64,
        /// The cause.
        source: Arc<io::Error>,
    },
    /// Not an MCAP file at all.
    #[error(
        "{name} is not an MCAP file ({why}); an exam file ends in .mcap and is written by `probepath scan`"
    )]
    NotMcap {
        /// The file.
        name: String,
        /// What gave it away.
        why: String,
    },
    /// An MCAP file that somebody else wrote.
    #[error("{name} is an MCAP file, but no exam: its profile is {profile:?} instead of \"probepath\"")]
    NotAnExam {
        /// The file.
        name: String,
        /// The profile it names.
        profile: String,
    },
    /// The file ends, or is damaged, before its header could be read: nothing is known about it.
    #[error("exam {name} ends at byte {byte}, before its header: nothing was recorded ({why})")]
    NoHeader {
        /// The file.
        name: String,
        /// Where it ends.
        byte: u64,
        /// What was found instead.
        why: String,
    },
    /// A newer layout.
    #[error("the exam has format {found}, this software knows {known}: use the version that recorded it")]
    NewerFormat {
        /// The file's.
        found: u32,
        /// The newest known.
        known: u32,
    },
    /// A field of a metadata record is missing.
    #[error("the exam's metadata has no field `{field}`")]
    Missing {
        /// The field.
        field: &'static str,
    },
    /// A field of a metadata record does not parse.
    #[error("the exam's metadata field `{field}` cannot be read: {found:?}")]
    BadField {
        /// The field.
        field: &'static str,
        /// What is there.
        found: String,
    },
    /// Too many joints for one row.
    #[error("{found} joints in one row; an exam holds at most 8")]
    TooManyJoints {
        /// How many came.
        found: usize,
    },
    /// A study code that could be somebody's name.
    #[error(
        "study code {found:?} is refused: 1 to 64 letters, digits, '-', '_' or '.'; \
         a person's name has no place in an exam"
    )]
    StudyCode {
        /// What came.
        found: String,
    },
    /// An attachment that should be text and is not.
    #[error("attachment {name} is not text (UTF-8)")]
    NotText {
        /// The attachment.
        name: String,
    },
    /// Something larger than a record may be.
    #[error("{what} has {bytes} bytes; one record of an exam holds at most {most}")]
    TooLarge {
        /// What it is.
        what: String,
        /// Its size.
        bytes: usize,
        /// The limit.
        most: usize,
    },
    /// A record that does not say what its schema promises.
    #[error("{what}: {why}")]
    BadRecord {
        /// Which record.
        what: String,
        /// What is wrong with it.
        why: String,
    },
}
