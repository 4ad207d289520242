//! The primary interface's messages, sans-IO: why a controller stopped, and which error its program met.
//!
//! A packet is a length (i32, itself included) and a kind (u8); kind 20 carries a time (u64), a source, a message's kind
//! and its fields, big-endian. Everything else, the arm's state ten times a second, is skipped as it comes: what is kept
//! is bounded. Source: the official client library's parser (`src/primary/robot_message/`) and its test's bytes.

use std::fmt;

use thiserror::Error;

/// Its port.
pub const PORT: u16 = 30001;

/// The kind of packet that carries a message.
const ROBOT_MESSAGE: u8 = 20;
/// Length and kind.
const HEADER: usize = 5;
/// Time, source and the message's kind.
const PREFIX: usize = 10;
/// No packet is longer: the arm's state has about 1,400 bytes.
const LONGEST: usize = 1 << 16;
/// What is kept of a message; its words may be cut.
const KEPT: usize = 512;

/// Bytes that are no primary interface's.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("a packet says it is {length} bytes long; it has to be between {HEADER} and {LONGEST}")]
pub struct NoPacket {
    /// What it says.
    pub length: i32,
}

/// Something that a controller says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Said {
    /// An error by its number, as the pendant and the manual have it: `C153A1`.
    Error {
        /// Its number.
        code: i32,
        /// Its second number.
        argument: i32,
        /// 0 debug, 1 information, 2 a warning, 3 a violation, 4 a fault.
        level: i32,
        /// In words; may be empty.
        text: String,
    },
    /// An error of the program that runs.
    Exception {
        /// Its line.
        line: i32,
        /// Its column.
        column: i32,
        /// What is wrong.
        text: String,
    },
    /// Something with a title: a program began or ended, a popup.
    Titled {
        /// Its title.
        title: String,
        /// Its words.
        text: String,
    },
    /// Anything else.
    Other {
        /// The message's kind.
        kind: u8,
    },
}

impl Said {
    /// Whether it may say why an arm stopped.
    pub const fn explains(&self) -> bool {
        match self {
            Self::Error { level, .. } => *level >= 2,
            Self::Exception { .. } => true,
            Self::Titled { .. } | Self::Other { .. } => false,
        }
    }

    /// What follows kind, time, source and the message's own kind.
    fn read(kind: u8, fields: &[u8]) -> Option<Self> {
        let number = |at: usize| Some(i32::from_be_bytes(*fields.get(at..)?.first_chunk()?));
        let text = |from: usize| fields.get(from..).map(words);
        Some(match kind {
            // Two words of data come before the text.
            6 => Self::Error { code: number(0)?, argument: number(4)?, level: number(8)?, text: text(20)? },
            7 => {
                let end = 9 + usize::from(*fields.get(8)?);
                Self::Titled { title: words(fields.get(9..end)?), text: text(end)? }
            }
            10 => Self::Exception { line: number(0)?, column: number(4)?, text: text(8)? },
            kind => Self::Other { kind },
        })
    }
}

/// Text without what does not print.
fn words(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let printed: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    printed.trim().to_owned()
}

impl fmt::Display for Said {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error { code, argument, text, .. } if text.is_empty() => write!(f, "C{code}A{argument}"),
            Self::Error { code, argument, text, .. } => write!(f, "C{code}A{argument}: {text}"),
            Self::Exception { line, column, text } => write!(f, "line {line}, column {column}: {text}"),
            Self::Titled { title, text } => write!(f, "{title}: {text}"),
            Self::Other { kind } => write!(f, "a message of kind {kind}"),
        }
    }
}

/// Cuts a stream of bytes, in whatever pieces, into what is said. Its memory is taken once.
#[derive(Clone, Debug)]
pub struct PrimaryReader {
    header: [u8; HEADER],
    /// How many bytes of the header there are.
    begun: usize,
    /// How many bytes of the packet are still to come.
    left: usize,
    kept: Vec<u8>,
}

impl Default for PrimaryReader {
    fn default() -> Self {
        Self { header: [0; HEADER], begun: 0, left: 0, kept: Vec::with_capacity(KEPT) }
    }
}

impl PrimaryReader {
    /// Takes bytes, and hands over every message that ends in them.
    ///
    /// # Errors
    /// When a packet has a length that none has; what comes after it cannot be read.
    pub fn feed(&mut self, mut bytes: &[u8], mut hear: impl FnMut(Said)) -> Result<(), NoPacket> {
        while !bytes.is_empty() {
            if self.begun < HEADER {
                bytes = self.begin(bytes)?;
            }
            let (now, rest) = bytes.split_at(self.left.min(bytes.len()));
            if self.header[4] == ROBOT_MESSAGE {
                let room = KEPT - self.kept.len();
                self.kept.extend(now.iter().take(room));
            }
            (self.left, bytes) = (self.left - now.len(), rest);
            if self.begun == HEADER && self.left == 0 {
                self.end().into_iter().for_each(&mut hear);
            }
        }
        Ok(())
    }

