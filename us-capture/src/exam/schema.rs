//! Descriptors of our own messages, built from the text of `probepath.proto` so that there is one source.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

/// The messages, with their comments.
pub(crate) const TEXT: &str = include_str!("probepath.proto");

/// The `FileDescriptorSet` that an MCAP schema of encoding `protobuf` holds.
pub(crate) fn descriptor_set() -> Vec<u8> {
    FileDescriptorSet { file: vec![file(TEXT)] }.encode_to_vec()
}

/// The file's descriptor. Understands what `probepath.proto` uses: messages of scalar, repeated and message fields.
fn file(text: &str) -> FileDescriptorProto {
    let mut messages: Vec<DescriptorProto> = Vec::new();
    for line in text.lines() {
        let code = line.split("//").next().unwrap_or_default().trim();
        if let Some(name) = code.strip_prefix("message ").and_then(|rest| rest.strip_suffix(" {")) {
            messages.push(DescriptorProto { name: Some(name.into()), ..Default::default() });
        } else if let (Some(field), Some(message)) = (field(code), messages.last_mut()) {
            message.field.push(field);
        }
    }
    FileDescriptorProto {
        name: Some("probepath.proto".into()),
        package: Some("probepath".into()),
        syntax: Some("proto3".into()),
        message_type: messages,
        ..Default::default()
    }
}

/// `[repeated] TYPE NAME = NUMBER;`
fn field(code: &str) -> Option<FieldDescriptorProto> {
    let (left, number) = code.strip_suffix(';')?.split_once(" = ")?;
    let number = number.parse().ok()?;
    let (label, left) = match left.strip_prefix("repeated ") {
        Some(rest) => (Label::Repeated, rest),
        None => (Label::Optional, left),
    };
    let (kind, name) = left.split_once(' ')?;
    let (kind, type_name) = kind_of(kind);
    Some(FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(label.into()),
        r#type: Some(kind.into()),
        type_name,
        ..Default::default()
    })
}

fn kind_of(kind: &str) -> (Type, Option<String>) {
    let scalar = match kind {
        "double" => Type::Double,
        "fixed64" => Type::Fixed64,
        "sfixed64" => Type::Sfixed64,
        "uint32" => Type::Uint32,
        "bool" => Type::Bool,
        "string" => Type::String,
        message => return (Type::Message, Some(format!(".probepath.{message}"))),
    };
    (scalar, None)
}
