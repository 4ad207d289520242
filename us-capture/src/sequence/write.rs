//! Sequences as bytes and on disk.

mod lines;

use std::ffi::OsStr;
use std::io::{self, Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use super::header::is_plain;
use super::{Format, Sequence, SequenceError};

impl Sequence {
    /// Writes `.mha`, `.mhd` (with a `.zraw` beside it) or `.nrrd`, by the ending; compressed. The file appears under
    /// its name when it is whole.
    ///
    /// # Errors
    /// When the ending is another, a field cannot be read back by PLUS or by us, or the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), SequenceError> {
        match path.extension().and_then(OsStr::to_str) {
            Some("mha") => save(path, &self.to_mha()?),
            Some("nrrd") => save(path, &self.to_nrrd()?),
            Some("mhd") => {
                let payload = path.with_extension("zraw");
                let name = payload.file_name().and_then(OsStr::to_str);
                let name = name.filter(|n| is_plain(n) && !n.contains(char::is_whitespace));
                let name = name.ok_or_else(|| SequenceError::DataFileName { path: payload.clone() })?;
                let packed = self.packed(Format::MetaImage);
                let header = lines::metaimage(self, packed.len(), name)?;
                save(&payload, &packed)?;
                save(path, header.as_bytes())
            }
            _ => Err(SequenceError::UnknownEnding { path: path.into() }),
        }
    }

    /// The bytes of a `.igs.mha` file, one zlib stream.
    ///
    /// # Errors
    /// When a field cannot be read back.
    pub fn to_mha(&self) -> Result<Vec<u8>, SequenceError> {
        let packed = self.packed(Format::MetaImage);
        let mut bytes = lines::metaimage(self, packed.len(), "LOCAL")?.into_bytes();
        bytes.extend(packed);
        Ok(bytes)
    }

    /// The bytes of a `.igs.nrrd` file, gzip.
    ///
    /// # Errors
    /// When a field cannot be read back.
    pub fn to_nrrd(&self) -> Result<Vec<u8>, SequenceError> {
        let mut bytes = lines::nrrd(self)?.into_bytes();
        bytes.extend(self.packed(Format::Nrrd));
        Ok(bytes)
    }

    /// One pixel or none is how recorders write poses without images: such a picture would not be read back.
    pub(super) fn check_size(&self) -> Result<(), SequenceError> {
        if !self.has_pictures() || self.width.saturating_mul(self.height) > 1 {
            return Ok(());
        }
        let why = "a picture of one pixel or none is read as no picture";
        Err(SequenceError::UnwritableField { field: "size of the images".into(), why })
    }

    /// Whether there is anything to see.
    pub(super) fn has_pictures(&self) -> bool {
        self.images.iter().any(|i| i.pixels.is_some())
    }

    /// All images one after the other, compressed; a missing picture is black, as its block has to be there. Poses
    /// without images have no bytes in MetaImage, and one a pose in NRRD, which knows no empty axis.
    fn packed(&self, format: Format) -> Vec<u8> {
        match format {
            Format::MetaImage if !self.has_pictures() => Vec::new(),
            Format::MetaImage => {
                let mut stream = ZlibEncoder::new(Vec::new(), Compression::default());
                self.pour(&mut stream);
                stream.finish().unwrap_or_default()
            }
            Format::Nrrd => {
                let mut stream = GzEncoder::new(Vec::new(), Compression::default());
                self.pour(&mut stream);
                stream.finish().unwrap_or_default()
            }
        }
    }

    /// Images that the header counts: the poses without pictures up to the last number, so that a gap stays one.
    pub(super) fn count(&self) -> u64 {
        if self.has_pictures() {
            return self.images.len() as u64;
        }
        self.images.last().map_or(0, |i| i.number.saturating_add(1))
    }

    /// A `Vec` takes every byte, so nothing here can fail.
    fn pour(&self, stream: &mut impl Write) {
        if !self.has_pictures() {
            let _infallible = io::copy(&mut io::repeat(0).take(self.count()), stream);
            return;
        }
        let black = vec![0; self.width * self.height];
        for image in &self.images {
            let _infallible = stream.write_all(image.pixels.as_deref().unwrap_or(&black));
        }
    }
}

/// Writes under another name first, so that a full disk leaves no half file under the right one.
///
/// # Errors
/// When the disk refuses.
pub fn save(path: &Path, bytes: &[u8]) -> Result<(), SequenceError> {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    let part = Path::new(&name);
    let refused = |source| SequenceError::Disk { doing: "write", path: path.into(), source };
    std::fs::write(part, bytes).and_then(|()| std::fs::rename(part, path)).map_err(|error| {
        let _already_failing = std::fs::remove_file(part);
        refused(error)
    })
}
