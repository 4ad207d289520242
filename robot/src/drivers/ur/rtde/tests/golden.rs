//! Bytes written out by hand from the guide's tables.

use super::*;

fn hex(text: &str) -> Vec<u8> {
    let digits: String = text.split_whitespace().collect();
    (0..digits.len()).step_by(2).map(|i| u8::from_str_radix(&digits[i..i + 2], 16).unwrap()).collect()
}

fn is(bytes: &str, request: Request<'_>, version: Version) {
    let bytes = hex(bytes);
    let mut written = Vec::new();
    request.write(version, &mut written).unwrap();
    assert_eq!(written, bytes, "{request:?}");
    let mut decoder = Decoder::new();
    decoder.feed(&bytes);
    assert_eq!(Request::read(decoder.next().unwrap().unwrap(), version), Ok(request));
}

fn answers(bytes: &str, reply: Reply<'_>, version: Version) {
    let bytes = hex(bytes);
    let mut written = Vec::new();
    reply.write(version, &mut written).unwrap();
    assert_eq!(written, bytes, "{reply:?}");
    let mut decoder = Decoder::new();
    decoder.feed(&bytes);
    assert_eq!(Reply::read(decoder.next().unwrap().unwrap(), version), Ok(reply));
}

#[test]
fn requests_are_the_bytes_of_the_guide() {
    is("0005 56 0002", Request::ProtocolVersion(2), Version::V1);
    is("0003 76", Request::ControllerVersion, Version::V2);
    is("0003 53", Request::Start, Version::V2);
    is("0003 50", Request::Pause, Version::V2);
    // 500 as a double is 2^8 * 1.953125: 0x407f400000000000.
    let names = Request::Outputs { frequency_hz: 500.0, names: "actual_q" };
    is("0013 4f 407f400000000000 61637475616c5f71", names, Version::V2);
    let names = Request::Outputs { frequency_hz: 125.0, names: "actual_q" };
    is("000b 4f 61637475616c5f71", names, Version::V1);
    is(
        "0017 49 696e7075745f696e745f72656769737465725f30",
        Request::Inputs { names: "input_int_register_0" },
        Version::V2,
    );
    is("0008 55 02 00000007", Request::Data { recipe: 2, fields: &[0, 0, 0, 7] }, Version::V2);
    is("0007 55 00000007", Request::Data { recipe: 0, fields: &[0, 0, 0, 7] }, Version::V1);
    let text = Text { level: Level::Warning, source: b"me", message: b"hi" };
    is("000a 4d 02 6869 02 6d65 02", Request::Text(text), Version::V2);
}

#[test]
fn replies_are_the_bytes_of_the_guide() {
    answers("0004 56 01", Reply::ProtocolVersion { accepted: true }, Version::V1);
    let version = ControllerVersion { major: 5, minor: 12, bugfix: 0, build: 1_101_319 };
    answers("0013 76 00000005 0000000c 00000000 0010ce07", Reply::ControllerVersion(version), Version::V2);
    assert_eq!(version.to_string(), "5.12.0.1101319");
    answers("000c 4f 01 564543544f523644", Reply::Outputs { recipe: 1, types: "VECTOR6D" }, Version::V2);
    answers("0009 4f 444f55424c45", Reply::Outputs { recipe: 0, types: "DOUBLE" }, Version::V1);
    answers("000a 49 00 494e5f555345", Reply::Inputs { recipe: 0, types: "IN_USE" }, Version::V2);
    answers("0004 53 01", Reply::Start { accepted: true }, Version::V2);
    answers("0004 50 00", Reply::Pause { accepted: false }, Version::V2);
    // Recipe 1: a timestamp of 40.25 s (2^5 * 1.2578125) and runtime state 2.
    let fields = hex("4044200000000000 00000002");
    answers("0010 55 01 4044200000000000 00000002", Reply::Data { recipe: 1, fields: &fields }, Version::V2);
    let recipe = Recipe::agreed("timestamp,runtime_state", output_type, 1, "DOUBLE,UINT32").unwrap();
    assert_eq!(recipe.values(&fields).collect::<Vec<_>>(), [Value::Double(40.25), Value::Uint32(2)]);
    let text = Text { level: Level::Exception, source: &[], message: b"no" };
    answers("0006 4d 00 6e6f", Reply::Text(text), Version::V1);
}
