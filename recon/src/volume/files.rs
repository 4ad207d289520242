//! Volumes as MHA and NRRD: LPS, millimetres, both said in the file.

mod parts;

use std::ffi::OsStr;
use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use nalgebra::Vector3;
use probepath_frames::Point;
use probepath_us_capture::sequence::{Claim, Entry, Format, Header, SequenceError, read_parts, save, unpack};

pub use parts::Written;

use super::{Grid, Mark, Volume};

/// What of a volume is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Grey levels.
    Grey,
    /// What each voxel is worth: 0 unseen, 1 seen, 2 filled.
    Marks,
}

impl Volume {
    /// Writes one layer as `.mha` or `.nrrd`, by the ending.
    ///
    /// # Errors
    /// When the ending is another, or the disk refuses.
    pub fn write(&self, path: &Path, layer: Layer) -> Result<(), SequenceError> {
        save(path, &self.to_bytes(format_of(path)?, layer))
    }

    /// The bytes of such a file.
    pub fn to_bytes(&self, format: Format, layer: Layer) -> Vec<u8> {
        let marks: Vec<u8>;
        let voxels = match layer {
            Layer::Grey => &self.grey,
            Layer::Marks => {
                marks = self.marks.iter().map(|m| *m as u8).collect();
                &marks
            }
        };
        let packed = packed(format, voxels);
        let mut bytes = match format {
            Format::MetaImage => metaimage(&self.grid, &packed.len().to_string()),
            Format::Nrrd => nrrd(&self.grid),
        }
        .into_bytes();
        bytes.extend(packed);
        bytes
    }

    /// Reads a volume of 8 bits from `.mha`, `.mhd` or `.nrrd`. Every voxel counts as seen: such files do not say.
    ///
    /// # Errors
    /// When the disk refuses, the file is cut or damaged, no volume, of another type, or turned against LPS.
    pub fn read(path: &Path, most_bytes: u64) -> Result<Self, SequenceError> {
        let (header, bytes) = read_parts(path)?;
        Self::assemble(&header, bytes.get(header.payload_at..).unwrap_or_default(), most_bytes)
    }

    /// The volume of a header and its payload; no file is opened.
    ///
    /// # Errors
    /// As [`read`](Self::read), but for the disk.
    pub fn assemble(header: &Header, payload: &[u8], most_bytes: u64) -> Result<Self, SequenceError> {
        let grid = grid(header)?;
        let block = grid.voxels().ok_or(SequenceError::TooLarge { needs: u64::MAX, limit: most_bytes })?;
        let claim = Claim { block: block as u64, count: 1 };
        let mut grey = Vec::new();
        unpack(payload, header.packing()?, claim, most_bytes, |_, block| grey = block)?;
        let marks = vec![Mark::Seen; grey.len()];
        Ok(Self { grid, grey, marks })
    }
}

fn format_of(path: &Path) -> Result<Format, SequenceError> {
    match path.extension().and_then(OsStr::to_str) {
        Some("mha") => Ok(Format::MetaImage),
        Some("nrrd") => Ok(Format::Nrrd),
        _ => Err(SequenceError::UnknownEnding { path: path.into() }),
    }
}

/// A `Vec` takes every byte, so nothing here can fail.
fn packed(format: Format, voxels: &[u8]) -> Vec<u8> {
    match format {
        Format::MetaImage => {
            let mut stream = ZlibEncoder::new(Vec::new(), Compression::default());
            let _infallible = stream.write_all(voxels);
            stream.finish().unwrap_or_default()
        }
        Format::Nrrd => {
            let mut stream = GzEncoder::new(Vec::new(), Compression::default());
            let _infallible = stream.write_all(voxels);
            stream.finish().unwrap_or_default()
        }
    }
}

/// Millimetres without the dust that a thousandfold leaves (0.0005 m is 0.5 mm, not 0.49999999999999994).
fn mm(metres: f64) -> f64 {
    (metres * 1e12).round() / 1e9
}

fn metaimage(grid: &Grid, packed: &str) -> String {
    let ([nx, ny, nz], [sx, sy, sz], o) = (grid.size, grid.spacing_m.map(mm), grid.origin.vector().map(mm));
    // RAI is MetaImage's name for axes that run from right, anterior and inferior: toward left, posterior, superior.
    format!(
        "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = RAI\nBinaryData = True\n\
         BinaryDataByteOrderMSB = False\nCenterOfRotation = 0 0 0\nCompressedData = True\n\
         CompressedDataSize = {packed}\nDimSize = {nx} {ny} {nz}\nKinds = domain domain domain\n\
         ElementNumberOfChannels = 1\nElementSpacing = {sx} {sy} {sz}\nElementType = MET_UCHAR\n\
         Offset = {} {} {}\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nElementDataFile = LOCAL\n",
        o.x, o.y, o.z
    )
}

