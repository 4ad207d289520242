//! The text header that MetaImage and NRRD files begin with. Bytes in, keys and values out: no file is opened, and
//! nothing is allocated that the bytes do not hold.

use std::collections::HashMap;
use std::str::FromStr;

use super::SequenceError;

/// One key with its value and the line it stood on (from one).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The key, without blanks around it.
    pub key: String,
    /// The value, without the padding that some writers leave.
    pub value: String,
    /// Where it stood.
    pub line: usize,
}

/// Which of the two formats a header is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.mha`, `.mhd`.
    MetaImage,
    /// `.nrrd`.
    Nrrd,
}

/// Keys and values in the file's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// The format.
    pub format: Format,
    /// What it says.
    pub entries: Vec<Entry>,
    /// Where the pixels begin in the bytes, when they follow the header.
    pub payload_at: usize,
}

impl Header {
    /// Reads the header at the start of `bytes`, MetaImage or NRRD by its first line.
    ///
    /// # Errors
    /// When the first line is of neither, a line has no key, two lines contradict, or the header does not end.
    pub fn parse(bytes: &[u8]) -> Result<Self, SequenceError> {
        let header =
            if bytes.starts_with(b"NRRD") { super::nrrd::parse } else { super::metaimage::parse }(bytes)?;
        header.contradictions()?;
        Ok(header)
    }

    /// A key that comes twice with two values: programs differ in which one they believe.
    fn contradictions(&self) -> Result<(), SequenceError> {
        let mut said: HashMap<&str, &Entry> = HashMap::with_capacity(self.entries.len());
        for entry in &self.entries {
            if let Some(before) = said.insert(&entry.key, entry)
                && before.value != entry.value
            {
                return Err(entry.bad(format!("line {} says {:?}", before.line, beginning(&before.value))));
            }
        }
        Ok(())
    }

    /// The first entry of that key.
    pub fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries.iter().find(|e| e.key == key)
    }

    /// The first value of that key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.entry(key).map(|e| e.value.as_str())
    }

    /// The value of a key that has to be there.
    ///
    /// # Errors
    /// When it is not.
    pub fn need(&self, key: &'static str) -> Result<&Entry, SequenceError> {
        self.entry(key).ok_or(SequenceError::MissingKey { key })
    }

    /// The words of a key, empty when the file does not say.
    pub fn words(&self, key: &str) -> Vec<&str> {
        self.get(key).map(|v| v.split_whitespace().collect()).unwrap_or_default()
    }

    /// The file beside the header that holds the payload; `None` when it follows the header.
    ///
    /// # Errors
    /// When the header names a list or pattern of files, or one outside its own folder.
    pub fn data_file(&self) -> Result<Option<&str>, SequenceError> {
        let key = match self.format {
            Format::MetaImage => "ElementDataFile",
            Format::Nrrd => "data file",
        };
        let name = match self.get(key) {
            None | Some("LOCAL" | "Local" | "local") => return Ok(None),
            Some(name) => name,
        };
        if is_plain(name) {
            return Ok(Some(name));
        }
        Err(SequenceError::Unsupported {
            key: key.into(),
            value: name.into(),
            why: "the pixels have to be in one file in the header's own folder",
        })
    }
}

impl Entry {
    /// The value as numbers.
    ///
    /// # Errors
    /// When a word of it is none.
    pub fn numbers<T: FromStr>(&self) -> Result<Vec<T>, SequenceError> {
        self.value.split_whitespace().map(|word| word.parse().map_err(|_| self.bad("not a number"))).collect()
    }

    /// The value as finite numbers.
    ///
    /// # Errors
    /// When a word of it is none, NaN or infinite.
    pub fn finite_numbers(&self) -> Result<Vec<f64>, SequenceError> {
        let numbers = self.numbers::<f64>()?;
        if numbers.iter().all(|x| x.is_finite()) { Ok(numbers) } else { Err(self.bad("not finite")) }
    }

    /// An error that points at this entry.
    pub fn bad(&self, why: impl Into<String>) -> SequenceError {
        SequenceError::BadValue {
            line: self.line,
            key: self.key.clone(),
            value: beginning(&self.value),
            why: why.into(),
        }
    }
}

/// Whether a name means one file beside the header: MetaImage and NRRD know lists and patterns of files too.
pub(super) fn is_plain(name: &str) -> bool {
    let words = name.split_whitespace().count();
    !name.contains(['/', '\\', '%', '\0']) && name != "LIST" && name != ".." && words == 1
}

/// Enough of a text to recognise it in a message.
pub(super) fn beginning(text: &str) -> String {
    text.chars().take(60).collect()
}

/// The lines of `bytes` with their number (from one) and the offset behind each. A last line without an end of line
/// is one too.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8], usize)> {
    let mut at = 0;
    bytes.split_inclusive(|b| *b == b'\n').enumerate().map(move |(index, line)| {
        at += line.len();
        let line = line.strip_suffix(b"\n").unwrap_or(line);
        (index + 1, line.strip_suffix(b"\r").unwrap_or(line), at)
    })
}
