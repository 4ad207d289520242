use std::collections::BTreeMap;

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

mod golden;

fn bytes(rng: &mut ChaCha8Rng, most: usize) -> Vec<u8> {
    let length = rng.random_range(0..=most);
    (0..length).map(|_| rng.random()).collect()
}

fn some_names(rng: &mut ChaCha8Rng) -> String {
    let count = rng.random_range(0..40);
    let all: Vec<String> =
        (0..count).map(|_| format!("input_int_register_{}", rng.random_range(0..48))).collect();
    all.join(",")
}

/// A request at random, written.
fn request(rng: &mut ChaCha8Rng, version: Version) -> Vec<u8> {
    let (fields, names, words) = (bytes(rng, 600), some_names(rng), (bytes(rng, 255), bytes(rng, 255)));
    let source: &[u8] = if version == Version::V1 { &[] } else { &words.1 };
    let recipe = if version == Version::V1 { 0 } else { rng.random() };
    let frequency_hz = if version == Version::V1 { 125.0 } else { rng.random_range(1.0..500.0) };
    let request = match rng.random_range(0..8) {
        0 => Request::ProtocolVersion(rng.random()),
        1 => Request::ControllerVersion,
        2 => Request::Text(Text {
            level: Level::from_number(rng.random_range(0..4)),
            source,
            message: &words.0,
        }),
        3 => Request::Data { recipe, fields: &fields },
        4 => Request::Outputs { frequency_hz, names: &names },
        5 => Request::Inputs { names: &names },
        6 => Request::Start,
        _ => Request::Pause,
    };
    let mut written = Vec::new();
    request.write(version, &mut written).unwrap();
    let mut decoder = Decoder::new();
    assert_eq!(decoder.feed(&written), written.len());
    assert_eq!(Request::read(decoder.next().unwrap().unwrap(), version).unwrap(), request);
    written
}

/// A reply at random, written.
fn reply(rng: &mut ChaCha8Rng, version: Version) -> Vec<u8> {
    let (fields, types, words) =
        (bytes(rng, 2000), "DOUBLE,VECTOR6D,NOT_FOUND", (bytes(rng, 255), bytes(rng, 255)));
    let source: &[u8] = if version == Version::V1 { &[] } else { &words.1 };
    let recipe = if version == Version::V1 { 0 } else { rng.random() };
    let accepted = rng.random();
    let reply = match rng.random_range(0..8) {
        0 => Reply::ProtocolVersion { accepted },
        1 => Reply::ControllerVersion(ControllerVersion {
            major: rng.random(),
            minor: rng.random(),
            bugfix: rng.random(),
            build: rng.random(),
        }),
        2 => {
            Reply::Text(Text { level: Level::from_number(rng.random_range(0..4)), source, message: &words.0 })
        }
        3 => Reply::Data { recipe, fields: &fields },
        4 => Reply::Outputs { recipe, types },
        5 => Reply::Inputs { recipe: rng.random(), types },
        6 => Reply::Start { accepted },
        _ => Reply::Pause { accepted },
    };
    let mut written = Vec::new();
    reply.write(version, &mut written).unwrap();
    let mut decoder = Decoder::new();
    assert_eq!(decoder.feed(&written), written.len());
    assert_eq!(Reply::read(decoder.next().unwrap().unwrap(), version).unwrap(), reply);
    written
}

/// What a decoder makes of a stream, fed in pieces.
fn cut(stream: &[u8], mut piece: impl FnMut() -> usize) -> Result<Vec<(u8, Vec<u8>)>, RtdeError> {
    let (mut decoder, mut frames, mut rest) = (Decoder::new(), Vec::new(), stream);
    while !rest.is_empty() {
        let taken = decoder.feed(&rest[..piece().clamp(1, rest.len())]);
        rest = &rest[taken..];
        while let Some(frame) = decoder.next()? {
            frames.push((frame.kind, frame.payload.to_vec()));
        }
    }
    Ok(frames)
}

#[test]
fn ten_thousand_packets_of_both_ends_are_read_as_they_were_written() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for case in 0..10_000 {
        let version = if case % 3 == 0 { Version::V1 } else { Version::V2 };
        request(&mut rng, version);
        reply(&mut rng, version);
    }
}

