//! B-scans over the network: OpenIGTLink, as PLUS servers, 3D Slicer and several machines speak it.
//!
//! ```
//! use probepath_us_capture::igtl::{Decoder, Image, Message, encode_image};
//!
//! let image = Image { columns: 2, rows: 3, spacing_mm: [0.125, 0.25], pixels: vec![1, 2, 3, 4, 5, 6] };
//! let bytes = encode_image("Probe", 7, 1_500_000_000, &image)?;
//! let mut decoder = Decoder::default();
//! let mut unread = &bytes[..];
//! let Some(Message::Image(header, read)) = decoder.feed(&mut unread)? else { panic!("the whole message was there") };
//! assert_eq!((read, header.device.as_str(), header.id), (image, "Probe", 7));
//! # Ok::<(), probepath_us_capture::igtl::IgtlError>(())
//! ```
//!
//! The nouns: a [`Decoder`] turns any split of the bytes into [`Message`]s, without a socket; an [`IgtlSource`] is a
//! [`BScanSource`](crate::BScanSource) with a socket, as its [`IgtlSettings`] say; a [`MachineClock`] brings the
//! headers' stamps to the exam's clock.
//!
//! Read are IMAGE messages of headers 1 and 2 (protocols 1 to 3): one slice, one component, 8-bit grey. What an image
//! does not say (depth, focus, where the window begins) the settings say; where the image lies in space is the arm's to
//! say, so its matrix gives only the spacing. Pictures have to come oriented MF, columns toward the unmarked side and
//! rows away from the probe, as PLUS sends them when it is configured so. TRANSFORM, STATUS and all others are skipped.
//!
//! Sources: openigtlink.org, protocol version 3 (header, extended header, IMAGE), checked against PyPI `pyigtl`. The
//! crate `openigtlink-rust` 0.4.1 reads and writes an IMAGE header of 60 bytes instead of 72 (no subvolume), so it
//! refuses every image that others send; it also allocates whatever a header claims.

mod clock;
mod crc;
mod decoder;
mod encode;
mod error;
mod header;
mod image;
mod queue;
mod reader;
mod source;
#[cfg(test)]
mod tests;

pub use clock::MachineClock;
pub use decoder::{Decoder, MOST_BYTES, Message};
pub use encode::{encode_image, encode_status};
pub use error::IgtlError;
pub use header::{HEADER_BYTES, Header};
pub use image::Image;
pub use source::{IgtlCounts, IgtlSettings, IgtlSource, PORT, Wait};
