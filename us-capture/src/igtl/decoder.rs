//! [`Decoder`]: bytes in, messages out, no socket.

use super::crc::crc64;
use super::error::IgtlError;
use super::header::{HEADER_BYTES, Header};
use super::image::Image;

/// The longest message that is taken: a 4096 x 4096 picture.
pub const MOST_BYTES: u64 = 1 << 24;

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// A picture.
    Image(Header, Image),
    /// Anything else: its body was checked and let go of.
    Other(Header),
}

impl Message {
    /// What stands before it.
    pub const fn header(&self) -> &Header {
        match self {
            Self::Image(header, _) | Self::Other(header) => header,
        }
    }
}

/// Turns any split of the bytes into messages. It holds one message at most, and of that only what has come; bodies
/// that nobody wants are checked and not held.
///
/// After an error the bytes have lost their beat: connect again, with a new decoder.
#[derive(Debug)]
pub struct Decoder {
    most: u64,
    head: Vec<u8>,
    /// The message whose body is coming.
    under_way: Option<UnderWay>,
}

#[derive(Debug)]
struct UnderWay {
    header: Header,
    missing: u64,
    crc: u64,
    /// Kept only of an image.
    body: Vec<u8>,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new(MOST_BYTES)
    }
}

impl Decoder {
    /// Takes messages of at most so many bytes.
    pub fn new(most: u64) -> Self {
        Self { most, head: Vec::with_capacity(HEADER_BYTES), under_way: None }
    }

    /// Takes bytes from the front of `bytes` until a message is whole, or none are left.
    ///
    /// # Errors
    /// When they are no OpenIGTLink, a message is too long or damaged, or an image is no B-scan.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Result<Option<Message>, IgtlError> {
        if self.under_way.is_none() {
            self.begin(bytes)?;
        }
        let Some(message) = &mut self.under_way else { return Ok(None) };
        message.take(bytes);
        if message.missing > 0 {
            return Ok(None);
        }
        self.under_way.take().map(UnderWay::end).transpose()
    }

    /// Takes bytes into the header, and opens it once it is whole.
    fn begin(&mut self, bytes: &mut &[u8]) -> Result<(), IgtlError> {
        let (mine, rest) = bytes.split_at(bytes.len().min(HEADER_BYTES - self.head.len()));
        self.head.extend_from_slice(mine);
        *bytes = rest;
        let Some(head) = self.head.first_chunk() else { return Ok(()) };
        let header = Header::read(head)?;
        self.head.clear();
        if header.body > self.most {
            let Header { kind, device, body: bytes, .. } = header;
            return Err(IgtlError::TooLong { kind, device, bytes, most: self.most });
        }
        self.under_way = Some(UnderWay { missing: header.body, header, crc: 0, body: Vec::new() });
        Ok(())
    }
}

impl UnderWay {
    fn take(&mut self, bytes: &mut &[u8]) {
        let wanted = usize::try_from(self.missing).unwrap_or(usize::MAX);
        let (mine, rest) = bytes.split_at(bytes.len().min(wanted));
        self.crc = crc64(self.crc, mine);
        if self.header.kind == "IMAGE" {
            self.body.extend_from_slice(mine);
        }
        self.missing -= mine.len() as u64;
        *bytes = rest;
    }

    fn end(self) -> Result<Message, IgtlError> {
        let Self { mut header, crc, body, .. } = self;
        if crc != header.crc {
            let Header { kind, device, crc: said, .. } = header;
            return Err(IgtlError::Checksum { kind, device, said, found: crc });
        }
        if header.kind != "IMAGE" {
            return Ok(Message::Other(header));
        }
        let (id, image) = Image::read(&header, body)?;
        header.id = id;
        Ok(Message::Image(header, image))
    }
}