#[test]
fn a_stream_is_read_the_same_however_it_is_cut() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..300 {
        let stream: Vec<u8> = (0..12).flat_map(|_| reply(&mut rng, Version::V2)).collect();
        let whole = cut(&stream, || usize::MAX).unwrap();
        assert_eq!(whole.len(), 12);
        let mut dice = ChaCha8Rng::seed_from_u64(rng.random());
        assert_eq!(cut(&stream, || dice.random_range(1..40)).unwrap(), whole);
    }
    let short: Vec<u8> = (0..3).flat_map(|_| request(&mut rng, Version::V2)).collect();
    let whole = cut(&short, || usize::MAX).unwrap();
    for at in 1..short.len() {
        let mut first = true;
        let mut piece = || if std::mem::take(&mut first) { at } else { usize::MAX };
        assert_eq!(cut(&short, &mut piece).unwrap(), whole, "cut at {at}");
    }
    assert_eq!(cut(&short, || 1).unwrap(), whole);
}

#[test]
fn a_stream_that_ends_anywhere_gives_the_whole_frames_before_and_then_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let packets: Vec<Vec<u8>> = (0..6).map(|_| reply(&mut rng, Version::V2)).collect();
    let stream = packets.concat();
    for end in 0..stream.len() {
        let mut whole = 0;
        let before = packets.iter().take_while(|packet| {
            whole += packet.len();
            whole <= end
        });
        assert_eq!(cut(&stream[..end], || usize::MAX).unwrap().len(), before.count(), "ends at {end}");
    }
}

#[test]
fn the_longest_frames_pass_one_after_the_other_through_the_same_memory() {
    let fields = vec![7; LONGEST - 4];
    let mut packet = Vec::new();
    Reply::Data { recipe: 1, fields: &fields }.write(Version::V2, &mut packet).unwrap();
    assert_eq!(packet.len(), LONGEST);
    let stream = packet.repeat(5);
    let mut decoder = Decoder::new();
    let memory = decoder.room().len();
    assert_eq!(memory, LONGEST + 1, "nothing beyond one frame and the byte after it");
    let (mut rest, mut frames) = (stream.as_slice(), 0);
    while !rest.is_empty() || decoder.waiting() > 0 {
        rest = &rest[decoder.feed(rest)..];
        while let Some(frame) = decoder.next().unwrap() {
            assert_eq!(frame.payload.len(), LONGEST - 3);
            frames += 1;
        }
    }
    assert_eq!((frames, decoder.room().len()), (5, memory));
    let too_long = Reply::Data { recipe: 1, fields: &vec![7; LONGEST - 3] };
    assert!(matches!(too_long.write(Version::V2, &mut packet), Err(RtdeError::DoesNotFit { .. })));
    assert_eq!(packet.len(), LONGEST, "nothing of it is left behind");
}

#[test]
fn lengths_and_kinds_that_cannot_be_are_refused_by_the_header_alone() {
    let first = |bytes: &[u8], limit| {
        let mut decoder = Decoder::with_limit(limit);
        decoder.feed(bytes);
        let error = decoder.next().unwrap_err();
        decoder.feed(&[0, 4, b'V', 1]);
        assert_eq!(decoder.next().unwrap_err(), error, "it stays");
        error
    };
    for length in 0..3 {
        assert_eq!(first(&[0, length, b'U'], LONGEST), RtdeError::TooShort { length: usize::from(length) });
    }
    assert_eq!(
        first(&[0xff, 0xff, b'U'], 4096),
        RtdeError::TooLong { kind: 'U', length: 65535, limit: 4096 }
    );
    for kind in (0..=u8::MAX).filter(|kind| !kind::ALL.contains(kind)) {
        assert!(matches!(first(&[0, 9, kind], LONGEST), RtdeError::UnknownKind { http: false, .. }));
    }
    let web = first(b"HTTP/1.1 400 Bad Request\r\n", LONGEST);
    assert!(web.to_string().contains("web server"), "{web}");
    // A length of 3 is a frame without payload, which most kinds cannot be.
    let mut decoder = Decoder::new();
    decoder.feed(&[0, 3, b'V']);
    let frame = decoder.next().unwrap().unwrap();
    assert!(matches!(Reply::read(frame, Version::V2), Err(RtdeError::Payload { found: 0, .. })));
}

