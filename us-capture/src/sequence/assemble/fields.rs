//! The fields of single images: `Seq_Frame0000_<Field>`.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Matrix4;

use crate::sequence::header::{Entry, Header};
use crate::sequence::image::{SequenceImage, Status, Tracked, TransformName};
use crate::sequence::{Note, SequenceError, stamps};

/// Fields by image: the field's name and where it stood.
pub(super) type ImageFields<'h> = BTreeMap<u64, Vec<(&'h str, &'h Entry)>>;

/// Keys of the format itself; everything else is kept as a field of the file.
const FORMAT_KEYS: [&str; 35] = [
    "ObjectType",
    "NDims",
    "AnatomicalOrientation",
    "BinaryData",
    "BinaryDataByteOrderMSB",
    "CenterOfRotation",
    "CompressedData",
    "CompressedDataSize",
    "DimSize",
    "Kinds",
    "ElementNumberOfChannels",
    "ElementSpacing",
    "ElementType",
    "Offset",
    "TransformMatrix",
    "UltrasoundImageOrientation",
    "UltrasoundImageType",
    "ElementDataFile",
    "data file",
    "datafile",
    "line skip",
    "lineskip",
    "byte skip",
    "byteskip",
    "dimension",
    "encoding",
    "endian",
    "kinds",
    "sizes",
    "space dimension",
    "space directions",
    "space origin",
    "type",
    "ultrasound image orientation",
    "ultrasound image type",
];

/// Fields of images apart from fields of the file.
pub(super) fn split(header: &Header) -> (ImageFields<'_>, Vec<(String, String)>) {
    let (mut images, mut rest) = (ImageFields::new(), Vec::new());
    for entry in &header.entries {
        match image_key(&entry.key) {
            Some((number, field)) => images.entry(number).or_default().push((field, entry)),
            None if FORMAT_KEYS.contains(&entry.key.as_str()) => (),
            None => rest.push((entry.key.clone(), entry.value.clone())),
        }
    }
    (images, rest)
}

/// Whether a key means something to the reader, so that no field of the whole file may be called so.
pub(in crate::sequence) fn is_taken(key: &str) -> bool {
    FORMAT_KEYS.contains(&key) || image_key(key).is_some()
}

/// `Seq_Frame0012_Timestamp` is field `Timestamp` of image 12; four digits are a minimum.
fn image_key(key: &str) -> Option<(u64, &str)> {
    let (number, field) = key.strip_prefix("Seq_Frame")?.split_once('_')?;
    let digits = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
    // More digits than a number can have lie beyond the last image, which is what is said of them then.
    (digits && !field.is_empty()).then(|| (number.parse().unwrap_or(u64::MAX), field))
}

/// One image from its fields.
pub(super) fn image(
    number: u64,
    entries: &[(&str, &Entry)],
    pixels: Option<Arc<[u8]>>,
    notes: &mut Vec<Note>,
) -> Result<SequenceImage, SequenceError> {
    let mut image = SequenceImage { number, pixels, ..SequenceImage::default() };
    let mut statuses = BTreeMap::new();
    let mut matrices = BTreeMap::new();
    for (field, entry) in entries {
        let transform = |ending| field.strip_suffix(ending).and_then(TransformName::parse);
        match *field {
            "ImageStatus" | "Status" => image.status = Status::parse(&entry.value),
            "Timestamp" => {
                let stamp = stamps::parse(&entry.value).ok_or_else(|| entry.bad("not a stamp in seconds"))?;
                image.stamp = Some(stamp);
            }
            _ => match (transform("TransformStatus"), transform("Transform")) {
                (Some(name), _) => drop(statuses.insert(name, Status::parse(&entry.value))),
                (_, Some(name)) => drop(matrices.insert(name, *entry)),
                _ => plain(&mut image, field, entry, notes),
            },
        }
    }
    image.transforms = tracked(matrices, &mut statuses)?;
    // What is said of a pose that is not there stays as it stood.
    let left = statuses.into_iter().map(|(name, status)| (format!("{name}TransformStatus"), status));
    image.fields.extend(left.map(|(field, status)| (field, status.word().unwrap_or_default().into())));
    Ok(image)
}

/// A field of no meaning to us, kept as it stood.
fn plain(image: &mut SequenceImage, field: &str, entry: &Entry, notes: &mut Vec<Note>) {
    let note = Note::AmbiguousName { field: field.into() };
    if field.ends_with("Transform") && !notes.contains(&note) {
        notes.push(note);
    }
    image.fields.insert(field.into(), entry.value.clone());
}

fn tracked(
    matrices: BTreeMap<TransformName, &Entry>,
    statuses: &mut BTreeMap<TransformName, Status>,
) -> Result<BTreeMap<TransformName, Tracked>, SequenceError> {
    let mut transforms = BTreeMap::new();
    for (name, entry) in matrices {
        let status = statuses.remove(&name).unwrap_or_default();
        let numbers = entry.numbers::<f64>()?;
        if numbers.len() != 16 {
            return Err(entry.bad(format!("16 numbers make a transform, {} came", numbers.len())));
        }
        // Trackers write NaN for a tool they do not see; such a pose is marked, and nobody asks for its numbers.
        if status.is_usable() && numbers.iter().any(|x| !x.is_finite()) {
            return Err(entry.bad("not finite, and not marked as invalid"));
        }
        let matrix_mm = Matrix4::from_row_iterator(numbers);
        transforms.insert(name, Tracked { matrix_mm, status });
    }
    Ok(transforms)
}

/// Notes the images of which the header says nothing.
pub(super) fn count_unsaid(count: u64, said: impl Iterator<Item = u64>, notes: &mut Vec<Note>) {
    let (mut next, mut seen) = (0, 0_u64);
    for number in said {
        next += u64::from(number == next);
        seen += 1;
    }
    if seen < count {
        notes.push(Note::NothingSaid { images: count - seen, first: next });
    }
}

/// Notes what is missing or jumps in the fields of all images.
pub(super) fn look_over(images: &[SequenceImage], pictures: bool, notes: &mut Vec<Note>) {
    let unsaid = images.iter().filter(|i| i.status == Status::Unsaid).count() as u64;
    if unsaid > 0 && pictures {
        notes.push(Note::ImageStatusUnsaid { images: unsaid });
    }
    let mut poses: BTreeMap<&TransformName, u64> = BTreeMap::new();
    for (name, tracked) in images.iter().flat_map(|i| &i.transforms) {
        *poses.entry(name).or_default() += u64::from(tracked.status == Status::Unsaid);
    }
    let unsaid = poses.into_iter().filter(|(_, images)| *images > 0);
    notes.extend(unsaid.map(|(name, images)| Note::PoseStatusUnsaid { name: name.to_string(), images }));
    notes.extend(jumps(images));
}

/// Jumps of the recorder's own count.
fn jumps(images: &[SequenceImage]) -> Option<Note> {
    let number = |i: &SequenceImage| i.fields.get("FrameNumber").and_then(|n| n.trim().parse::<u64>().ok());
    let (mut missing, mut first, mut last) = (0_u64, None, None);
    for image in images {
        let Some(here) = number(image) else { continue };
        let skipped = last.map_or(0, |last: u64| here.saturating_sub(last.saturating_add(1)));
        if skipped > 0 {
            missing = missing.saturating_add(skipped);
            first = first.or(Some(image.number));
        }
        last = Some(here);
    }
    first.map(|first| Note::FrameNumberJumps { missing, first })
}
