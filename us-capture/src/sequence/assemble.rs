//! From a header and its payload to a [`Sequence`].

mod axes;
pub(super) mod fields;

use super::header::{Format, Header};
use super::orientation::Orientation;
use super::payload::{Claim, Packing, unpack};
use super::{Note, ReadOptions, Sequence, SequenceError, SequenceImage};
use axes::Axes;
use fields::ImageFields;

impl Sequence {
    /// The sequence of a header and the payload it speaks of. Bytes in, sequence out: no file is opened.
    ///
    /// # Errors
    /// Whatever is wrong with either, with the line or the numbers that disagree.
    pub fn assemble(header: &Header, payload: &[u8], options: &ReadOptions) -> Result<Self, SequenceError> {
        let (fields, rest) = fields::split(header);
        let mut notes = Vec::new();
        let axes = axes::of(header, !fields.is_empty(), &mut notes)?;
        pixel_type(header, &axes)?;
        let orientation = orientation(header, &axes, options, &mut notes)?;
        let pictures = pictures(payload, header.packing()?, &axes, orientation, options)?;
        let images = join(pictures, fields, &axes, &mut notes)?;
        let (width, height) = if axes.has_pictures() { (axes.width, axes.height) } else { (0, 0) };
        fields::look_over(&images, axes.has_pictures(), &mut notes);
        Ok(Self { width, height, images, fields: rest, notes })
    }
}

impl Header {
    /// How the payload is packed.
    ///
    /// # Errors
    /// When it is packed in a way that is not supported.
    pub fn packing(&self) -> Result<Packing, SequenceError> {
        match self.format {
            Format::MetaImage => metaimage_packing(self),
            Format::Nrrd => nrrd_packing(self),
        }
    }
}

/// Eight bits without sign, or nothing at all.
fn pixel_type(header: &Header, axes: &Axes) -> Result<(), SequenceError> {
    let (key, eight_bits): (&'static str, &[&str]) = match header.format {
        Format::MetaImage => ("ElementType", &["MET_UCHAR"]),
        Format::Nrrd => ("type", &["uint8", "uchar", "unsigned char", "uint8_t"]),
    };
    let entry = header.need(key)?;
    if eight_bits.contains(&entry.value.as_str()) || (!axes.has_pictures() && entry.value == "MET_OTHER") {
        return kind_of_image(header);
    }
    let why = "only B-mode images of 8 bits without sign are";
    Err(SequenceError::Unsupported { key: key.into(), value: entry.value.clone(), why })
}

/// B-mode, not RF.
fn kind_of_image(header: &Header) -> Result<(), SequenceError> {
    for key in ["UltrasoundImageType", "ultrasound image type"] {
        if let Some(value) = header.get(key)
            && value.starts_with("RF")
        {
            let why = "RF data have to be converted to B-mode first";
            return Err(SequenceError::Unsupported { key: key.into(), value: value.into(), why });
        }
    }
    Ok(())
}

/// How the images are stored, when there are any.
fn orientation(
    header: &Header,
    axes: &Axes,
    options: &ReadOptions,
    notes: &mut Vec<Note>,
) -> Result<Orientation, SequenceError> {
    let said =
        header.get("UltrasoundImageOrientation").or_else(|| header.get("ultrasound image orientation"));
    if !axes.has_pictures() {
        notes.push(Note::NoPictures);
        return Ok(Orientation::Mf);
    }
    if axes.channels > 1 {
        notes.push(Note::ColourToGrey { channels: axes.channels });
    }
    let orientation = match (Orientation::parse(said)?, options.assume_orientation) {
        (Some(said), _) => said,
        (None, Some(assumed)) => {
            notes.push(Note::OrientationAssumed(assumed));
            assumed
        }
        (None, None) => return Err(SequenceError::NoOrientation),
    };
    if orientation != Orientation::Mf {
        notes.push(Note::Turned { from: orientation });
    }
    Ok(orientation)
}

