//! Encapsulated STL Storage: the lumen's surface in a study, millimetres, LPS.

use std::path::Path;

use dicom_core::{PrimitiveValue, VR};
use dicom_dictionary_std::{tags, uids};
use probepath_recon::Mesh;

use super::codes::MILLIMETRE;
use super::study::{Series, Study};
use super::{DataSet, DicomError, instance};

/// Writes a surface as an encapsulated STL; gives the STL that is inside.
///
/// # Errors
/// When it is larger than DICOM can hold, or the disk refuses.
pub fn encapsulated_stl(mesh: &Mesh, study: &Study, path: &Path) -> Result<(), DicomError> {
    let mut stl = mesh.stl_bytes();
    let length = stl.len();
    let most = 0xffff_fffe;
    if length > most {
        return Err(DicomError::TooLarge { what: "the surface's number of bytes", found: length, most });
    }
    let mut set = DataSet::new();
    study.put(&mut set, &Series { modality: "M3D", number: 2, description: "Lumen surface" });
    instance(&mut set, uids::ENCAPSULATED_STL_STORAGE, &study.uid("stl", &stl), 1);
    set.text(tags::FRAME_OF_REFERENCE_UID, VR::UI, &study.frame_of_reference());
    set.empty(tags::POSITION_REFERENCE_INDICATOR, VR::LO);
    set.empty(tags::ACQUISITION_DATE_TIME, VR::DT);
    set.text(tags::BURNED_IN_ANNOTATION, VR::CS, "NO");
    set.text(tags::DOCUMENT_TITLE, VR::ST, "Lumen of a leg artery, from B-mode images");
    set.sequence(tags::CONCEPT_NAME_CODE_SEQUENCE, Vec::new());
    set.sequence(tags::MEASUREMENT_UNITS_CODE_SEQUENCE, vec![MILLIMETRE.item()]);
    set.text(tags::MIME_TYPE_OF_ENCAPSULATED_DOCUMENT, VR::LO, "model/stl");
    // Even, as every value is; the length without what fills it up.
    if !stl.len().is_multiple_of(2) {
        stl.push(0);
    }
    set.value(tags::ENCAPSULATED_DOCUMENT, VR::OB, PrimitiveValue::from(stl));
    set.value(tags::ENCAPSULATED_DOCUMENT_LENGTH, VR::UL, length as u32);
    set.save(path)
}
