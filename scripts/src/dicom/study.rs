//! What all files of one exam share: its codes, its date, its UIDs.

use std::path::Path;

use dicom_core::VR;
use dicom_dictionary_std::tags;
use probepath_us_capture::PlacedBScan;
use sha2::{Digest, Sha256};

use super::DataSet;

/// A day, and the time of day where it is known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Date {
    /// `YYYYMMDD`.
    day: String,
    /// `HHMMSS`.
    time: String,
}

impl Date {
    /// Of an ISO 8601 day (`2026-11-23`); none of anything else.
    pub fn of_day(iso: &str) -> Option<Self> {
        let day = jiff::civil::Date::strptime("%Y-%m-%d", iso).ok()?;
        Some(Self { day: day.strftime("%Y%m%d").to_string(), time: "000000".into() })
    }

    /// When a file was last written (UTC).
    pub fn of_file(path: &Path) -> Option<Self> {
        let written = std::fs::metadata(path).and_then(|file| file.modified()).ok()?;
        let stamp = jiff::Timestamp::try_from(written).ok()?;
        let part = |format: &str| stamp.strftime(format).to_string();
        Some(Self { day: part("%Y%m%d"), time: part("%H%M%S") })
    }
}

/// What all files of one exam share.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// The study code; never a name.
    pub code: String,
    /// `left` or `right`; empty where it is not known.
    pub side: String,
    /// When the exam was.
    pub date: Option<Date>,
    /// Of the exam's content.
    identity: [u8; 32],
}

/// One of the study's series.
pub(super) struct Series {
    pub(super) modality: &'static str,
    pub(super) number: u32,
    pub(super) description: &'static str,
}

impl Study {
    /// The study of these B-scans.
    pub fn of(code: &str, side: &str, date: Option<Date>, images: &[PlacedBScan]) -> Self {
        Self { code: code.into(), side: side.into(), date, identity: identity(code, images) }
    }

    /// A UID of this study: of its kind and content.
    pub(super) fn uid(&self, kind: &str, content: &[u8]) -> String {
        uid(&[kind.as_bytes(), &self.identity, content])
    }

    /// The World's: what all surfaces and places of the study are in.
    pub(super) fn frame_of_reference(&self) -> String {
        self.uid("world", &[])
    }

    /// Patient, study, series and equipment.
    pub(super) fn put(&self, set: &mut DataSet, series: &Series) {
        self.patient(set);
        let (day, time) = self.date.as_ref().map_or(("", ""), |date| (date.day.as_str(), date.time.as_str()));
        set.text(tags::STUDY_INSTANCE_UID, VR::UI, &self.uid("study", &[]));
        set.text(tags::STUDY_DATE, VR::DA, day);
        set.text(tags::STUDY_TIME, VR::TM, time);
        set.text(tags::CONTENT_DATE, VR::DA, day);
        set.text(tags::CONTENT_TIME, VR::TM, time);
        set.empty(tags::REFERRING_PHYSICIAN_NAME, VR::PN);
        set.empty(tags::ACCESSION_NUMBER, VR::SH);
        // A short string holds 16 characters; the whole code is the patient's id.
        set.text(tags::STUDY_ID, VR::SH, self.code.get(..16).unwrap_or(&self.code));
        set.text(tags::STUDY_DESCRIPTION, VR::LO, "Robotic ultrasound of a leg artery");
        set.text(tags::MODALITY, VR::CS, series.modality);
        set.text(tags::SERIES_INSTANCE_UID, VR::UI, &self.uid("series", series.modality.as_bytes()));
        set.text(tags::SERIES_NUMBER, VR::IS, &series.number.to_string());
        set.text(tags::SERIES_DESCRIPTION, VR::LO, series.description);
        set.text(tags::MANUFACTURER, VR::LO, "probepath");
        set.text(tags::MANUFACTURER_MODEL_NAME, VR::LO, "probepath");
        set.text(tags::DEVICE_SERIAL_NUMBER, VR::LO, "none");
        set.text(tags::SOFTWARE_VERSIONS, VR::LO, env!("CARGO_PKG_VERSION"));
    }

    fn patient(&self, set: &mut DataSet) {
        set.text(tags::PATIENT_NAME, VR::PN, &self.code);
        set.text(tags::PATIENT_ID, VR::LO, &self.code);
        set.empty(tags::PATIENT_BIRTH_DATE, VR::DA);
        set.empty(tags::PATIENT_SEX, VR::CS);
        set.text(tags::PATIENT_IDENTITY_REMOVED, VR::CS, "YES");
        set.text(
            tags::DEIDENTIFICATION_METHOD,
            VR::LO,
            "recorded under a study code; no name was ever entered",
        );
    }

    /// `L` or `R`.
    pub(super) fn laterality(&self) -> Option<&'static str> {
        match self.side.to_lowercase().as_str() {
            "left" => Some("L"),
            "right" => Some("R"),
            _ => None,
        }
    }
}

/// A hash of what makes an exam this one.
fn identity(code: &str, images: &[PlacedBScan]) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(code.as_bytes());
    for image in images {
        let place = image.world_from_image.isometry();
        hash.update(image.bscan.number.to_le_bytes());
        hash.update(image.bscan.formed.nanoseconds().to_le_bytes());
        place.translation.vector.iter().for_each(|x| hash.update(x.to_le_bytes()));
        place.rotation.coords.iter().for_each(|x| hash.update(x.to_le_bytes()));
    }
    for image in [images.first(), images.get(images.len() / 2), images.last()].into_iter().flatten() {
        hash.update(image.bscan.pixels());
    }
    hash.finalize().into()
}

/// `2.25.` and a UUID (version 8, RFC 9562) of the parts, each with its length before it.
pub(super) fn uid(parts: &[&[u8]]) -> String {
    let mut hash = Sha256::new();
    hash.update(b"probepath");
    for part in parts {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    let digest: [u8; 32] = hash.finalize().into();
    let bits = digest.iter().take(16).fold(0_u128, |bits, byte| bits << 8 | u128::from(*byte));
    let version = bits & !(0xf << 76) | 0x8 << 76;
    format!("2.25.{}", version & !(0x3 << 62) | 0x2 << 62)
}
