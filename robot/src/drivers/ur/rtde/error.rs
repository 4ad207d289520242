//! [`RtdeError`].

use thiserror::Error;

use super::Type;

/// Bytes that are no RTDE, or not what was agreed.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum RtdeError {
    /// A frame says that it is shorter than its own header.
    #[error("a frame says it is {length} bytes long, and its header alone has 3")]
    TooShort {
        /// What it says.
        length: usize,
    },
    /// A frame says that it is longer than any that can come here.
    #[error("a frame of kind {kind:?} says it is {length} bytes long, the longest that can come has {limit}")]
    TooLong {
        /// Its kind, as a letter.
        kind: char,
        /// What it says.
        length: usize,
        /// What is taken.
        limit: usize,
    },
    /// A frame of a kind that RTDE does not have.
    #[error("a frame of kind {kind} ({shown:?}), which RTDE does not have{}", if *http { ": a web server answers here" } else { "; is this port 30004 of a UR controller?" })]
    UnknownKind {
        /// The kind.
        kind: u8,
        /// As a letter.
        shown: char,
        /// Whether the stream begins as a web server's answer does.
        http: bool,
    },
    /// A payload that ends too early or goes on too long.
    #[error("the payload of {what} has {found} bytes, {expected}")]
    Payload {
        /// Of what.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// What would have fitted, in words.
        expected: &'static str,
    },
    /// A data package whose length is not its recipe's.
    #[error("a data package of recipe {recipe} has {found} bytes of fields, its types have {expected}")]
    Package {
        /// The recipe.
        recipe: u8,
        /// How many bytes there are.
        found: usize,
        /// How many its types need.
        expected: usize,
    },
    /// A data package of a recipe that was not agreed.
    #[error("a data package of recipe {found}, agreed was recipe {expected}")]
    Recipe {
        /// Whose it is.
        found: u8,
        /// Whose it should be.
        expected: u8,
    },
    /// The names or types of a recipe are no text.
    #[error("the {what} of a recipe are no text: byte {byte:#04x} at {at}")]
    NoText {
        /// Names or types.
        what: &'static str,
        /// The first byte that is none.
        byte: u8,
        /// Where it is.
        at: usize,
    },
    /// A type that RTDE does not have.
    #[error("{name:?} is said to be of type {found:?}, which RTDE does not have")]
    UnknownType {
        /// The field.
        name: String,
        /// What its type is said to be.
        found: String,
    },
    /// A field of another type than it has had since the protocol exists.
    #[error("{name:?} is said to be {found}, it is {expected}")]
    WrongType {
        /// The field.
        name: String,
        /// What its type is said to be.
        found: Type,
        /// What it is.
        expected: Type,
    },
    /// Another number of types than of names.
    #[error("{types} types came for {names} names")]
    WrongCount {
        /// How many types.
        types: usize,
        /// How many names.
        names: usize,
    },
    /// Fields that the controller does not give.
    #[error("{0}")]
    Refused(super::Refused),
    /// Too much for one frame.
    #[error("{what} of {length} bytes do not fit into one frame")]
    DoesNotFit {
        /// What.
        what: &'static str,
        /// How long it is.
        length: usize,
    },
    /// A boolean that is neither.
    #[error("{what} is {found}, and is 0 or 1")]
    NoBool {
        /// What.
        what: &'static str,
        /// What came.
        found: u8,
    },
}
