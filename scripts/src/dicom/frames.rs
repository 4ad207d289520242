//! US Multi-frame Image Storage: the B-scans of an exam, with regions that say how large a pixel is.

use std::path::Path;

use dicom_core::{PrimitiveValue, VR};
use dicom_dictionary_std::{tags, uids};
use probepath_us_capture::{BScan, PlacedBScan};

use super::study::{Series, Study};
use super::{DataSet, DicomError, decimal, instance};

/// Bytes that an explicit decimal string holds: its length is 16 bits, and even.
const MOST_TEXT: usize = 65_534;
/// Bytes that pixel data holds: its length is 32 bits, all ones meaning another thing.
const MOST_PIXELS: usize = 0xffff_fffe;

/// What was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    /// How many.
    pub count: usize,
    /// Columns and rows.
    pub size: (usize, usize),
    /// What the reader should know.
    pub notes: Vec<String>,
}

/// Writes the B-scans as one multi-frame image. `burned_in` is whether anything is written into the pictures, where it
/// is known.
///
/// # Errors
/// When there are none, they are of different sizes or settings, more than DICOM can hold, or the disk refuses.
pub fn multi_frame(
    images: &[PlacedBScan],
    study: &Study,
    burned_in: Option<bool>,
    path: &Path,
) -> Result<Frames, DicomError> {
    let first = &images.first().ok_or(DicomError::NoImages)?.bscan;
    images.iter().try_for_each(|image| alike(first, &image.bscan))?;
    let bytes = first.pixels().len() * images.len();
    if bytes > MOST_PIXELS {
        return Err(DicomError::TooLarge {
            what: "the pixels' number of bytes",
            found: bytes,
            most: MOST_PIXELS,
        });
    }
    let mut notes = Vec::new();
    let mut set = DataSet::new();
    study.put(&mut set, &Series { modality: "US", number: 1, description: "B-scans across the artery" });
    // Documents have no place for these two.
    set.text(tags::BODY_PART_EXAMINED, VR::CS, "LEG");
    if let Some(side) = study.laterality() {
        set.text(tags::LATERALITY, VR::CS, side);
    }
    instance(&mut set, uids::ULTRASOUND_MULTI_FRAME_IMAGE_STORAGE, &study.uid("us-multi-frame", &[]), 1);
    image(&mut set, first, burned_in, &mut notes);
    cine(&mut set, images, &mut notes);
    set.sequence(tags::SEQUENCE_OF_ULTRASOUND_REGIONS, vec![region(first)]);
    let mut pixels = Vec::with_capacity(bytes + 1);
    images.iter().for_each(|image| pixels.extend_from_slice(image.bscan.pixels()));
    if !pixels.len().is_multiple_of(2) {
        pixels.push(0);
    }
    set.value(tags::PIXEL_DATA, VR::OB, PrimitiveValue::from(pixels));
    set.save(path)?;
    Ok(Frames { count: images.len(), size: (first.width(), first.height()), notes })
}

/// Of one size and one setting: one region calibrates all frames.
fn alike(first: &BScan, other: &BScan) -> Result<(), DicomError> {
    let (a, b) = (first.setting.spacing, other.setting.spacing);
    let same = |x: f64, y: f64| (x - y).abs() <= 1e-6 * x.abs();
    let size = (first.width(), first.height()) == (other.width(), other.height());
    let top = (first.setting.window_top_m - other.setting.window_top_m).abs() < 1e-6;
    if size && top && same(a.x_m, b.x_m) && same(a.y_m, b.y_m) {
        return Ok(());
    }
    let (width, height) = (other.width(), other.height());
    Err(DicomError::Mixed { number: other.number, width, height, x_mm: b.x_m * 1e3, y_mm: b.y_m * 1e3 })
}

