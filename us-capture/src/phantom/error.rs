//! What can be wrong with a phantom.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

use crate::plus::PlusError;

/// A phantom that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BadPhantom {
    /// The disk refused, or the file is no text.
    #[error("cannot read phantom {path}", path = path.display())]
    Disk {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// No TOML, or not of a phantom.
    #[error("not a phantom: {why}")]
    Toml {
        /// What is wrong, with line and column.
        why: String,
    },
    /// A PLUS configuration that cannot be read, or holds no phantom.
    #[error(transparent)]
    Plus(#[from] Box<PlusError>),
    /// A part that no phantom can have.
    #[error("{place}{part}: {fault}", place = place(*line))]
    Part {
        /// Where it stands in the file, counted from one, when it came from one.
        line: Option<usize>,
        /// The part.
        part: Part,
        /// What is wrong with it.
        fault: Fault,
    },
}

/// A part of a phantom.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Phantom,
    /// The wire at this index.
    Wire(usize, String),
    /// The Z at this index.
    Z(usize),
    /// The landmark at this index.
    Landmark(usize, String),
}

/// What is wrong with a part of a phantom.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// Three dots fix a plane, fewer do not.
    #[error("it has {found} wires; a B-scan's plane is found from the dots of three or more")]
    TooFewWires {
        /// How many.
        found: usize,
    },
    /// More than any phantom has.
    #[error("it has {found} {what}, more than {most}")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        found: usize,
        /// How many are read.
        most: usize,
    },
    /// No name.
    #[error("its name is empty")]
    NoName,
    /// A name that stands for two.
    #[error("the one at number {other} has the same name; give each its own")]
    SameName {
        /// The other's number, from one.
        other: usize,
    },
    /// NaN or infinite.
    #[error("a coordinate is not finite")]
    NotFinite,
    /// A coordinate that looks like another unit.
    #[error("a coordinate is {found_mm} mm, beyond {most_mm} mm: are these millimetres?")]
    Far {
        /// The coordinate.
        found_mm: f64,
        /// The greatest that is taken for a phantom's.
        most_mm: f64,
    },
    /// A wire of no length.
    #[error(
        "it is {length_mm} mm long; a wire runs between two plates, at least {least_mm} mm: are these millimetres?"
    )]
    TooShort {
        /// Its length.
        length_mm: f64,
        /// The shortest that is taken for a wire.
        least_mm: f64,
    },
    /// Two wires in one.
    #[error("wire {other:?} is in the same place")]
    SamePlace {
        /// The other.
        other: String,
    },
    /// A name that is no wire's.
    #[error("there is no wire {name:?}")]
    NoSuchWire {
        /// The name.
        name: String,
    },
    /// An index that is no wire's.
    #[error("there is no wire of index {index}; there are {wires}")]
    NoSuchIndex {
        /// The index, from zero.
        index: usize,
        /// How many wires there are.
        wires: usize,
    },
    /// Not three wires.
    #[error("it names one wire twice; a Z is two sides and the wire that crosses between them")]
    SameWire,
    /// Sides that are not parallel: the ratio of [P1] eq. 2-4 would not hold.
    #[error("its sides are {angle_deg:.2} degrees from parallel; at most {most_deg} is taken for a Z's")]
    SidesNotParallel {
        /// The angle between them.
        angle_deg: f64,
        /// The greatest angle.
        most_deg: f64,
    },
    /// Sides that are one.
    #[error("its sides are {apart_mm:.2} mm apart, at least {least_mm} is needed")]
    SidesTogether {
        /// Their distance.
        apart_mm: f64,
        /// The least distance.
        least_mm: f64,
    },
    /// A wire out of the plane of the others.
    #[error("its wires are not in one plane: {off_mm:.2} mm off, at most {most_mm} is taken for a Z's")]
    NotInOnePlane {
        /// How far an end of the diagonal is from the plane of the sides.
        off_mm: f64,
        /// The greatest distance.
        most_mm: f64,
    },
    /// A diagonal that keeps its distance from both sides.
    #[error("its diagonal {name:?} crosses neither side: it is {angle_deg:.2} degrees from parallel to them")]
    CrossesNeither {
        /// The diagonal.
        name: String,
        /// Its angle to the sides.
        angle_deg: f64,
    },
    /// A diagonal outside of its sides; often the middle wire is not named second.
    #[error(
        "its diagonal {name:?} lies {out_mm:.2} mm outside of its sides; name the side, the diagonal, the side"
    )]
    NotBetween {
        /// The diagonal.
        name: String,
        /// How far an end lies outside.
        out_mm: f64,
    },
}

impl Fault {
    pub(super) fn of(self, part: Part) -> BadPhantom {
        BadPhantom::Part { line: None, part, fault: self }
    }
}

impl BadPhantom {
    /// The same, with the line at which the part stands.
    pub(crate) fn at(self, line_of: impl FnOnce(&Part) -> Option<usize>) -> Self {
        match self {
            Self::Part { line: None, part, fault } => Self::Part { line: line_of(&part), part, fault },
            other => other,
        }
    }
}

impl From<PlusError> for BadPhantom {
    /// A phantom's own fault is not wrapped twice.
    fn from(error: PlusError) -> Self {
        match error {
            PlusError::Phantom(bad) => *bad,
            other => Self::Plus(Box::new(other)),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Phantom => write!(f, "the phantom"),
            Self::Wire(index, name) => write!(f, "wire {} ({name:?})", index + 1),
            Self::Z(index) => write!(f, "Z {}", index + 1),
            Self::Landmark(index, name) => write!(f, "landmark {} ({name:?})", index + 1),
        }
    }
}

fn place(line: Option<usize>) -> String {
    line.map(|line| format!("line {line}: ")).unwrap_or_default()
}