#[test]
fn damaged_packets_are_read_or_refused_and_what_is_read_is_written_again() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut read, mut refused) = (0, 0);
    for case in 0..20_000 {
        let version = if case % 2 == 0 { Version::V1 } else { Version::V2 };
        let mut packet = reply(&mut rng, version);
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..packet.len());
            packet[at] = rng.next_u32() as u8;
        }
        if case % 5 == 0 {
            packet.truncate(rng.random_range(0..=packet.len()));
        }
        let Ok(frames) = cut(&packet, || usize::MAX) else {
            refused += 1;
            continue;
        };
        for (kind, payload) in &frames {
            let frame = Frame { kind: *kind, payload };
            for outcome in [
                again(Reply::read(frame, version), version),
                again_request(Request::read(frame, version), version),
            ] {
                match outcome {
                    Some(written) => {
                        read += 1;
                        assert_eq!(written.len(), payload.len() + 3);
                    }
                    None => refused += 1,
                }
            }
        }
    }
    assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
}

fn again(reply: Result<Reply<'_>, RtdeError>, version: Version) -> Option<Vec<u8>> {
    let mut written = Vec::new();
    reply.ok()?.write(version, &mut written).unwrap();
    Some(written)
}

fn again_request(request: Result<Request<'_>, RtdeError>, version: Version) -> Option<Vec<u8>> {
    let mut written = Vec::new();
    request.ok()?.write(version, &mut written).unwrap();
    Some(written)
}

#[test]
fn a_value_is_read_as_it_was_written_and_has_its_types_size() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for kind in Type::ALL {
        assert_eq!(Type::from_name(kind.name()), Some(kind));
        assert_eq!(kind.zero().kind(), kind);
        for _ in 0..300 {
            let mut bytes: Vec<u8> = (0..kind.size()).map(|_| rng.random()).collect();
            if kind == Type::Bool {
                bytes[0] &= 1;
            }
            let value = kind.read(&bytes).unwrap();
            let mut written = Vec::new();
            value.write(&mut written);
            assert_eq!((written, value.kind()), (bytes.clone(), kind));
            bytes.push(0);
            assert_eq!(kind.read(&bytes), None, "a byte more");
            assert_eq!(kind.read(&bytes[..kind.size() - 1]), None, "a byte less");
        }
    }
    assert_eq!(Type::from_name("DOUBLES"), None);
}

#[test]
fn every_name_has_one_type_and_no_name_twice() {
    let mut seen = BTreeMap::new();
    for (name, kind) in super::fields::all() {
        let before = seen.insert(name, kind);
        // Input bits can be read back, so both tables have them.
        assert!(
            before.is_none() || name.starts_with("input_bit_registers") && before == Some(kind),
            "{name} twice"
        );
        assert!([output_type(name), input_type(name)].contains(&Some(kind)));
    }
    for (name, kind) in [
        ("output_int_register_0", Some(Type::Int32)),
        ("output_int_register_47", Some(Type::Int32)),
        ("output_int_register_48", None),
        ("output_int_register_007", None),
        ("output_int_register_+1", None),
        ("output_double_register_24", Some(Type::Double)),
        ("output_bit_register_63", None),
        ("output_bit_register_64", Some(Type::Bool)),
        ("output_bit_register_127", Some(Type::Bool)),
        ("input_int_register_3", Some(Type::Int32)),
        ("speed_slider_mask", None),
        ("actual_q", Some(Type::Vector6D)),
        ("payload_cog", Some(Type::Vector3D)),
        ("", None),
    ] {
        assert_eq!(output_type(name), kind, "{name}");
    }
    assert_eq!(input_type("speed_slider_mask"), Some(Type::Uint32));
    assert_eq!(input_type("external_force_torque"), Some(Type::Vector6D));
    assert_eq!((input_type("actual_q"), input_type("output_int_register_1")), (None, None));
}

#[test]
fn names_may_end_with_a_comma_and_only_with_one() {
    assert_eq!(names("a,b").collect::<Vec<_>>(), ["a", "b"]);
    assert_eq!(names("a,b,").collect::<Vec<_>>(), ["a", "b"]);
    assert_eq!(names("a,,b").collect::<Vec<_>>(), ["a", "", "b"]);
    assert_eq!(names("").count(), 0);
}

