//! A volume written part after part: what is in memory is one part, whatever the volume's size.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use probepath_us_capture::sequence::{Format, SequenceError};

use super::super::{Grid, Mark, Tiles};
use super::{format_of, metaimage, nrrd};

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Voxels that pixels were put into.
    pub seen: u64,
    /// Voxels that were filled.
    pub filled: u64,
    /// Parts it was built in.
    pub parts: usize,
}

impl Tiles<'_> {
    /// Builds and writes all parts: grey levels and marks, each as `.mha` or `.nrrd`, by the ending. After each part
    /// `progress` hears how much is done (0 to 1).
    ///
    /// # Errors
    /// When an ending is another, or the disk refuses; then no file is left under its right name.
    pub fn write(
        self,
        grey: &Path,
        marks: &Path,
        mut progress: impl FnMut(f64),
    ) -> Result<Written, SequenceError> {
        let mut files = (Layered::create(grey, self.grid())?, Layered::create(marks, self.grid())?);
        let parts = self.parts();
        let mut written = Written { seen: 0, filled: 0, parts };
        for (number, part) in self.enumerate() {
            written.seen += part.count(Mark::Seen) as u64;
            written.filled += part.count(Mark::Filled) as u64;
            let (grey, marks) =
                rayon::join(|| files.0.write(part.grey()), || files.1.write_marks(part.marks()));
            grey.and(marks)?;
            progress((number + 1) as f64 / parts as f64);
        }
        files.0.finish()?;
        files.1.finish().map(|()| written)
    }
}

/// One layer on its way to the disk, under another name until it is whole.
struct Layered {
    path: PathBuf,
    part: PathBuf,
    /// `None` once it is finished.
    stream: Option<Stream>,
    /// Where MetaImage's header says how long the stream is, and how long the header is.
    size_at: Option<(u64, u64)>,
}

enum Stream {
    Zlib(ZlibEncoder<BufWriter<File>>),
    Gzip(GzEncoder<BufWriter<File>>),
}

/// As wide as any size: the header is written before the size is known.
const SIZE_DIGITS: usize = 20;

impl Layered {
    fn create(path: &Path, grid: &Grid) -> Result<Self, SequenceError> {
        let format = format_of(path)?;
        let mut name = path.as_os_str().to_owned();
        name.push(".part");
        let part = PathBuf::from(name);
        let refused = |source| refused(path, source);
        let mut file = BufWriter::new(File::create(&part).map_err(refused)?);
        let blank = " ".repeat(SIZE_DIGITS);
        let header = match format {
            Format::MetaImage => metaimage(grid, &blank),
            Format::Nrrd => nrrd(grid),
        };
        let size_at = (format == Format::MetaImage)
            .then(|| header.find(&blank).map(|at| (at as u64, header.len() as u64)))
            .flatten();
        let mut layered = Self { path: path.into(), part, stream: None, size_at };
        file.write_all(header.as_bytes()).map_err(refused)?;
        // The default squeezes ultrasound by a few percent more, for several times the time.
        layered.stream = Some(match format {
            Format::MetaImage => Stream::Zlib(ZlibEncoder::new(file, Compression::fast())),
            Format::Nrrd => Stream::Gzip(GzEncoder::new(file, Compression::fast())),
        });
        Ok(layered)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), SequenceError> {
        let done = match &mut self.stream {
            Some(Stream::Zlib(stream)) => stream.write_all(bytes),
            Some(Stream::Gzip(stream)) => stream.write_all(bytes),
            None => Ok(()),
        };
        done.map_err(|source| refused(&self.path, source))
    }

    fn write_marks(&mut self, marks: &[Mark]) -> Result<(), SequenceError> {
        let mut bytes = Vec::new();
        for marks in marks.chunks(1 << 16) {
            bytes.clear();
            bytes.extend(marks.iter().map(|mark| *mark as u8));
            self.write(&bytes)?;
        }
        Ok(())
    }

    /// Says how long the stream became, and gives the file its name.
    fn finish(mut self) -> Result<(), SequenceError> {
        let done = self.close();
        done.map_err(|source| refused(&self.path, source))
    }

    fn close(&mut self) -> io::Result<()> {
        let mut file = match self.stream.take() {
            Some(Stream::Zlib(stream)) => stream.finish()?,
            Some(Stream::Gzip(stream)) => stream.finish()?,
            None => return Ok(()),
        };
        if let Some((at, header)) = self.size_at {
            let size = file.stream_position()? - header;
            file.seek(SeekFrom::Start(at))?;
            write!(file, "{size:>SIZE_DIGITS$}")?;
        }
        file.flush()?;
        std::fs::rename(&self.part, &self.path)
    }
}

impl Drop for Layered {
    /// A file that was not finished goes away.
    fn drop(&mut self) {
        if self.stream.take().is_some() {
            let _already_failing = std::fs::remove_file(&self.part);
        }
    }
}

fn refused(path: &Path, source: io::Error) -> SequenceError {
    SequenceError::Disk { doing: "write", path: path.into(), source }
}
