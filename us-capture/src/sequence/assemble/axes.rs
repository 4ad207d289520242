//! Which axis is which: colour, columns, rows, images.

use crate::sequence::header::{Entry, Format, Header};
use crate::sequence::payload::Claim;
use crate::sequence::{Note, SequenceError};

/// The axes of a sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axes {
    /// Values a pixel.
    pub(super) channels: usize,
    /// Columns.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// Images claimed.
    pub(super) count: u64,
}

impl Axes {
    /// Whether there is anything to see: recorders write poses without images as 0 x 0 or 1 x 1.
    pub(super) const fn has_pictures(&self) -> bool {
        self.width > 1 || self.height > 1
    }

    /// The bytes claimed.
    pub(super) fn claim(&self) -> Result<Claim, SequenceError> {
        let block = self.width.checked_mul(self.height).and_then(|p| p.checked_mul(self.channels));
        let block = block.ok_or(SequenceError::TooLarge { needs: u64::MAX, limit: usize::MAX as u64 })?;
        Ok(Claim { block: block as u64, count: self.count })
    }
}

/// The axes a header speaks of.
pub(super) fn of(header: &Header, has_fields: bool, notes: &mut Vec<Note>) -> Result<Axes, SequenceError> {
    let (sizes_key, kinds_key) = match header.format {
        Format::MetaImage => ("DimSize", "Kinds"),
        Format::Nrrd => ("sizes", "kinds"),
    };
    let entry = header.need(sizes_key)?;
    let mut sizes = entry.numbers::<u64>()?;
    let mut kinds = header.words(kinds_key);
    let ndims = header.entry("NDims").or_else(|| header.entry("dimension"));
    check_dimensions(ndims, entry, sizes.len(), &kinds)?;
    let channels = channels(header, &mut sizes, &mut kinds)?;
    let count = images_axis(entry, &mut sizes, &kinds, has_fields, notes)?;
    let &[width, height] = sizes.as_slice() else {
        return Err(entry.bad("two axes of an image were expected"));
    };
    if (width == 0) != (height == 0) {
        return Err(entry.bad("an image without columns or without rows"));
    }
    let small = |n: u64| usize::try_from(n).map_err(|_| entry.bad("too large"));
    Ok(Axes { channels, width: small(width)?, height: small(height)?, count })
}

fn check_dimensions(
    ndims: Option<&Entry>,
    sizes: &Entry,
    count: usize,
    kinds: &[&str],
) -> Result<(), SequenceError> {
    if let Some(ndims) = ndims
        && ndims.value.parse() != Ok(count)
    {
        return Err(sizes.bad(format!("{} dimensions were announced, {count} sizes came", ndims.value)));
    }
    if !kinds.is_empty() && kinds.len() != count {
        return Err(sizes.bad(format!("{count} sizes, but {} kinds", kinds.len())));
    }
    Ok(())
}

/// Takes the colour off: MetaImage counts channels apart, NRRD has an axis for them in front.
fn channels(header: &Header, sizes: &mut Vec<u64>, kinds: &mut Vec<&str>) -> Result<usize, SequenceError> {
    let mut value = header.get("ElementNumberOfChannels").unwrap_or("1").to_owned();
    if matches!(kinds.first(), Some(&("vector" | "RGB-color" | "RGBA-color" | "3-color" | "4-color"))) {
        kinds.remove(0);
        value = sizes.remove(0).to_string();
    }
    match value.parse() {
        Ok(channels @ (1 | 3 | 4)) => Ok(channels),
        _ => Err(SequenceError::Unsupported {
            key: "number of channels".into(),
            value,
            why: "known are 1 (grey), 3 (RGB) and 4 (RGBA)",
        }),
    }
}

/// Takes the images' axis off. It is the last, and only when its kind is `list` or `time`; two axes are one image.
fn images_axis(
    entry: &Entry,
    sizes: &mut Vec<u64>,
    kinds: &[&str],
    has_fields: bool,
    notes: &mut Vec<Note>,
) -> Result<u64, SequenceError> {
    if sizes.len() == 2 && !matches!(kinds.last(), Some(&("list" | "time"))) {
        return Ok(1);
    }
    match kinds.last() {
        Some(&("list" | "time")) => (),
        None if has_fields => notes.push(Note::KindsUnsaid),
        kind => return Err(SequenceError::NotASequence { kind: kind.copied().unwrap_or_default().into() }),
    }
    let count = sizes.pop().ok_or_else(|| entry.bad("no axis at all"))?;
    // PLUS 2.9 writes four axes, the third a single plane.
    while sizes.len() > 2 && sizes.last() == Some(&1) {
        sizes.pop();
    }
    Ok(count)
}

/// Grey of a block of pixels: ITU-R BT.601 luma in integers; a fourth channel (alpha) is left out.
pub(super) fn to_grey(block: Vec<u8>, channels: usize) -> Vec<u8> {
    if channels == 1 {
        return block;
    }
    let luma = |p: &[u8]| match p {
        [r, g, b, ..] => {
            ((299 * u32::from(*r) + 587 * u32::from(*g) + 114 * u32::from(*b) + 500) / 1000) as u8
        }
        _ => 0,
    };
    block.chunks_exact(channels).map(luma).collect()
}
