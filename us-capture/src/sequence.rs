//! Tracked sequences: images with poses, stamps and fields, as PLUS and 3D Slicer keep them (`.igs.mha`, `.igs.mhd`,
//! `.igs.nrrd`).
//!
//! ```no_run
//! use probepath_us_capture::sequence::{ReadOptions, Sequence};
//! # fn main() -> Result<(), probepath_us_capture::sequence::SequenceError> {
//! let sequence = Sequence::read("sweep.igs.mha".as_ref(), &ReadOptions::default())?;
//! println!("{} images of {} x {}", sequence.images().len(), sequence.width(), sequence.height());
//! sequence.write("sweep.igs.nrrd".as_ref())?;
//! # Ok(()) }
//! ```
//!
//! The nouns: a [`Sequence`] holds [`SequenceImage`]s, each with its pixels (8-bit grey, brought to MF), the
//! [`Tracked`] matrices of its [`TransformName`]s, its stamp and its other fields as they stood; [`Note`]s say what
//! was assumed or changed on the way in. [`Placing`] makes placed B-scans of it, [`SequenceSource`] replays it.
//!
//! What it does not do: guess. What a file does not say is an error or a note.

mod assemble;
mod error;
mod files;
mod header;
mod image;
mod metaimage;
mod note;
mod nrrd;
mod orientation;
mod payload;
mod place;
mod source;
mod stamps;
mod write;

pub use error::SequenceError;
pub use files::read_parts;
pub use header::{Entry, Format, Header};
pub use image::{SequenceImage, Status, Tracked, TransformName};
pub use note::Note;
pub use orientation::Orientation;
pub use payload::{Claim, Packing, unpack};
pub use place::{ChainNames, MaybePose, NoChain, Placed, PlacedSequence, Placing, SkipReason, Skipped};
pub use source::SequenceSource;
pub use write::save;

/// How a file is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Used for files that do not say their orientation. Without it such a file is refused.
    pub assume_orientation: Option<Orientation>,
    /// More unpacked bytes than this are refused before anything is allocated.
    pub most_bytes: u64,
}

impl Default for ReadOptions {
    /// Nothing assumed, at most 4 GiB.
    fn default() -> Self {
        Self { assume_orientation: None, most_bytes: 4 << 30 }
    }
}

/// Images in the file's order, all of one size, with what was tracked and said about each.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequence {
    width: usize,
    height: usize,
    images: Vec<SequenceImage>,
    fields: Vec<(String, String)>,
    notes: Vec<Note>,
}

impl Sequence {
    /// A sequence of images of one size (0 x 0 for poses without images), to be filled with [`push`](Self::push).
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height, images: Vec::new(), fields: Vec::new(), notes: Vec::new() }
    }

    /// Adds an image.
    ///
    /// # Errors
    /// When its pixels are not `width * height`.
    pub fn push(&mut self, image: SequenceImage) -> Result<(), SequenceError> {
        if let Some(pixels) = &image.pixels
            && self.width.checked_mul(self.height) != Some(pixels.len())
        {
            let (width, height) = (self.width, self.height);
            return Err(SequenceError::UnevenImages {
                number: image.number,
                bytes: pixels.len(),
                width,
                height,
            });
        }
        self.images.push(image);
        Ok(())
    }

    /// Columns of every image; zero for poses without images.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows of every image; zero for poses without images.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// The images in the file's order, the invalid ones too.
    pub fn images(&self) -> &[SequenceImage] {
        &self.images
    }

    /// Fields of the whole file that are not part of the format.
    pub fn fields(&self) -> &[(String, String)] {
        &self.fields
    }

    /// Adds a field of the whole file, which is written too.
    pub fn set_field(&mut self, key: impl Into<String>, value: impl Into<String>) {
        self.fields.push((key.into(), value.into()));
    }

    /// What was assumed, changed or missing when it was read.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }
}
