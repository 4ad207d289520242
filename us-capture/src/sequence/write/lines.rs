//! The text headers of written sequences.

use std::fmt::Write;

use crate::sequence::assemble::fields;
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
        count = sequence.count(),
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
        count = sequence.count(),
    );
    lines(sequence, &mut text, ":=", "Status", nrrd_text::escaped)?;
    text.push('\n');
    Ok(text)
}

/// Fields of the file, then of its images.
fn lines(
    sequence: &Sequence,
    text: &mut String,
    equals: &str,
    status: &str,
    escaped: impl Fn(&str) -> String,
) -> Result<(), SequenceError> {
    sequence.check_size()?;
    check_numbers(sequence)?;
    for (key, value) in sequence.fields() {
        let refused = |why| SequenceError::UnwritableField { field: key.clone(), why };
        check_file_field(sequence, key, value).map_err(refused)?;
        line(text, ("", key), equals, value, &escaped).map_err(refused)?;
    }
    for (index, image) in (0..).zip(sequence.images()) {
        // Pictures are numbered by their block; poses keep their number.
        let number = if sequence.has_pictures() { index } else { image.number };
        let prefix = format!("Seq_Frame{number:04}_");
        let black = sequence.has_pictures() && image.pixels.is_none();
        for (field, value) in values(image, black, status)? {
            line(text, (&prefix, &field), equals, &value, &escaped)
                .map_err(|why| SequenceError::Unwritable { number, field, why })?;
        }
    }
    Ok(())
}

/// Poses are told apart by their numbers alone.
fn check_numbers(sequence: &Sequence) -> Result<(), SequenceError> {
    let pairs = sequence.images().iter().zip(sequence.images().iter().skip(1));
    let twice = pairs.filter(|(a, b)| a.number >= b.number).map(|(_, b)| b.number).next();
    let last = sequence.images().last().filter(|i| i.number == u64::MAX).map(|i| i.number);
    match twice.or(last) {
        Some(number) if !sequence.has_pictures() => {
            let why = "the numbers of poses without images have to rise, and to be countable";
            Err(SequenceError::Unwritable { number, field: "number".into(), why })
        }
        _ => Ok(()),
    }
}

fn check_file_field(sequence: &Sequence, key: &str, value: &str) -> Result<(), &'static str> {
    if fields::is_taken(key) {
        return Err("a key of the format itself, or of an image");
    }
    if sequence.fields().iter().any(|(other, said)| other == key && said != value) {
        return Err("it is there twice, with two values");
    }
    Ok(())
}

/// One image's fields as text.
fn values(image: &SequenceImage, black: bool, key: &str) -> Result<Vec<(String, String)>, SequenceError> {
    let refused =
        |field: &str, why| SequenceError::Unwritable { number: image.number, field: field.into(), why };
    let mut values = Vec::new();
    for (name, tracked) in &image.transforms {
        let field = format!("{name}Transform");
        check_transform(name, tracked).map_err(|why| refused(&field, why))?;
        let status = word(&tracked.status).map_err(|why| refused(&field, why))?;
        values.push((field, matrix(tracked)));
        values.extend(status.map(|word| (format!("{name}TransformStatus"), word.into())));
    }
    values.extend(image.stamp.map(|stamp| ("Timestamp".into(), stamps::text(stamp))));
    for (field, value) in &image.fields {
        if means_something(image, field) {
            return Err(refused(field, "it would be read back as a stamp, a status or a transform"));
        }
        values.push((field.clone(), value.clone()));
    }
    // Where there is no picture its block is black; nobody may take that for a picture.
    let status = if black && image.status.is_usable() { &Status::Invalid } else { &image.status };
    let status = word(status).map_err(|why| refused(key, why))?;
    values.extend(status.map(|word| (key.into(), word.into())));
    Ok(values)
}

/// The word of a status, when it is read back as that status.
fn word(status: &Status) -> Result<Option<&str>, &'static str> {
    let word = status.word();
    if Status::parse(word.unwrap_or_default()) == *status {
        return Ok(word);
    }
    Err("a status of one's own is one word that is not OK and not INVALID")
}

/// Whether the reader would take the field for more than text.
fn means_something(image: &SequenceImage, field: &str) -> bool {
    let transform = |ending| field.strip_suffix(ending).and_then(TransformName::parse);
    matches!(field, "ImageStatus" | "Status" | "Timestamp")
        || transform("Transform").is_some()
        || transform("TransformStatus").is_some_and(|name| image.transforms.contains_key(&name))
}

fn matrix(tracked: &Tracked) -> String {
    let rows = tracked.matrix_mm.transpose();
    // A pose nobody may use can hold NaN; PLUS does not read that word, so it becomes zero as a lost pose does.
    let lost = rows.iter().any(|x| !x.is_finite());
    let words: Vec<String> = rows.iter().map(|x| if lost { "0".into() } else { shortest(*x) }).collect();
    words.join(" ")
}

/// All digits of a number: 1e-60 written out would make a line longer than PLUS reads.
fn shortest(number: f64) -> String {
    let (plain, exponent) = (number.to_string(), format!("{number:e}"));
    if exponent.len() < plain.len() { exponent } else { plain }
}

fn check_transform(name: &TransformName, tracked: &Tracked) -> Result<(), &'static str> {
    if TransformName::parse(&name.to_string()).as_ref() != Some(name) {
        return Err("names of systems begin with a capital and hold no \"To\" before another");
    }
    if tracked.status.is_usable() && tracked.matrix_mm.iter().any(|x| !x.is_finite()) {
        return Err("a number is not finite, and the pose is not marked as invalid");
    }
    Ok(())
}

fn line(
    text: &mut String,
    (prefix, key): (&str, &str),
    equals: &str,
    value: &str,
    escaped: impl Fn(&str) -> String,
) -> Result<(), &'static str> {
    let plain = |c: char| c.is_ascii_alphanumeric() || " _-.".contains(c);
    if key.is_empty() || key.trim() != key || !key.chars().all(plain) {
        return Err("a key is made of letters, digits, blanks, and _ - .");
    }
    if value.contains(|c: char| c.is_control() && c != '\t') || value.trim() != value {
        return Err("a value is one line without blanks around it and without control characters");
    }
    let line = format!("{prefix}{key}{equals}{}", escaped(value));
    if line.len() > LONGEST_LINE {
        return Err("longer than the 1000 characters a line that PLUS reads");
    }
    text.push_str(&line);
    text.push('\n');
    Ok(())
}
