//! The text of `probepath.proto` against the Rust types, and the file against the mcap crate's own reader.

use std::collections::BTreeMap;

use prost::Message;
use prost_types::FileDescriptorSet;
use prost_types::field_descriptor_proto::{Label, Type};

use super::*;

/// Number and wire type of each field of an encoded message, in order (protobuf encoding, "Message structure").
fn wire(mut bytes: &[u8]) -> BTreeMap<i32, u64> {
    let mut fields = BTreeMap::new();
    while !bytes.is_empty() {
        let key = prost::encoding::decode_varint(&mut bytes).unwrap();
        let skip = match key & 7 {
            0 => prost::encoding::decode_varint(&mut bytes).map(|_| 0).unwrap(),
            1 => 8,
            2 => usize::try_from(prost::encoding::decode_varint(&mut bytes).unwrap()).unwrap(),
            other => panic!("wire type {other}"),
        };
        bytes = &bytes[skip..];
        fields.insert(i32::try_from(key >> 3).unwrap(), key & 7);
    }
    fields
}

fn described(message: &str) -> BTreeMap<i32, u64> {
    let set = FileDescriptorSet::decode(schema::descriptor_set().as_slice()).unwrap();
    let found = set.file[0].message_type.iter().find(|described| described.name() == message).unwrap();
    found.field.iter().map(|field| (field.number(), wire_type(field.r#type(), field.label()))).collect()
}

fn wire_type(kind: Type, label: Label) -> u64 {
    match (kind, label) {
        // Repeated scalars are packed.
        (_, Label::Repeated) | (Type::String | Type::Message, _) => 2,
        (Type::Double | Type::Fixed64 | Type::Sfixed64, _) => 1,
        (Type::Bool | Type::Uint32, _) => 0,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_rust_types_are_what_the_text_says() {
    let mut noise = Noise(2);
    let mut record = encode::tick(&tick(12, &mut noise));
    // Every field set to something, so that every field is on the wire.
    (record.stay, record.guiding, record.freedrive) = (true, true, true);
    (record.safety, record.age_ns, record.overtaken) = ("reduced".into(), 1, true);
    let wrench = record.wrench.as_mut().unwrap();
    wrench.force_y_n = 1.0;
    let bscan = encode::bscan(&placed(5, (8, 8), &mut noise));
    assert_eq!(wire(&record.encode_to_vec()), described("Tick"));
    assert_eq!(wire(&wrench_of(&record).encode_to_vec()), described("Wrench"));
    assert_eq!(wire(&record.world_from_probe.as_ref().unwrap().encode_to_vec()), described("Pose"));
    let full = proto::BScan { wrench: record.wrench.clone(), ..bscan };
    assert_eq!(wire(&full.encode_to_vec()), described("BScan"));
}

fn wrench_of(record: &proto::Tick) -> &proto::Wrench {
    record.wrench.as_ref().unwrap()
}

#[test]
fn every_field_of_the_text_is_described() {
    let fields = schema::TEXT.lines().filter(|line| line.split("//").next().unwrap().contains(" = ")).count();
    let set = FileDescriptorSet::decode(schema::descriptor_set().as_slice()).unwrap();
    // One of the lines is `syntax = "proto3"`.
    assert_eq!(set.file[0].message_type.iter().map(|message| message.field.len()).sum::<usize>(), fields - 1);
    assert_eq!(set.file[0].message_type.len(), 4);
}

#[test]
fn the_mcap_crate_reads_the_same_messages_by_its_index() {
    let events = events(1200, (40, 30));
    let bytes = written(&events);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.unwrap();
    assert_eq!((stats.attachment_count, stats.metadata_count), (3, 2));
    let mut topics = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        *topics.entry(message.unwrap().channel.topic.clone()).or_insert(0) += 1;
    }
    let wanted = [
        ("/bscan", 60),
        ("/bscan/image", 60),
        ("/bscan/tf", 60),
        ("/events", 3),
        ("/joint_commands", 120),
        ("/joint_states", 120),
        // Each eleventh tick has no pose.
        ("/tf", 120 - 11),
        ("/tick", 1200),
        ("/wrench", 120),
    ];
    assert_eq!(topics, wanted.map(|(topic, count)| (topic.to_owned(), count)).into());
}
