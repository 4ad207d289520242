//! The MetaImage header: `Key = Value` a line, `ElementDataFile` last.

use super::SequenceError;
use super::header::{Entry, Format, Header, beginning, lines};

/// Reads the header up to and with `ElementDataFile`.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, SequenceError> {
    let mut entries = Vec::new();
    for (number, line, end) in lines(bytes) {
        let text = String::from_utf8_lossy(line);
        if text.trim().is_empty() {
            continue;
        }
        let entry = entry(number, &text)?;
        if entries.is_empty() && entry.key != "ObjectType" {
            return Err(SequenceError::NotAHeader { why: "the first line is not `ObjectType = Image`" });
        }
        let last = entry.key == "ElementDataFile";
        entries.push(entry);
        if last {
            return Ok(Header { format: Format::MetaImage, entries, payload_at: end });
        }
    }
    Err(SequenceError::NotAHeader { why: "no line `ElementDataFile = …` ends the header; was it cut?" })
}

fn entry(line: usize, text: &str) -> Result<Entry, SequenceError> {
    let (key, value) = text.split_once('=').filter(|(key, _)| !key.trim().is_empty()).ok_or_else(|| {
        if line == 1 {
            return SequenceError::NotAHeader {
                why: "the first line is neither `ObjectType = Image` nor `NRRD…`",
            };
        }
        SequenceError::BadLine { line, why: "not of the form `Key = Value`", text: beginning(text) }
    })?;
    Ok(Entry { key: key.trim().into(), value: value.trim().into(), line })
}
