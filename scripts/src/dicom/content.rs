//! The content items of a structured report.

use dicom_core::{PrimitiveValue, VR};
use dicom_dictionary_std::tags;

use super::codes::Code;
use super::{DataSet, decimal};

/// How an item belongs to the one it stands in.
pub(super) const CONTAINS: &str = "CONTAINS";
pub(super) const CONTEXT: &str = "HAS OBS CONTEXT";
pub(super) const MODIFIES: &str = "HAS CONCEPT MOD";
pub(super) const PROPERTIES: &str = "HAS PROPERTIES";

fn item(relation: &str, kind: &str, name: Code) -> DataSet {
    let mut item = DataSet::new();
    item.text(tags::RELATIONSHIP_TYPE, VR::CS, relation);
    item.text(tags::VALUE_TYPE, VR::CS, kind);
    item.sequence(tags::CONCEPT_NAME_CODE_SEQUENCE, vec![name.item()]);
    item
}

pub(super) fn text(relation: &str, name: Code, text: &str) -> DataSet {
    let mut item = item(relation, "TEXT", name);
    item.text(tags::TEXT_VALUE, VR::UT, text);
    item
}

pub(super) fn uid(relation: &str, name: Code, uid: &str) -> DataSet {
    let mut item = item(relation, "UIDREF", name);
    item.text(tags::UID, VR::UI, uid);
    item
}

/// A code, with what modifies it.
pub(super) fn code(relation: &str, name: Code, value: Code, modified: Vec<DataSet>) -> DataSet {
    let mut item = item(relation, "CODE", name);
    item.sequence(tags::CONCEPT_CODE_SEQUENCE, vec![value.item()]);
    within(&mut item, modified);
    item
}

/// A number with its unit, and what belongs to it.
pub(super) fn number(relation: &str, name: Code, value: f64, unit: Code, inside: Vec<DataSet>) -> DataSet {
    let mut measured = DataSet::new();
    measured.text(tags::NUMERIC_VALUE, VR::DS, &decimal(value));
    measured.value(tags::FLOATING_POINT_VALUE, VR::FD, value);
    measured.sequence(tags::MEASUREMENT_UNITS_CODE_SEQUENCE, vec![unit.item()]);
    let mut item = item(relation, "NUM", name);
    item.sequence(tags::MEASURED_VALUE_SEQUENCE, vec![measured]);
    within(&mut item, inside);
    item
}

pub(super) fn container(relation: &str, name: Code, template: Option<&str>, inside: Vec<DataSet>) -> DataSet {
    let mut item = item(relation, "CONTAINER", name);
    fill(&mut item, template, inside);
    item
}

/// What makes an item, or the document itself, a container.
pub(super) fn fill(item: &mut DataSet, template: Option<&str>, inside: Vec<DataSet>) {
    item.text(tags::CONTINUITY_OF_CONTENT, VR::CS, "SEPARATE");
    if let Some(template) = template {
        let mut named = DataSet::new();
        named.text(tags::MAPPING_RESOURCE, VR::CS, "DCMR");
        named.text(tags::TEMPLATE_IDENTIFIER, VR::CS, template);
        item.sequence(tags::CONTENT_TEMPLATE_SEQUENCE, vec![named]);
    }
    within(item, inside);
}

/// A place in a frame of reference (mm).
pub(super) fn place(relation: &str, name: Code, [x, y, z]: [f64; 3], frame_of_reference: &str) -> DataSet {
    let mut item = item(relation, "SCOORD3D", name);
    item.text(tags::GRAPHIC_TYPE, VR::CS, "POINT");
    let data = [x as f32, y as f32, z as f32];
    item.value(tags::GRAPHIC_DATA, VR::FL, PrimitiveValue::F32(data.into_iter().collect()));
    item.text(tags::REFERENCED_FRAME_OF_REFERENCE_UID, VR::UI, frame_of_reference);
    item
}

fn within(item: &mut DataSet, inside: Vec<DataSet>) {
    if !inside.is_empty() {
        item.sequence(tags::CONTENT_SEQUENCE, inside);
    }
}
