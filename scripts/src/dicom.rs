//! An exam as DICOM: the B-scans as an Ultrasound Multi-frame Image, the lumen as an Encapsulated STL, the measures as a
//! structured report (FIELD.md section 6).
//!
//! The nouns: a [`Study`] is what all files of one exam share; [`multi_frame`], [`encapsulated_stl`] and
//! [`structured_report`] are the three kinds of file, all Explicit VR Little Endian.
//!
//! # Who
//!
//! Nobody's name is in them: patient's name and id are the study code, birth date and sex are empty, Patient Identity
//! Removed is YES. Burned In Annotation is NO only where it is known (a simulated machine writes nothing into its
//! pictures); otherwise a person has to look, and the attribute is left out.
//!
//! # UIDs
//!
//! All are `2.25.` and a UUID as a decimal number (PS3.5 B.2), the UUID being version 8 with the first 122 bits of a
//! SHA-256. The study's is over the study code and over number, stamp and place of every B-scan and the pixels of the
//! first, the middle and the last; a series' adds the name of its kind, an instance's adds its content. So the same exam
//! always gives the same study, and a report that says something else is another instance.
//!
//! What it does not do: place the frames of the multi-frame image in space (its format has no place for that; the exam
//! file and `.igs.mha` have), or send anything anywhere.

mod codes;
mod content;
mod frames;
mod measures;
mod stl;
mod study;

use std::path::{Path, PathBuf};

use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};
use thiserror::Error;

pub use frames::{Frames, multi_frame};
pub use measures::{Finding, structured_report};
pub use stl::encapsulated_stl;
pub use study::{Date, Study};

/// Why a DICOM file could not be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DicomError {
    /// No pictures.
    #[error("there is no B-scan to write")]
    NoImages,
    /// Pictures that are no one series.
    #[error(
        "B-scan {number} is {width} x {height} pixels of {x_mm:.4} x {y_mm:.4} mm, the first is not: one multi-frame image holds \
         one setting; convert the settings one by one"
    )]
    Mixed {
        /// The first that differs.
        number: u64,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// Size of its pixels along a row (mm).
        x_mm: f64,
        /// And along a column (mm).
        y_mm: f64,
    },
    /// More than the format can hold.
    #[error("{what} is {found}, DICOM holds at most {most}")]
    TooLarge {
        /// What.
        what: &'static str,
        /// How much there is.
        found: usize,
        /// How much there can be.
        most: usize,
    },
    /// A structured report says when it was made.
    #[error("a structured report needs a date, and the exam has none")]
    NoDate,
    /// The file cannot be written.
    #[error("cannot write {}: {why}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the writer said.
        why: String,
    },
}

/// A data set under construction.
struct DataSet(InMemDicomObject);

impl DataSet {
    fn new() -> Self {
        Self(InMemDicomObject::new_empty())
    }

    fn text(&mut self, tag: Tag, vr: VR, value: &str) {
        self.0.put(DataElement::new(tag, vr, PrimitiveValue::from(value)));
    }

    fn value(&mut self, tag: Tag, vr: VR, value: impl Into<PrimitiveValue>) {
        self.0.put(DataElement::new(tag, vr, value.into()));
    }

    /// An attribute that has to be there and may be empty (type 2).
    fn empty(&mut self, tag: Tag, vr: VR) {
        self.value(tag, vr, PrimitiveValue::Empty);
    }

    fn sequence(&mut self, tag: Tag, items: Vec<DataSet>) {
        let items: Vec<InMemDicomObject> = items.into_iter().map(|item| item.0).collect();
        self.0.put(DataElement::new(tag, VR::SQ, DataSetSequence::from(items)));
    }

    /// Writes it as a file of its own.
    fn save(self, path: &Path) -> Result<(), DicomError> {
        let failed = |why: String| DicomError::File { path: path.into(), why };
        let meta = FileMetaTableBuilder::new()
            .transfer_syntax(uids::EXPLICIT_VR_LITTLE_ENDIAN)
            .implementation_class_uid(study::uid(&[b"implementation", env!("CARGO_PKG_VERSION").as_bytes()]))
            .implementation_version_name(concat!("PROBEPATH_", env!("CARGO_PKG_VERSION")));
        let file = self.0.with_meta(meta).map_err(|error| failed(told(&error)))?;
        file.write_to_file(path).map_err(|error| failed(told(&error)))
    }
}

/// An error with its causes.
fn told(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(deeper) = cause {
        text = format!("{text}: {deeper}");
        cause = deeper.source();
    }
    text
}

/// A number as DICOM's decimal string: at most 16 characters, to four decimals where they fit.
fn decimal(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    let short = if text.len() <= 16 { text.to_owned() } else { format!("{value:.8e}") };
    if short == "-0" { "0".into() } else { short }
}

/// Fills what both image and document say of themselves.
fn instance(set: &mut DataSet, class: &str, uid: &str, number: u32) {
    set.text(tags::SPECIFIC_CHARACTER_SET, VR::CS, "ISO_IR 192");
    set.text(tags::SOP_CLASS_UID, VR::UI, class);
    set.text(tags::SOP_INSTANCE_UID, VR::UI, uid);
    set.text(tags::INSTANCE_NUMBER, VR::IS, &number.to_string());
}

#[cfg(test)]
mod tests;