fn image(set: &mut DataSet, first: &BScan, burned_in: Option<bool>, notes: &mut Vec<String>) {
    // Original, primary, of vessels, 2D (PS3.3 C.8.5.6.1.1).
    set.text(tags::IMAGE_TYPE, VR::CS, "ORIGINAL\\PRIMARY\\VASCULAR\\0001");
    set.empty(tags::PATIENT_ORIENTATION, VR::CS);
    match burned_in {
        Some(burned) => set.text(tags::BURNED_IN_ANNOTATION, VR::CS, if burned { "YES" } else { "NO" }),
        None => notes.push(
            "whether anything is written into the pictures is not known: look for names before the file goes anywhere".into(),
        ),
    }
    set.text(tags::LOSSY_IMAGE_COMPRESSION, VR::CS, "00");
    set.value(tags::SAMPLES_PER_PIXEL, VR::US, 1_u16);
    set.text(tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2");
    set.value(tags::ROWS, VR::US, first.height() as u16);
    set.value(tags::COLUMNS, VR::US, first.width() as u16);
    for (tag, value) in [
        (tags::BITS_ALLOCATED, 8_u16),
        (tags::BITS_STORED, 8),
        (tags::HIGH_BIT, 7),
        (tags::PIXEL_REPRESENTATION, 0),
    ] {
        set.value(tag, VR::US, value);
    }
    let setting = &first.setting;
    set.text(tags::DEPTH_OF_SCAN_FIELD, VR::IS, &format!("{:.0}", setting.depth_m * 1e3));
    set.text(tags::TRANSDUCER_TYPE, VR::CS, "LINEAR");
}

/// When each frame was formed, as milliseconds after the one before.
fn cine(set: &mut DataSet, images: &[PlacedBScan], notes: &mut Vec<String>) {
    set.text(tags::NUMBER_OF_FRAMES, VR::IS, &images.len().to_string());
    let stamps = images.iter().map(|image| image.bscan.formed.nanoseconds() as f64 * 1e-6);
    let mut last = None;
    let after = stamps.map(|at| at - last.replace(at).unwrap_or(at));
    let after: Vec<f64> = after.collect();
    let vector = after.iter().map(|ms| decimal(*ms)).collect::<Vec<_>>().join("\\");
    if vector.len() <= MOST_TEXT {
        set.value(tags::FRAME_INCREMENT_POINTER, VR::AT, tags::FRAME_TIME_VECTOR);
        set.text(tags::FRAME_TIME_VECTOR, VR::DS, &vector);
        return;
    }
    let mean = after.iter().sum::<f64>() / (after.len().max(2) - 1) as f64;
    set.value(tags::FRAME_INCREMENT_POINTER, VR::AT, tags::FRAME_TIME);
    set.text(tags::FRAME_TIME, VR::DS, &decimal(mean));
    notes
        .push(format!("more frames than DICOM holds single times of: all are said to be {mean:.2} ms apart"));
}

/// The whole picture is one region of tissue, in centimetres (PS3.3 C.8.5.5).
fn region(first: &BScan) -> DataSet {
    let (setting, mut item) = (&first.setting, DataSet::new());
    let (width, height) = (first.width() as u32, first.height() as u32);
    const TWO_DIMENSIONAL: u16 = 1;
    const TISSUE: u16 = 1;
    const CENTIMETRES: u16 = 3;
    item.value(tags::REGION_SPATIAL_FORMAT, VR::US, TWO_DIMENSIONAL);
    item.value(tags::REGION_DATA_TYPE, VR::US, TISSUE);
    item.value(tags::REGION_FLAGS, VR::UL, 0_u32);
    item.value(tags::REGION_LOCATION_MIN_X0, VR::UL, 0_u32);
    item.value(tags::REGION_LOCATION_MIN_Y0, VR::UL, 0_u32);
    item.value(tags::REGION_LOCATION_MAX_X1, VR::UL, width.saturating_sub(1));
    item.value(tags::REGION_LOCATION_MAX_Y1, VR::UL, height.saturating_sub(1));
    item.value(tags::PHYSICAL_UNITS_X_DIRECTION, VR::US, CENTIMETRES);
    item.value(tags::PHYSICAL_UNITS_Y_DIRECTION, VR::US, CENTIMETRES);
    item.value(tags::PHYSICAL_DELTA_X, VR::FD, setting.spacing.x_m * 100.0);
    item.value(tags::PHYSICAL_DELTA_Y, VR::FD, setting.spacing.y_m * 100.0);
    // The middle of the first row lies under the middle of the probe's face, as deep as the window begins.
    item.value(tags::REFERENCE_PIXEL_X0, VR::SL, (width / 2) as i32);
    item.value(tags::REFERENCE_PIXEL_Y0, VR::SL, 0_i32);
    item.value(tags::REFERENCE_PIXEL_PHYSICAL_VALUE_X, VR::FD, 0.0_f64);
    item.value(tags::REFERENCE_PIXEL_PHYSICAL_VALUE_Y, VR::FD, setting.window_top_m * 100.0);
    item
}
