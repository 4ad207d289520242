//! [`Decoder`]: from a stream of bytes, in whatever pieces, to frames.

use super::{LONGEST, RtdeError, kind};

/// One frame: its kind (one of [`kind::ALL`]) and what it carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What it is.
    pub kind: u8,
    /// What it carries, without the header.
    pub payload: &'a [u8],
}

/// Length and kind.
const HEADER: usize = 3;

/// Cuts a stream of bytes into frames. Its memory is taken once, when it is made, and never grows: it is as large as
/// the longest frame that it takes and what may have come with it.
///
/// What is wrong is said as soon as a frame's header is there, not when the bytes that it promises have come: a web
/// server's answer would promise 18,516. After an error the place of the next frame is unknown, so the error stays.
#[derive(Clone, Debug)]
pub struct Decoder {
    buffer: Box<[u8]>,
    /// What is not yet read is `buffer[start..end]`.
    start: usize,
    end: usize,
    limit: usize,
    broken: Option<RtdeError>,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// One that takes frames of any length.
    pub fn new() -> Self {
        Self::with_limit(LONGEST)
    }

    /// One that takes frames of up to `limit` bytes.
    pub fn with_limit(limit: usize) -> Self {
        let limit = limit.clamp(HEADER, LONGEST);
        Self { buffer: vec![0; LONGEST + 1].into_boxed_slice(), start: 0, end: 0, limit, broken: None }
    }

    /// Takes bytes, and says how many: all, unless frames are waiting to be read by [`next`](Self::next).
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        let room = self.room();
        let taken = bytes.len().min(room.len());
        for (to, from) in room.iter_mut().zip(bytes) {
            *to = *from;
        }
        self.filled(taken);
        taken
    }

    /// Room for bytes that come, to be read into; say how many came with [`filled`](Self::filled). Never empty when
    /// all frames were read.
    pub fn room(&mut self) -> &mut [u8] {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        self.buffer.get_mut(self.end..).unwrap_or_default()
    }

    /// That `count` bytes were put into [`room`](Self::room).
    pub fn filled(&mut self, count: usize) {
        self.end = self.end.saturating_add(count).min(self.buffer.len());
    }

    /// How many bytes wait for the rest of their frame, or to be read.
    pub const fn waiting(&self) -> usize {
        self.end - self.start
    }

    /// The next whole frame; `None` until more bytes come.
    ///
    /// # Errors
    /// When the bytes are no RTDE; from then on always.
    #[allow(
        clippy::should_implement_trait,
        reason = "a frame borrows from the decoder, as no iterator's item may"
    )]
    pub fn next(&mut self) -> Result<Option<Frame<'_>>, RtdeError> {
        let Some((length, kind)) = self.header()? else { return Ok(None) };
        let (from, to) = (self.start + HEADER, self.start + length);
        if to > self.end {
            return Ok(None);
        }
        self.start = to;
        Ok(self.buffer.get(from..to).map(|payload| Frame { kind, payload }))
    }

    /// Length and kind of the frame that begins here, when they are there and can be.
    fn header(&mut self) -> Result<Option<(usize, u8)>, RtdeError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        let waiting = self.buffer.get(self.start..self.end).unwrap_or_default();
        let Some(&[high, low, kind]) = waiting.first_chunk::<HEADER>() else { return Ok(None) };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let error = if !kind::ALL.contains(&kind) {
            RtdeError::UnknownKind { kind, shown: char::from(kind), http: waiting.starts_with(b"HTT") }
        } else if length < HEADER {
            RtdeError::TooShort { length }
        } else if length > self.limit {
            RtdeError::TooLong { kind: char::from(kind), length, limit: self.limit }
        } else {
            return Ok(Some((length, kind)));
        };
        self.broken = Some(error.clone());
        Err(error)
    }
}
