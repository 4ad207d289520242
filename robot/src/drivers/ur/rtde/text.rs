//! [`Text`]: words that either end may say at any time.

use std::borrow::Cow;

use super::packet::{cut, short};
use super::{RtdeError, Version};

/// How grave a [`Text`] is. A number that is none of these is taken for an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// The program ended by it.
    Exception,
    /// It failed.
    Error,
    /// It may fail.
    Warning,
    /// Good to know.
    Info,
}

impl Level {
    /// The one of that number on the wire.
    pub const fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Exception,
            2 => Self::Warning,
            3 => Self::Info,
            _ => Self::Error,
        }
    }

    /// Its number on the wire.
    pub const fn number(self) -> u8 {
        match self {
            Self::Exception => 0,
            Self::Error => 1,
            Self::Warning => 2,
            Self::Info => 3,
        }
    }
}

/// Words. They are bytes, because nothing says in which alphabet they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text<'a> {
    /// How grave.
    pub level: Level,
    /// Who says it; version 1 does not tell.
    pub source: &'a [u8],
    /// What is said.
    pub message: &'a [u8],
}

impl<'a> Text<'a> {
    /// What is said, as text; what is none becomes a question mark in a diamond.
    pub fn words(&self) -> Cow<'a, str> {
        String::from_utf8_lossy(self.message)
    }

    pub(super) fn read(payload: &'a [u8], version: Version) -> Result<Self, RtdeError> {
        let error = || short("a text message", payload, "fewer than its own lengths say");
        if version == Version::V1 {
            let (&[level], message) = payload.split_first_chunk().ok_or_else(error)?;
            return Ok(Self { level: Level::from_number(level), source: &[], message });
        }
        let (message, rest) = string(payload).ok_or_else(error)?;
        let (source, rest) = string(rest).ok_or_else(error)?;
        match rest {
            [level] => Ok(Self { level: Level::from_number(*level), source, message }),
            [] => Err(error()),
            _ => Err(short("a text message", payload, "more than its own lengths say")),
        }
    }

    pub(super) fn write(&self, version: Version, to: &mut Vec<u8>) -> Result<(), RtdeError> {
        if version == Version::V1 {
            to.push(self.level.number());
            to.extend_from_slice(self.message);
            return Ok(());
        }
        for text in [self.message, self.source] {
            let length = u8::try_from(text.len())
                .map_err(|_| RtdeError::DoesNotFit { what: "words", length: text.len() })?;
            to.push(length);
            to.extend_from_slice(text);
        }
        to.push(self.level.number());
        Ok(())
    }
}

/// A length as one byte, and as many bytes.
fn string(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (&[length], rest) = bytes.split_first_chunk()?;
    cut(rest, usize::from(length))
}
