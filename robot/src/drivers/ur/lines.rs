//! [`Lines`]: the dashboard's lines out of a stream of bytes, without a socket.

use thiserror::Error;

/// The longest line that is taken; the dashboard's are below 200.
pub const LONGEST: usize = 1024;

/// Bytes that are no lines of a dashboard.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum LineError {
    /// No end of line came.
    #[error("{LONGEST} bytes came without an end of line")]
    TooLong,
    /// A byte that no text has.
    #[error("byte {byte:#04x} came, which no line of text has")]
    NoText {
        /// The byte.
        byte: u8,
    },
}

/// Cuts a stream of bytes into lines. Its memory is one line, taken once. After an error the error stays.
#[derive(Clone, Debug)]
pub struct Lines {
    buffer: Box<[u8]>,
    /// What is not yet read is `buffer[start..end]`.
    start: usize,
    end: usize,
    broken: Option<LineError>,
}

impl Default for Lines {
    fn default() -> Self {
        Self::new()
    }
}

impl Lines {
    /// Nothing came yet.
    pub fn new() -> Self {
        Self { buffer: vec![0; 2 * LONGEST].into_boxed_slice(), start: 0, end: 0, broken: None }
    }

    /// Takes bytes, and says how many: all, unless lines are waiting to be read by [`next`](Self::next).
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        let room = self.buffer.get_mut(self.end..).unwrap_or_default();
        let taken = bytes.len().min(room.len());
        for (to, from) in room.iter_mut().zip(bytes) {
            *to = *from;
        }
        self.end += taken;
        taken
    }

    /// The next whole line without its end (`\n`, or `\r\n`); `None` until more bytes come.
    ///
    /// # Errors
    /// When what comes is no text, or does not end; from then on always.
    #[allow(clippy::should_implement_trait, reason = "a line borrows from here, as no iterator's item may")]
    pub fn next(&mut self) -> Result<Option<&str>, LineError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        let waiting = self.buffer.get(self.start..self.end).unwrap_or_default();
        let Some(length) = waiting.iter().position(|byte| *byte == b'\n') else {
            return if waiting.len() > LONGEST { Err(self.breaks(LineError::TooLong)) } else { Ok(None) };
        };
        let from = self.start;
        self.start += length + 1;
        if length > LONGEST {
            return Err(self.breaks(LineError::TooLong));
        }
        self.text(from, length).map(Some)
    }

    fn text(&mut self, from: usize, length: usize) -> Result<&str, LineError> {
        let line = self.buffer.get(from..from + length).unwrap_or_default();
        let wrong = line.iter().copied().find(|byte| !matches!(byte, b'\t' | b'\r' | 0x20..=0x7e | 0x80..));
        if let Some(byte) = wrong {
            return Err(self.breaks(LineError::NoText { byte }));
        }
        match str::from_utf8(line) {
            Ok(_) => {}
            Err(error) => {
                let byte = line.get(error.valid_up_to()).copied().unwrap_or_default();
                return Err(self.breaks(LineError::NoText { byte }));
            }
        }
        let line = self.buffer.get(from..from + length).unwrap_or_default();
        Ok(str::from_utf8(line).unwrap_or_default().trim_end_matches('\r'))
    }

    fn breaks(&mut self, error: LineError) -> LineError {
        self.broken = Some(error.clone());
        error
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn read(stream: &[u8], mut piece: impl FnMut() -> usize) -> Result<Vec<String>, LineError> {
        let (mut lines, mut all, mut rest) = (Lines::new(), Vec::new(), stream);
        while !rest.is_empty() {
            let taken = lines.feed(&rest[..piece().clamp(1, rest.len())]);
            rest = &rest[taken..];
            while let Some(line) = lines.next()? {
                all.push(line.to_owned());
            }
        }
        Ok(all)
    }

    #[test]
    fn lines_are_the_same_however_the_stream_is_cut() {
        let stream = "Connected: Universal Robots Dashboard Server\n\nRobotmode: RUNNING\r\nå\n".as_bytes();
        let whole = ["Connected: Universal Robots Dashboard Server", "", "Robotmode: RUNNING", "å"];
        assert_eq!(read(stream, || usize::MAX).unwrap(), whole);
        assert_eq!(read(stream, || 1).unwrap(), whole);
        for at in 1..stream.len() {
            let mut first = true;
            let piece = || if std::mem::take(&mut first) { at } else { usize::MAX };
            assert_eq!(read(stream, piece).unwrap(), whole, "cut at {at}");
        }
    }

    #[test]
    fn what_is_no_text_or_does_not_end_is_refused_for_good() {
        assert_eq!(read(b"ab\0c\n", || 2), Err(LineError::NoText { byte: 0 }));
        assert_eq!(read(b"\xff\xfe\n", || 2), Err(LineError::NoText { byte: 0xff }));
        assert_eq!(read(&[b'a'; 5000], || 100), Err(LineError::TooLong));
        let mut line = vec![b'a'; LONGEST];
        line.push(b'\n');
        assert_eq!(read(&line, || 300).unwrap()[0].len(), LONGEST, "the longest is taken");
        let mut lines = Lines::new();
        lines.feed(b"\x01\n");
        assert!(lines.next().is_err());
        lines.feed(b"well\n");
        assert!(lines.next().is_err(), "the error stays");
    }

    #[test]
    fn ten_thousand_streams_of_noise_never_panic() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..10_000 {
            let length = rng.random_range(0..3000);
            let noise: Vec<u8> = (0..length)
                .map(|_| if rng.random_range(0..30) == 0 { b'\n' } else { rng.random::<u8>() | 0x20 })
                .collect();
            let mut dice = ChaCha8Rng::seed_from_u64(rng.random());
            let cut = read(&noise, || dice.random_range(1..400));
            assert_eq!(cut.is_ok(), read(&noise, || usize::MAX).is_ok());
        }
    }
}