    /// Takes bytes of the header; what is left of them.
    fn begin<'a>(&mut self, bytes: &'a [u8]) -> Result<&'a [u8], NoPacket> {
        let (now, rest) = bytes.split_at((HEADER - self.begun).min(bytes.len()));
        for (to, from) in self.header.iter_mut().skip(self.begun).zip(now) {
            *to = *from;
        }
        self.begun += now.len();
        if self.begun == HEADER {
            let [a, b, c, d, _] = self.header;
            let length = i32::from_be_bytes([a, b, c, d]);
            let whole = usize::try_from(length).ok().filter(|whole| (HEADER..=LONGEST).contains(whole));
            self.left = whole.ok_or(NoPacket { length })? - HEADER;
        }
        Ok(rest)
    }

    /// The packet is whole: what it says, when it says something.
    fn end(&mut self) -> Option<Said> {
        self.begun = 0;
        let said = self.kept.get(PREFIX - 1).and_then(|kind| Said::read(*kind, self.kept.get(PREFIX..)?));
        self.kept.clear();
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(kind: u8, body: &[u8]) -> Vec<u8> {
        let length = i32::try_from(HEADER + body.len()).unwrap();
        [&length.to_be_bytes()[..], &[kind], body].concat()
    }

    fn message(kind: u8, fields: &[u8]) -> Vec<u8> {
        packet(ROBOT_MESSAGE, &[&[0; 8], &[0xfe, kind][..], fields].concat())
    }

    fn heard(bytes: &[u8], piece: usize) -> Vec<Said> {
        let (mut reader, mut all) = (PrimaryReader::default(), Vec::new());
        for piece in bytes.chunks(piece) {
            reader.feed(piece, |said| all.push(said)).unwrap();
        }
        all
    }

    /// The official library's own bytes (tests/test_primary_parser.cpp), a state before them and a stop after.
    fn stream() -> Vec<u8> {
        let exception = [&[0, 0, 0, 3, 0, 0, 0, 1][..], b"compile_error_name_not_found:txtmsg:"].concat();
        let key = [&[0; 8][..], &[0x13], b"PROGRAM_XXX_STARTEDtextmsg"].concat();
        let error = [&[0, 0, 0, 153, 0, 0, 0, 1, 0, 0, 0, 3][..], &[0; 8], b"wrist 3\r\nwas pushed"].concat();
        let state = packet(16, &[7; 1381]);
        [state.clone(), message(7, &key), message(10, &exception), state, message(6, &error)].concat()
    }

    #[test]
    fn what_is_said_is_heard_however_the_stream_is_cut() {
        let whole = heard(&stream(), usize::MAX);
        let told: Vec<String> = whole.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "PROGRAM_XXX_STARTED: textmsg",
                "line 3, column 1: compile_error_name_not_found:txtmsg:",
                "C153A1: wrist 3  was pushed"
            ]
        );
        assert_eq!(whole.iter().map(Said::explains).collect::<Vec<_>>(), [false, true, true]);
        for piece in 1..40 {
            assert_eq!(heard(&stream(), piece), whole, "in pieces of {piece}");
        }
    }

    #[test]
    fn lengths_that_cannot_be_are_refused_and_long_words_are_cut() {
        for length in [-1_i32, 0, 4, 65_537, i32::MAX] {
            let bytes = [&length.to_be_bytes()[..], &[20]].concat();
            assert_eq!(PrimaryReader::default().feed(&bytes, |_| ()), Err(NoPacket { length }));
        }
        let web = PrimaryReader::default().feed(b"HTTP/1.1 400 Bad Request", |_| ());
        assert!(web.is_err());
        let long = message(10, &[b'x'; 5000]);
        let [Said::Exception { text, .. }] = &heard(&long, 100)[..] else { panic!("no exception") };
        assert_eq!(text.len(), KEPT - PREFIX - 8);
        // Cut short within: it says nothing, and the next is heard.
        let next = message(10, &[0, 0, 0, 1, 0, 0, 0, 1, b'y']);
        let cut =
            [message(7, &[0; 8]), message(6, &[1, 2]), message(7, &[0, 0, 0, 0, 0, 0, 0, 0, 200, 1]), next]
                .concat();
        assert_eq!(heard(&cut, 7).len(), 1);
    }
}