#[test]
fn a_recipe_lies_without_gaps_and_reads_what_was_written() {
    let asked = "timestamp,actual_q,runtime_state,input_bit_register_64,payload_cog";
    let recipe = Recipe::agreed(asked, output_type, 4, "DOUBLE,VECTOR6D,UINT32,BOOL,VECTOR3D").unwrap();
    let values = [
        Value::Double(41.5),
        Value::Vector6D([1.0, -2.0, 3.0, 4.0, 5.0, 6.0]),
        Value::Uint32(2),
        Value::Bool(true),
        Value::Vector3D([0.0, 0.1, -0.2]),
    ];
    let mut fields = Vec::new();
    values.iter().for_each(|value| value.write(&mut fields));
    assert_eq!((recipe.number(), recipe.size(), recipe.len()), (4, 8 + 48 + 4 + 1 + 24, 5));
    recipe.check(4, &fields).unwrap();
    assert_eq!(recipe.values(&fields).collect::<Vec<_>>(), values);
    assert!(matches!(recipe.check(5, &fields), Err(RtdeError::Recipe { found: 5, expected: 4 })));
    fields.pop();
    assert!(matches!(recipe.check(4, &fields), Err(RtdeError::Package { found: 84, expected: 85, .. })));
    assert_eq!((recipe.value(4, &fields), recipe.value(5, &fields)), (None, None));
}

#[test]
fn a_recipe_that_is_refused_says_which_fields_and_why() {
    let agreed = |types: &str| Recipe::agreed("timestamp,actual_q,magic", output_type, 0, types).unwrap_err();
    let words = agreed("DOUBLE,VECTOR6D,NOT_FOUND").to_string();
    assert!(words.contains("has no magic"), "{words}");
    let words = agreed("IN_USE,VECTOR6D,NOT_FOUND").to_string();
    assert!(words.contains("another client hold timestamp") && words.contains("no magic"), "{words}");
    let words = agreed("IN_USE").to_string();
    assert!(words.contains("timestamp, actual_q, magic"), "{words}");
    assert!(agreed("").to_string().contains("does not say why"));
    assert!(matches!(agreed("DOUBLE,VECTOR6D"), RtdeError::WrongCount { types: 2, names: 3 }));
    assert!(matches!(agreed("DOUBLE,VECTOR7D,DOUBLE"), RtdeError::UnknownType { .. }));
    // A server that answers with the names instead of their types.
    assert!(matches!(agreed("timestamp,actual_q,magic"), RtdeError::UnknownType { .. }));
    let changed = agreed("DOUBLE,VECTOR3D,DOUBLE");
    assert_eq!(changed.to_string(), "\"actual_q\" is said to be VECTOR3D, it is VECTOR6D");
}

#[test]
fn words_of_both_versions_are_read_and_broken_ones_refused() {
    let read = |payload: &[u8], version| {
        Reply::read(Frame { kind: kind::TEXT, payload }, version).map(|reply| match reply {
            Reply::Text(text) => (text.level, text.words().into_owned(), text.source.to_vec()),
            other => panic!("{other:?}"),
        })
    };
    assert_eq!(read(b"\x02slow", Version::V1), Ok((Level::Warning, "slow".into(), Vec::new())));
    assert_eq!(
        read(b"\x04slow\x04RTDE\x03", Version::V2),
        Ok((Level::Info, "slow".into(), b"RTDE".to_vec()))
    );
    assert_eq!(read(b"\x00\x00\x09", Version::V2), Ok((Level::Error, String::new(), Vec::new())));
    for broken in [
        &b""[..],
        b"\x05slow",
        b"\x04slow",
        b"\x04slow\x04RTD",
        b"\x04slow\x04RTDE",
        b"\x04slow\x04RTDE\x03\x03",
    ] {
        assert!(matches!(read(broken, Version::V2), Err(RtdeError::Payload { .. })), "{broken:?}");
    }
    assert!(read(b"", Version::V1).is_err());
    assert_eq!(read(b"\x01\xff\xfe", Version::V1).unwrap().1, "\u{fffd}\u{fffd}");
}
