//! The codes that say what a number is. SCT, DCM, LN and UCUM are the public ones; 99PROBEPATH are our own, for what has
//! no public code that we could vouch for.

use dicom_core::VR;
use dicom_dictionary_std::tags;

use super::DataSet;

/// A code, whose it is, and what it means.
#[derive(Clone, Copy, Debug)]
pub(super) struct Code(pub(super) &'static str, pub(super) &'static str, pub(super) &'static str);

impl Code {
    /// As the item of a code sequence.
    pub(super) fn item(self) -> DataSet {
        let mut item = DataSet::new();
        item.text(tags::CODE_VALUE, VR::SH, self.0);
        item.text(tags::CODING_SCHEME_DESIGNATOR, VR::SH, self.1);
        item.text(tags::CODE_MEANING, VR::LO, self.2);
        item
    }
}

// Units.
pub(super) const MILLIMETRE: Code = Code("mm", "UCUM", "mm");
pub(super) const SQUARE_MILLIMETRE: Code = Code("mm2", "UCUM", "mm2");
pub(super) const PERCENT: Code = Code("%", "UCUM", "%");
pub(super) const NEWTON: Code = Code("N", "UCUM", "N");

// The document.
pub(super) const MEASUREMENT_REPORT: Code = Code("126000", "DCM", "Imaging Measurement Report");
pub(super) const LANGUAGE: Code = Code("121049", "DCM", "Language of Content Item and Descendants");
pub(super) const ENGLISH: Code = Code("en", "RFC5646", "English");
pub(super) const OBSERVER_TYPE: Code = Code("121005", "DCM", "Observer Type");
pub(super) const DEVICE: Code = Code("121007", "DCM", "Device");
pub(super) const DEVICE_UID: Code = Code("121012", "DCM", "Device Observer UID");
pub(super) const DEVICE_NAME: Code = Code("121013", "DCM", "Device Observer Name");
pub(super) const PROCEDURE: Code = Code("121058", "DCM", "Procedure reported");
pub(super) const IMAGING_PROCEDURE: Code = Code("363679005", "SCT", "Imaging procedure");
pub(super) const MEASUREMENTS: Code = Code("126010", "DCM", "Imaging Measurements");
pub(super) const GROUP: Code = Code("125007", "DCM", "Measurement Group");
pub(super) const TRACKING: Code = Code("112039", "DCM", "Tracking Identifier");
pub(super) const TRACKING_UID: Code = Code("112040", "DCM", "Tracking Unique Identifier");
pub(super) const COMMENT: Code = Code("121106", "DCM", "Comment");
pub(super) const REGION: Code = Code("111030", "DCM", "Image Region");

// What was found, and where (FIELD.md section 6).
pub(super) const FINDING: Code = Code("121071", "DCM", "Finding");
pub(super) const STENOSIS: Code = Code("415582006", "SCT", "Stenosis");
pub(super) const SITE: Code = Code("363698007", "SCT", "Finding Site");
pub(super) const LATERALITY: Code = Code("272741003", "SCT", "Laterality");
pub(super) const LEFT: Code = Code("7771000", "SCT", "Left");
pub(super) const RIGHT: Code = Code("24028007", "SCT", "Right");
const COMMON_FEMORAL: Code = Code("181347005", "SCT", "Common femoral artery");
const SUPERFICIAL_FEMORAL: Code = Code("181349008", "SCT", "Superficial femoral artery");
const PROFUNDA: Code = Code("31677005", "SCT", "Profunda femoris artery");
const POPLITEAL: Code = Code("43899006", "SCT", "Popliteal artery");

// What was measured.
pub(super) const AREA_STENOSIS: Code = Code("408714007", "SCT", "Vessel lumen cross-sectional area stenosis");
pub(super) const DIAMETER_STENOSIS: Code = Code("408715008", "SCT", "Vessel lumen diameter stenosis");
pub(super) const AREA: Code = Code("42798000", "SCT", "Area");
pub(super) const DIAMETER: Code = Code("81827009", "SCT", "Diameter");
pub(super) const LENGTH: Code = Code("410668003", "SCT", "Length");
pub(super) const DERIVATION: Code = Code("121401", "DCM", "Derivation");
pub(super) const MINIMUM: Code = Code("255605001", "SCT", "Minimum");
const OURS: &str = "99PROBEPATH";
pub(super) const FROM_START: Code =
    Code("AT", OURS, "Distance along the centreline from the scan's proximal end");
pub(super) const REFERENCE_AREA: Code = Code("REFAREA", OURS, "Lumen area of the reference segment");
pub(super) const MEAN_FORCE: Code = Code("FORCE", OURS, "Contact force of the probe while scanning");
pub(super) const LOW: Code = Code("CI95LOW", OURS, "Lower bound of the 95 % interval");
pub(super) const HIGH: Code = Code("CI95HIGH", OURS, "Upper bound of the 95 % interval");

/// The artery that a segment's name speaks of.
pub(super) fn artery(segment: &str) -> Option<Code> {
    let name = segment.to_uppercase();
    let known =
        [("CFA", COMMON_FEMORAL), ("SFA", SUPERFICIAL_FEMORAL), ("DFA", PROFUNDA), ("POP", POPLITEAL)];
    known.into_iter().find(|(short, _)| name.starts_with(short)).map(|(_, code)| code)
}
