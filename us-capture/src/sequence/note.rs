//! What was assumed, changed or missing when a sequence was read: said, never silent.

use std::fmt;

use super::Orientation;

/// Something a user should know about a sequence that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Note {
    /// The file does not say its orientation; the caller did.
    OrientationAssumed(Orientation),
    /// The images were turned to MF.
    Turned {
        /// The orientation they were stored in.
        from: Orientation,
    },
    /// Colour was made grey (ITU-R BT.601 luma).
    ColourToGrey {
        /// Channels stored.
        channels: usize,
    },
    /// Poses only: the file has no pictures.
    NoPictures,
    /// Images whose status the file does not say; they are used.
    ImageStatusUnsaid {
        /// How many.
        images: u64,
    },
    /// Poses whose status the file does not say; they are used.
    PoseStatusUnsaid {
        /// Which transform.
        name: String,
        /// How many.
        images: u64,
    },
    /// Images about which the header says nothing.
    NothingSaid {
        /// How many.
        images: u64,
        /// The first of them.
        first: u64,
    },
    /// The recorder's `FrameNumber` jumps: the recorder had more than the file holds.
    FrameNumberJumps {
        /// Numbers that are missing.
        missing: u64,
        /// The image after the first jump.
        first: u64,
    },
    /// Fields that look like a transform, but whose two names cannot be told apart; kept as they stood.
    AmbiguousName {
        /// The field.
        field: String,
    },
    /// The header does not name its axes; that it has fields of images made it a sequence.
    KindsUnsaid,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OrientationAssumed(o) => write!(f, "no orientation in the file, {o} assumed as asked"),
            Self::Turned { from } => write!(f, "images turned from {from} to MF"),
            Self::ColourToGrey { channels } => write!(f, "{channels} colour channels converted to grey"),
            Self::NoPictures => write!(f, "poses without images"),
            Self::ImageStatusUnsaid { images } => write!(f, "{images} images without a status, used"),
            Self::PoseStatusUnsaid { name, images } => {
                write!(f, "{images} {name} poses without a status, used")
            }
            Self::NothingSaid { images, first } => {
                write!(f, "{images} images without any field, the first is {first}")
            }
            Self::FrameNumberJumps { missing, first } => {
                write!(f, "FrameNumber skips {missing}, first before image {first}")
            }
            Self::AmbiguousName { field } => {
                write!(f, "{field}: no single \"To\" between two names, kept as text")
            }
            Self::KindsUnsaid => write!(f, "the axes are not named; taken as a sequence for its fields"),
        }
    }
}
