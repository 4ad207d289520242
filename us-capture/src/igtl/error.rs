//! What is wrong with bytes that should be OpenIGTLink.

use thiserror::Error;

/// Bytes that are no OpenIGTLink, or an image that is no B-scan.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum IgtlError {
    /// The header's version is none.
    #[error(
        "the message's header has version {found} instead of 1 or 2 (it begins with {begins:?}): is this an \
         OpenIGTLink server?"
    )]
    Version {
        /// What stands there.
        found: u16,
        /// Its first bytes, as text.
        begins: String,
    },
    /// Longer than anything that is wanted.
    #[error("a {kind} message of \"{device}\" claims {bytes} bytes, more than the {most} that are taken")]
    TooLong {
        /// The message's type.
        kind: String,
        /// Who sent it.
        device: String,
        /// What it claims.
        bytes: u64,
        /// What is taken.
        most: u64,
    },
    /// The body is not what was sent.
    #[error(
        "a {kind} message of \"{device}\" is damaged: its checksum is {found:016x} instead of {said:016x}"
    )]
    Checksum {
        /// The message's type.
        kind: String,
        /// Who sent it.
        device: String,
        /// What the header says.
        said: u64,
        /// What the body has.
        found: u64,
    },
    /// The extended header and the metadata need more bytes than there are.
    #[error(
        "an IMAGE message of \"{device}\" has {bytes} bytes, and its extended header and metadata alone claim {claimed}"
    )]
    ExtendedHeader {
        /// Who sent it.
        device: String,
        /// What there is.
        bytes: usize,
        /// What is claimed.
        claimed: u64,
    },
    /// Something else than an 8-bit grey picture.
    #[error("an image of \"{device}\" is no B-scan: {why}")]
    NoBScan {
        /// Who sent it.
        device: String,
        /// Why, and what it has to be.
        why: String,
    },
    /// A name, a size or a stamp that no message can carry.
    #[error("cannot write an OpenIGTLink message: {why}")]
    Unwritable {
        /// Why.
        why: String,
    },
}
