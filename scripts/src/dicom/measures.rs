//! Comprehensive 3D SR: the measures of the stenoses, each as a number with its unit and its 95 % interval.
//!
//! The tree follows TID 1500 (Measurement Report) with a Measurement Group (TID 1501) for every stenosis: finding,
//! site with its side, place in the World (mm, LPS), percent area and percent diameter, minimal area and diameter,
//! length, distance from the scan's proximal end, the reference's area, the contact force.

use std::path::Path;

use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};

use super::codes::{self, Code};
use super::content::{
    CONTAINS, CONTEXT, MODIFIES, PROPERTIES, code, container, fill, number, place, text, uid,
};
use super::study::{Series, Study};
use super::{DataSet, DicomError, instance};
use crate::report::StenosisRow;

/// What has to stand on every report (FIELD.md section 6).
const LIMITS: &str = "B-mode lumen geometry, not a Doppler grade. A research tool, not a medical device.";

/// A stenosis, and where it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Its measures.
    pub stenosis: StenosisRow,
    /// The narrowest place of the centreline (mm, LPS).
    pub place_mm: Option<[f64; 3]>,
}

/// Writes the report of the findings, and of what the reader should know.
///
/// # Errors
/// When the study has no date, which a structured report must have, or the disk refuses.
pub fn structured_report(
    findings: &[Finding],
    warnings: &[String],
    study: &Study,
    path: &Path,
) -> Result<(), DicomError> {
    if study.date.is_none() {
        return Err(DicomError::NoDate);
    }
    let mut set = DataSet::new();
    study.put(&mut set, &Series { modality: "SR", number: 3, description: "Stenoses" });
    let content = format!("{findings:?}{warnings:?}");
    instance(&mut set, uids::COMPREHENSIVE3_DSR_STORAGE, &study.uid("sr", content.as_bytes()), 1);
    set.text(tags::COMPLETION_FLAG, VR::CS, "COMPLETE");
    set.text(tags::VERIFICATION_FLAG, VR::CS, "UNVERIFIED");
    set.sequence(tags::REFERENCED_PERFORMED_PROCEDURE_STEP_SEQUENCE, Vec::new());
    set.sequence(tags::PERFORMED_PROCEDURE_CODE_SEQUENCE, Vec::new());
    set.text(tags::VALUE_TYPE, VR::CS, "CONTAINER");
    set.sequence(tags::CONCEPT_NAME_CODE_SEQUENCE, vec![codes::MEASUREMENT_REPORT.item()]);
    let groups = findings.iter().map(|finding| group(finding, study)).collect();
    let device = study.uid("device", &[]);
    let mut inside = vec![
        code(MODIFIES, codes::LANGUAGE, codes::ENGLISH, Vec::new()),
        code(CONTEXT, codes::OBSERVER_TYPE, codes::DEVICE, Vec::new()),
        uid(CONTEXT, codes::DEVICE_UID, &device),
        text(CONTEXT, codes::DEVICE_NAME, "probepath"),
        code(MODIFIES, codes::PROCEDURE, codes::IMAGING_PROCEDURE, Vec::new()),
        container(CONTAINS, codes::MEASUREMENTS, None, groups),
    ];
    let comments = std::iter::once(LIMITS).chain(warnings.iter().map(String::as_str));
    inside.extend(comments.map(|comment| text(CONTAINS, codes::COMMENT, comment)));
    fill(&mut set, Some("1500"), inside);
    set.save(path)
}

fn group(finding: &Finding, study: &Study) -> DataSet {
    let row = &finding.stenosis;
    let mut inside = vec![
        text(CONTEXT, codes::TRACKING, &row.name),
        uid(CONTEXT, codes::TRACKING_UID, &study.uid("stenosis", row.name.as_bytes())),
        code(CONTAINS, codes::FINDING, codes::STENOSIS, Vec::new()),
    ];
    inside.extend(site(row, study));
    inside.extend(finding.place_mm.map(|at| place(CONTAINS, codes::REGION, at, &study.frame_of_reference())));
    inside.extend(numbers(row));
    inside.extend(row.force_n.map(|force| one(codes::MEAN_FORCE, force, codes::NEWTON)));
    let graded = format!("{}: {} by diameter; against the {}", row.segment, row.grade, row.reference);
    inside.push(text(CONTAINS, codes::COMMENT, &graded));
    container(CONTAINS, codes::GROUP, Some("1501"), inside)
}

/// The artery and its side, where the segment's name says which.
fn site(row: &StenosisRow, study: &Study) -> Option<DataSet> {
    let side = study.laterality().map(|side| if side == "L" { codes::LEFT } else { codes::RIGHT });
    let side = side.map(|side| code(MODIFIES, codes::LATERALITY, side, Vec::new()));
    Some(code(CONTAINS, codes::SITE, codes::artery(&row.segment)?, side.into_iter().collect()))
}

fn numbers(row: &StenosisRow) -> Vec<DataSet> {
    let (percent, mm, mm2) = (codes::PERCENT, codes::MILLIMETRE, codes::SQUARE_MILLIMETRE);
    let least = |interval, unit| {
        let mut inside = vec![code(MODIFIES, codes::DERIVATION, codes::MINIMUM, Vec::new())];
        inside.extend(bounds(interval, unit));
        inside
    };
    let whole = |name, value, interval, unit| number(CONTAINS, name, value, unit, bounds(interval, unit));
    let (area, diameter) = (least(row.min_area_interval_mm2, mm2), least(row.min_diameter_interval_mm, mm));
    vec![
        whole(codes::AREA_STENOSIS, row.percent_area, row.percent_area_interval, percent),
        whole(codes::DIAMETER_STENOSIS, row.percent_diameter, row.percent_diameter_interval, percent),
        number(CONTAINS, codes::AREA, row.min_area_mm2, mm2, area),
        number(CONTAINS, codes::DIAMETER, row.min_diameter_mm, mm, diameter),
        whole(codes::LENGTH, row.length_mm, row.length_interval_mm, mm),
        whole(codes::FROM_START, row.at_mm, row.at_interval_mm, mm),
        one(codes::REFERENCE_AREA, row.reference_area_mm2, mm2),
    ]
}

fn one(name: Code, value: f64, unit: Code) -> DataSet {
    number(CONTAINS, name, value, unit, Vec::new())
}

/// Both ends of an interval, as properties of the number.
fn bounds([low, high]: [f64; 2], unit: Code) -> Vec<DataSet> {
    vec![
        number(PROPERTIES, codes::LOW, low, unit, Vec::new()),
        number(PROPERTIES, codes::HIGH, high, unit, Vec::new()),
    ]
}
