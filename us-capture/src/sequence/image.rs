//! One image of a sequence, and what was tracked with it.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nalgebra::Matrix4;
use probepath_frames::Stamp;

/// What the recorder thought of an image or a pose.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Status {
    /// Good.
    Ok,
    /// Not to be used, however good it looks.
    Invalid,
    /// Another word, as it stood (`MISSING`, `OUT_OF_VIEW`, …): not to be used either.
    Other(String),
    /// The file does not say (old recorders): used, and counted in a [`Note`](super::Note).
    #[default]
    Unsaid,
}

impl Status {
    pub(super) fn parse(text: &str) -> Self {
        match text.trim() {
            "OK" => Self::Ok,
            "INVALID" => Self::Invalid,
            "" => Self::Unsaid,
            other => Self::Other(other.into()),
        }
    }

    /// The word in a file, if there is any.
    pub fn word(&self) -> Option<&str> {
        match self {
            Self::Ok => Some("OK"),
            Self::Invalid => Some("INVALID"),
            Self::Other(word) => Some(word),
            Self::Unsaid => None,
        }
    }

    /// Whether what it belongs to may be used.
    pub const fn is_usable(&self) -> bool {
        matches!(self, Self::Ok | Self::Unsaid)
    }
}

/// The two systems of a tracked transform: its matrix takes column vectors from `from` to `to` (PLUS writes
/// `ProbeToTracker`; for us that is `tracker_from_probe`, the pose of `from` in `to`).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TransformName {
    /// Where vectors come from.
    pub from: String,
    /// Where they go.
    pub to: String,
}

impl TransformName {
    /// The name of a transform between two systems.
    pub fn new(from: impl Into<String>, to: impl Into<String>) -> Self {
        Self { from: from.into(), to: to.into() }
    }

    /// Splits `ProbeToTracker`. `None` when there is no, or more than one, `To` between two names: a name that itself
    /// holds "To" before a capital cannot be told apart.
    pub fn parse(text: &str) -> Option<Self> {
        let capital = |at: usize| text[at + 2..].starts_with(|c: char| c.is_uppercase());
        let mut splits = text.match_indices("To").map(|(at, _)| at).filter(|at| *at > 0 && capital(*at));
        let at = splits.next()?;
        if splits.next().is_some() {
            return None;
        }
        Some(Self::new(&text[..at], &text[at + 2..]))
    }
}

impl fmt::Display for TransformName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}To{}", self.from, self.to)
    }
}

/// A tracked matrix as the file has it (mm), with its status.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// Takes column vectors of the first system to the second; millimetres.
    pub matrix_mm: Matrix4<f64>,
    /// Whether to believe it.
    pub status: Status,
}

/// One image (or the poses of one instant, when there is no picture).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SequenceImage {
    /// Its index in the file.
    pub number: u64,
    /// 8-bit grey, MF, row after row. There also for an image marked invalid: its block is in the file.
    pub pixels: Option<Arc<[u8]>>,
    /// What the recorder thought of the picture.
    pub status: Status,
    /// The recorder's stamp, on the file's own clock.
    pub stamp: Option<Stamp>,
    /// What was tracked.
    pub transforms: BTreeMap<TransformName, Tracked>,
    /// The other fields, as they stood.
    pub fields: BTreeMap<String, String>,
}

impl SequenceImage {
    /// The picture, when there is one that may be used.
    pub fn picture(&self) -> Option<&Arc<[u8]>> {
        self.pixels.as_ref().filter(|_| self.status.is_usable())
    }
}
