//! The text headers of written sequences.

use std::fmt::Write;

use crate::sequence::image::{SequenceImage, Status, Tracked, TransformName};
use crate::sequence::{Sequence, SequenceError, nrrd as nrrd_text, stamps};

/// PLUS reads header lines of at most 1000 characters.
const LONGEST_LINE: usize = 1000;

pub(super) fn metaimage(
    sequence: &Sequence,
    packed: usize,
    data_file: &str,
) -> Result<String, SequenceError> {
    let pictures = sequence.has_pictures();
    let (width, height) = if pictures { (sequence.width(), sequence.height()) } else { (0, 0) };
    let (pixel, orientation, kind) =
        if pictures { ("MET_UCHAR", "MFA", "BRIGHTNESS") } else { ("MET_OTHER", "XX", "XX") };
    let compressed = if pictures { format!("True\nCompressedDataSize = {packed}") } else { "False".into() };
    let mut text = format!(
        "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = RAI\nBinaryData = True\n\
         BinaryDataByteOrderMSB = False\nCenterOfRotation = 0 0 0\nCompressedData = {compressed}\n\
         DimSize = {width} {height} {count}\nKinds = domain domain list\nElementNumberOfChannels = 1\n\
         ElementSpacing = 1 1 1\nElementType = {pixel}\nOffset = 0 0 0\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n\
         UltrasoundImageOrientation = {orientation}\nUltrasoundImageType = {kind}\n",
        count = count(sequence),
    );
    lines(sequence, &mut text, " = ", "ImageStatus", |v| v.into())?;
    let _infallible = writeln!(text, "ElementDataFile = {data_file}");
    Ok(text)
}

pub(super) fn nrrd(sequence: &Sequence) -> Result<String, SequenceError> {
    let pictures = sequence.has_pictures();
    let (width, height) = if pictures { (sequence.width(), sequence.height()) } else { (1, 1) };
    let (orientation, kind) = if pictures { ("MFA", "BRIGHTNESS") } else { ("XX", "XX") };
    let mut text = format!(
        "NRRD0004\n# Complete NRRD file format specification at:\n# http://teem.sourceforge.net/nrrd/format.html\n\
         type: uint8\ndimension: 3\nsizes: {width} {height} {count}\nkinds: domain domain list\nencoding: gz\n\
         endian: little\nspace dimension: 2\nspace directions: (1,0) (0,1) none\nspace origin: (0,0)\n\
         ultrasound image orientation:={orientation}\nultrasound image type:={kind}\n",
        count = count(sequence),
    );
    lines(sequence, &mut text, ":=", "Status", nrrd_text::escaped)?;
    text.push('\n');
    Ok(text)
}

/// Images up to the last number: a gap in the numbering stays one.
fn count(sequence: &Sequence) -> u64 {
    if sequence.has_pictures() {
        return sequence.images().len() as u64;
    }
    sequence.images().iter().map(|i| i.number + 1).max().unwrap_or(0)
}

/// Fields of the file, then of its images.
fn lines(
    sequence: &Sequence,
    text: &mut String,
    equals: &str,
    status: &str,
    escaped: impl Fn(&str) -> String,
) -> Result<(), SequenceError> {
    for (key, value) in sequence.fields() {
        line(text, 0, ("", key), equals, &escaped(value))?;
    }
    for (index, image) in (0..).zip(sequence.images()) {
        // Pictures are numbered by their block; poses keep their number.
        let number = if sequence.has_pictures() { index } else { image.number };
        let prefix = format!("Seq_Frame{number:04}_");
        for (field, value) in values(image, status)? {
            line(text, number, (&prefix, &field), equals, &escaped(&value))?;
        }
    }
    Ok(())
}

/// One image's fields as text.
fn values(image: &SequenceImage, status: &str) -> Result<Vec<(String, String)>, SequenceError> {
    let mut values = Vec::new();
    for (name, tracked) in &image.transforms {
        check_name(image.number, name)?;
        values.push((format!("{name}Transform"), matrix(tracked)));
        values.extend(tracked.status.word().map(|word| (format!("{name}TransformStatus"), word.into())));
    }
    values.extend(image.stamp.map(|stamp| ("Timestamp".into(), stamps::text(stamp))));
    values.extend(image.fields.iter().map(|(key, value)| (key.clone(), value.clone())));
    values.extend(image.status.word().map(|word| (status.into(), word.into())));
    Ok(values)
}

fn matrix(tracked: &Tracked) -> String {
    let rows = tracked.matrix_mm.transpose();
    // A pose nobody may use can hold NaN; PLUS does not read that word, so it becomes zero as a lost pose does.
    let lost = tracked.status != Status::Ok && rows.iter().any(|x| !x.is_finite());
    let words: Vec<String> = rows.iter().map(|x| if lost { "0".into() } else { x.to_string() }).collect();
    words.join(" ")
}

fn check_name(number: u64, name: &TransformName) -> Result<(), SequenceError> {
    let text = name.to_string();
    if TransformName::parse(&text).as_ref() == Some(name) {
        return Ok(());
    }
    let why = "names of systems begin with a capital and hold no \"To\" before another";
    Err(SequenceError::Unwritable { number, field: text, why })
}

fn line(
    text: &mut String,
    number: u64,
    (prefix, key): (&str, &str),
    equals: &str,
    value: &str,
) -> Result<(), SequenceError> {
    let refused = |why| Err(SequenceError::Unwritable { number, field: key.into(), why });
    let plain = |c: char| c.is_ascii_alphanumeric() || " _-.".contains(c);
    if key.is_empty() || key.trim() != key || !key.chars().all(plain) {
        return refused("a key is made of letters, digits, blanks, and _ - .");
    }
    if value.contains(['\n', '\r']) || value.trim() != value {
        return refused("a value is one line without blanks around it");
    }
    if prefix.len() + key.len() + equals.len() + value.len() > LONGEST_LINE {
        return refused("longer than the 1000 characters a line that PLUS reads");
    }
    let _infallible = writeln!(text, "{prefix}{key}{equals}{value}");
    Ok(())
}