fn metaimage_packing(header: &Header) -> Result<Packing, SequenceError> {
    if header.get("BinaryData").is_some_and(|v| !v.eq_ignore_ascii_case("true")) {
        let why = "pixels as text are not; write them with BinaryData = True";
        return Err(SequenceError::Unsupported { key: "BinaryData".into(), value: "False".into(), why });
    }
    if !header.get("CompressedData").is_some_and(|v| v.eq_ignore_ascii_case("true")) {
        return Ok(Packing::Raw);
    }
    let Some(entry) = header.entry("CompressedDataSize") else { return Ok(Packing::Zlib(None)) };
    let size = entry.value.parse().map_err(|_| entry.bad("not a number of bytes"))?;
    Ok(Packing::Zlib(Some(size)))
}

fn nrrd_packing(header: &Header) -> Result<Packing, SequenceError> {
    for key in ["line skip", "lineskip", "byte skip", "byteskip"] {
        if let Some(value) = header.get(key).filter(|v| *v != "0") {
            let why = "the pixels have to begin at the payload's first byte";
            return Err(SequenceError::Unsupported { key: key.into(), value: value.into(), why });
        }
    }
    match header.need("encoding")?.value.as_str() {
        "raw" => Ok(Packing::Raw),
        "gz" | "gzip" => Ok(Packing::Gzip),
        other => Err(SequenceError::Unsupported {
            key: "encoding".into(),
            value: other.into(),
            why: "known are raw and gzip",
        }),
    }
}

/// The pictures, grey and MF; empty for poses without images, whose payload is checked all the same.
fn pictures(
    payload: &[u8],
    packing: Packing,
    axes: &Axes,
    orientation: Orientation,
    options: &ReadOptions,
) -> Result<Vec<std::sync::Arc<[u8]>>, SequenceError> {
    let claim = axes.claim()?;
    let mut pictures = Vec::new();
    // Recorders of poses differ in whether they write the pixels that nobody looks at.
    if claim.block == 0 || (!axes.has_pictures() && payload.is_empty()) {
        return unpack(
            payload,
            packing_of_nothing(packing, payload),
            Claim { block: 0, count: 0 },
            0,
            |_, _| (),
        )
        .map(|()| pictures);
    }
    let most = most_pixels(claim, options.most_bytes)?;
    unpack(payload, packing, claim, most, |_, block| {
        if axes.has_pictures() {
            let mut grey = axes::to_grey(block, axes.channels);
            orientation.bring_to_mf(&mut grey, axes.width);
            pictures.push(grey.into());
        }
    })?;
    Ok(pictures)
}

/// The limit for the pixels alone: millions of tiny images need more for themselves than for their pixels.
fn most_pixels(claim: Claim, limit: u64) -> Result<u64, SequenceError> {
    let an_image = claim.block.saturating_add(size_of::<SequenceImage>() as u64);
    let needs = claim.count.saturating_mul(an_image);
    if needs > limit {
        return Err(SequenceError::TooLarge { needs, limit });
    }
    Ok(limit)
}

/// No pixels need no stream, whatever the header says of its packing.
fn packing_of_nothing(packing: Packing, payload: &[u8]) -> Packing {
    if payload.is_empty() { Packing::Raw } else { packing }
}

/// Pictures with their fields; poses without images are as many as the header really speaks of.
fn join(
    pictures: Vec<std::sync::Arc<[u8]>>,
    mut fields: ImageFields<'_>,
    axes: &Axes,
    notes: &mut Vec<Note>,
) -> Result<Vec<SequenceImage>, SequenceError> {
    if let Some((number, entries)) = fields.last_key_value()
        && *number >= axes.count
    {
        let line = entries.first().map_or(0, |(_, e)| e.line);
        return Err(SequenceError::BeyondLast { line, number: *number, images: axes.count });
    }
    if pictures.is_empty() {
        fields::count_unsaid(axes.count, fields.keys().copied(), notes);
        return fields
            .into_iter()
            .map(|(number, entries)| fields::image(number, &entries, None, notes))
            .collect();
    }
    fields::count_unsaid(axes.count, fields.keys().copied(), notes);
    (0..)
        .zip(pictures)
        .map(|(n, p)| fields::image(n, &fields.remove(&n).unwrap_or_default(), Some(p), notes))
        .collect()
}
