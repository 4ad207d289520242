//! Sequences from and to disk. The only place here that opens a file.

use std::fs;
use std::path::Path;

use super::header::Header;
use super::{ReadOptions, Sequence, SequenceError};

impl Sequence {
    /// Reads `.mha`, `.mhd` (with the file it names) or `.nrrd`; which one it is the first line says.
    ///
    /// # Errors
    /// When the disk refuses, or the file is not a sequence of images that can be used; each error says where.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, SequenceError> {
        let (header, bytes) = read_parts(path)?;
        let payload = bytes.get(header.payload_at..).unwrap_or_default();
        Self::assemble(&header, payload, options)
    }
}

/// A header, and the bytes whose part from `payload_at` on is the payload it speaks of.
///
/// # Errors
/// When the disk refuses, or there is no header.
pub fn read_parts(path: &Path) -> Result<(Header, Vec<u8>), SequenceError> {
    let bytes = read(path)?;
    let mut header = Header::parse(&bytes)?;
    let Some(name) = header.data_file()? else { return Ok((header, bytes)) };
    let payload = read(&path.with_file_name(name))?;
    header.payload_at = 0;
    Ok((header, payload))
}

fn read(path: &Path) -> Result<Vec<u8>, SequenceError> {
    fs::read(path).map_err(|source| SequenceError::Disk { doing: "read", path: path.into(), source })
}