fn nrrd(grid: &Grid) -> String {
    let ([nx, ny, nz], [sx, sy, sz], o) = (grid.size, grid.spacing_m.map(mm), grid.origin.vector().map(mm));
    format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: {nx} {ny} {nz}\n\
         space directions: ({sx},0,0) (0,{sy},0) (0,0,{sz})\nkinds: domain domain domain\n\
         space units: \"mm\" \"mm\" \"mm\"\nencoding: gzip\nspace origin: ({},{},{})\n\n",
        o.x, o.y, o.z
    )
}

fn grid(header: &Header) -> Result<Grid, SequenceError> {
    match header.format {
        Format::MetaImage => metaimage_grid(header),
        Format::Nrrd => nrrd_grid(header),
    }
}

fn metaimage_grid(header: &Header) -> Result<Grid, SequenceError> {
    header.need("ElementType")?;
    expect(header, "ElementType", &["MET_UCHAR"], "only 8 bits without sign are")?;
    expect(header, "ElementNumberOfChannels", &["1"], "only grey levels are")?;
    // Of these MetaImage knows three names each.
    for key in ["TransformMatrix", "Rotation", "Orientation"] {
        if let Some(entry) = header.entry(key)
            && entry.finite_numbers()? != [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        {
            return Err(entry.bad("a turned volume is not supported"));
        }
    }
    let origin = ["Position", "Origin"].into_iter().find_map(|key| header.entry(key));
    let origin = origin.map_or_else(|| header.need("Offset"), Ok)?;
    let spacing = header.need("ElementSpacing")?;
    let (spacing, origin) =
        (three(spacing, spacing.finite_numbers()?)?, three(origin, origin.finite_numbers()?)?);
    assembled(header.need("DimSize")?, header.words("Kinds").last().copied(), spacing, origin)
}

fn nrrd_grid(header: &Header) -> Result<Grid, SequenceError> {
    header.need("type")?;
    expect(header, "type", &["uint8", "uchar", "unsigned char", "uint8_t"], "only 8 bits without sign are")?;
    header.need("space")?;
    expect(header, "space", &["left-posterior-superior", "LPS"], "only left-posterior-superior is")?;
    let mm = r#""mm" "mm" "mm""#;
    expect(header, "space units", &[mm], "only millimetres are")?;
    let directions = header.need("space directions")?;
    let numbers = parenthesised(directions)?;
    let &[sx, 0.0, 0.0, 0.0, sy, 0.0, 0.0, 0.0, sz] = numbers.as_slice() else {
        return Err(directions.bad("a turned volume is not supported"));
    };
    let origin = header.need("space origin")?;
    let origin = three(origin, parenthesised(origin)?)?;
    assembled(header.need("sizes")?, header.words("kinds").last().copied(), [sx, sy, sz], origin)
}

fn assembled(
    sizes: &Entry,
    last_kind: Option<&str>,
    spacing_mm: [f64; 3],
    origin_mm: [f64; 3],
) -> Result<Grid, SequenceError> {
    let &[nx, ny, nz] = sizes.numbers::<usize>()?.as_slice() else {
        return Err(sizes.bad("a volume has three axes"));
    };
    if matches!(last_kind, Some("list" | "time")) {
        return Err(sizes.bad("the last axis counts images: this is a sequence, not a volume"));
    }
    if [nx, ny, nz].contains(&0) || spacing_mm.iter().any(|s| *s <= 0.0) {
        return Err(sizes.bad("an axis without voxels, or a voxel without size"));
    }
    let origin = Point::from_vector(Vector3::from(origin_mm) * 1e-3);
    Ok(Grid { origin, spacing_m: spacing_mm.map(|s| s * 1e-3), size: [nx, ny, nz] })
}

/// Refuses another value than these; an absent key is none.
fn expect(header: &Header, key: &str, known: &[&str], why: &'static str) -> Result<(), SequenceError> {
    match header.get(key) {
        Some(value) if !known.contains(&value) => {
            Err(SequenceError::Unsupported { key: key.into(), value: value.into(), why })
        }
        _ => Ok(()),
    }
}

fn three(entry: &Entry, numbers: Vec<f64>) -> Result<[f64; 3], SequenceError> {
    numbers.try_into().map_err(|_| entry.bad("three numbers were expected"))
}

/// The numbers of `(1,0,0) (0,1,0)`.
fn parenthesised(entry: &Entry) -> Result<Vec<f64>, SequenceError> {
    let value = entry.value.replace(['(', ')', ','], " ");
    Entry { value, ..entry.clone() }.finite_numbers()
}
