//! Why a tracked sequence or a volume cannot be read or written.

use std::path::PathBuf;

use thiserror::Error;

/// What is wrong with a sequence file, where, and what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// The disk refused.
    #[error("cannot {doing} {path}", path = path.display())]
    Disk {
        /// `read` or `write`.
        doing: &'static str,
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// No header of a known kind, or one that never ends.
    #[error("not a MetaImage or NRRD file: {why}")]
    NotAHeader {
        /// What was missing.
        why: &'static str,
    },
    /// A line that says nothing.
    #[error("header line {line}: {why}: {text:?}")]
    BadLine {
        /// Counted from one.
        line: usize,
        /// What is wrong with it.
        why: &'static str,
        /// Its beginning.
        text: String,
    },
    /// A key that has to be there.
    #[error("the header has no {key}")]
    MissingKey {
        /// The key.
        key: &'static str,
    },
    /// A value that is none.
    #[error("header line {line}: {key} = {value:?}: {why}")]
    BadValue {
        /// Counted from one.
        line: usize,
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What is wrong with it.
        why: String,
    },
    /// Something the format allows and this reader does not.
    #[error("{key} = {value:?} is not supported: {why}")]
    Unsupported {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What would be.
        why: &'static str,
    },
    /// Images without an orientation: nobody knows which side is which.
    #[error(
        "the file does not say how its images are oriented (UltrasoundImageOrientation); \
         if you know it, say so: ReadOptions::assume_orientation (MF, UF, MN or UN)"
    )]
    NoOrientation,
    /// Lines along the beam.
    #[error(
        "orientation {orientation} means RF lines along the beam: convert the data to B-mode images first"
    )]
    RfLines {
        /// As the file says it.
        orientation: String,
    },
    /// A volume, not a sequence.
    #[error(
        "the last axis is of kind {kind:?}, not list or time: this is a volume, not a sequence of images"
    )]
    NotASequence {
        /// Kind of the last axis, empty when the file gives none.
        kind: String,
    },
    /// More than may be held.
    #[error("the header claims {needs} bytes of pixels, the limit is {limit}: raise ReadOptions::most_bytes")]
    TooLarge {
        /// Bytes claimed; saturated.
        needs: u64,
        /// The limit.
        limit: u64,
    },
    /// Pixels are missing.
    #[error("cut short: the header claims {needs} bytes of {what}, the file holds {holds}")]
    CutShort {
        /// `pixels` or `compressed pixels`.
        what: &'static str,
        /// Bytes claimed.
        needs: u64,
        /// Bytes there (for a compressed stream: that it could ever unpack to).
        holds: u64,
    },
    /// More pixels than the header says.
    #[error("wrong size: the header claims {needs} bytes of {what}, the file holds {holds}")]
    TooLong {
        /// `pixels` or `compressed pixels`.
        what: &'static str,
        /// Bytes claimed.
        needs: u64,
        /// Bytes there.
        holds: u64,
    },
    /// A compressed stream that is damaged or cut.
    #[error("the compressed pixels are damaged or cut, at image {image}")]
    BadStream {
        /// Counted from zero.
        image: u64,
        /// The cause.
        source: std::io::Error,
    },
    /// A field of an image that is not there.
    #[error("header line {line}: a field of image {number}, but the file has {images} images")]
    BeyondLast {
        /// Counted from one.
        line: usize,
        /// The image named.
        number: u64,
        /// How many there are.
        images: u64,
    },
    /// Something that PLUS, Slicer or this reader would not read back.
    #[error("image {number}: {field:?} cannot be written: {why}")]
    Unwritable {
        /// The image.
        number: u64,
        /// The field.
        field: String,
        /// What would not be understood.
        why: &'static str,
    },
    /// Images of different sizes in one sequence.
    #[error("image {number} has {bytes} bytes, the sequence's images are {width} x {height}")]
    UnevenImages {
        /// The image.
        number: u64,
        /// Its bytes.
        bytes: usize,
        /// Columns of the others.
        width: usize,
        /// Rows of the others.
        height: usize,
    },
    /// A header could not name its own payload.
    #[error(
        "{path}: a .mhd header names its payload in one word without blanks, % and backslashes: rename it, or write .mha",
        path = path.display()
    )]
    DataFileName {
        /// The payload's file.
        path: PathBuf,
    },
    /// A field of the whole file that would not be read back.
    #[error("the file's field {field:?} cannot be written: {why}")]
    UnwritableField {
        /// The field.
        field: String,
        /// What would not be understood.
        why: &'static str,
    },
    /// A file name without a known ending.
    #[error("{path}: the ending has to be .mha, .mhd or .nrrd", path = path.display())]
    UnknownEnding {
        /// The file.
        path: PathBuf,
    },
}
