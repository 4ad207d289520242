//! The NRRD header: `key: value` fields, `key:=value` pairs, `#` comments, a blank line at the end.

use super::SequenceError;
use super::header::{Entry, Format, Header, beginning, lines};

/// Reads the header up to its blank line (or to the end of a detached header).
pub(super) fn parse(bytes: &[u8]) -> Result<Header, SequenceError> {
    let mut entries = Vec::new();
    let mut detached = false;
    for (number, line, end) in lines(bytes) {
        let text = String::from_utf8_lossy(line);
        if number == 1 {
            magic(&text)?;
        } else if text.is_empty() {
            return Ok(Header { format: Format::Nrrd, entries, payload_at: end });
        } else if !text.starts_with('#') {
            let entry = entry(number, &text)?;
            detached |= entry.key == "data file";
            entries.push(entry);
        }
    }
    if detached {
        return Ok(Header { format: Format::Nrrd, entries, payload_at: bytes.len() });
    }
    Err(SequenceError::NotAHeader { why: "no blank line ends the NRRD header; was it cut?" })
}

fn magic(first: &str) -> Result<(), SequenceError> {
    match first.strip_prefix("NRRD000") {
        Some("1" | "2" | "3" | "4" | "5") => Ok(()),
        _ => Err(SequenceError::NotAHeader { why: "the first line is not NRRD0001 to NRRD0005" }),
    }
}

fn entry(line: usize, text: &str) -> Result<Entry, SequenceError> {
    let bad = || SequenceError::BadLine {
        line,
        why: "neither `field: value` nor `key:=value`",
        text: beginning(text),
    };
    let (key, rest) = text.split_once(':').filter(|(key, _)| !key.trim().is_empty()).ok_or_else(bad)?;
    if let Some(value) = rest.strip_prefix('=') {
        return Ok(Entry { key: key.trim().into(), value: unescaped(value).trim().into(), line });
    }
    let value = rest.strip_prefix(' ').ok_or_else(bad)?.trim().into();
    let key = if key == "datafile" { "data file" } else { key.trim() };
    Ok(Entry { key: key.into(), value, line })
}

/// In pairs a line's end is written `\n` and a backslash `\\`.
fn unescaped(value: &str) -> String {
    let mut out = String::with_capacity(value.len());
    let mut chars = value.chars();
    while let Some(c) = chars.next() {
        match (c, c == '\\') {
            (_, true) => match chars.next() {
                Some('n') => out.push('\n'),
                Some(other) => out.push(other),
                None => out.push('\\'),
            },
            _ => out.push(c),
        }
    }
    out
}

/// The other way round.
pub(super) fn escaped(value: &str) -> String {
    value.replace('\\', "\\\\").replace('\n', "\\n")
}
