//! Real-Time Data Exchange, protocol versions 1 and 2, both ends of it, without a socket.
//!
//! ```
//! use probepath_robot::drivers::ur::rtde::{Decoder, Reply, Request, Version};
//!
//! let mut bytes = Vec::new();
//! Request::ProtocolVersion(2).write(Version::V1, &mut bytes)?;
//! assert_eq!(bytes, [0, 5, b'V', 0, 2]);
//!
//! let mut decoder = Decoder::new();
//! // In whatever pieces the network gives them.
//! for byte in [0, 4, b'V', 1] {
//!     decoder.feed(&[byte]);
//! }
//! let frame = decoder.next()?.expect("a whole packet");
//! assert_eq!(Reply::read(frame, Version::V2)?, Reply::ProtocolVersion { accepted: true });
//! # Ok::<(), probepath_robot::drivers::ur::rtde::RtdeError>(())
//! ```
//!
//! A [`Decoder`] cuts a stream of bytes into [`Frame`]s; a [`Request`] is what a client says and a [`Reply`] what the
//! controller says; a [`Recipe`] is the agreement about what a data package holds.
//!
//! All numbers are big-endian. A frame is its own length as u16 (these three bytes included), its kind as u8, and its
//! payload. Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide"; the tables of `UR_WIRE.md`.

mod decoder;
mod error;
mod field;
mod fields;
mod packet;
mod recipe;
mod text;

pub use decoder::{Decoder, Frame};
pub use error::RtdeError;
pub use field::{Type, Value};
pub use fields::{input_type, names, output_type};
pub use packet::{ControllerVersion, Reply, Request, Version};
pub use recipe::{Recipe, Refused};
pub use text::{Level, Text};

/// The port.
pub const PORT: u16 = 30004;

/// The longest frame there can be: its length is 16 bits.
pub const LONGEST: usize = u16::MAX as usize;

/// The kinds of frames.
pub mod kind {
    /// The client asks for a version of the protocol.
    pub const PROTOCOL_VERSION: u8 = b'V';
    /// The client asks for the controller's version.
    pub const CONTROLLER_VERSION: u8 = b'v';
    /// Words, either way, at any time.
    pub const TEXT: u8 = b'M';
    /// A data package, either way.
    pub const DATA: u8 = b'U';
    /// The client says what it wants to be told.
    pub const OUTPUTS: u8 = b'O';
    /// The client says what it wants to tell.
    pub const INPUTS: u8 = b'I';
    /// The client wants data packages.
    pub const START: u8 = b'S';
    /// The client wants no data packages for now.
    pub const PAUSE: u8 = b'P';

    /// All of them.
    pub const ALL: [u8; 8] =
        [PROTOCOL_VERSION, CONTROLLER_VERSION, TEXT, DATA, OUTPUTS, INPUTS, START, PAUSE];
}

#[cfg(test)]
mod tests;
