//! OpenIGTLink in any split: the same bytes give the same messages, and what was read can be written and is read again.
#![no_main]

use libfuzzer_sys::fuzz_target;
use probepath_us_capture::igtl::{Decoder, Message, encode_image};

fn decode(bytes: &[u8], piece: usize) -> Vec<Message> {
    let (mut decoder, mut messages) = (Decoder::default(), Vec::new());
    for mut part in bytes.chunks(piece) {
        while !part.is_empty() {
            let Ok(message) = decoder.feed(&mut part) else { return messages };
            messages.extend(message);
        }
    }
    messages
}

fuzz_target!(|input: (u8, &[u8])| {
    let (piece, bytes) = input;
    let messages = decode(bytes, usize::from(piece) + 1);
    assert_eq!(messages, decode(bytes, bytes.len().max(1)));
    for message in messages {
        let Message::Image(header, image) = message else { continue };
        let Ok(written) = encode_image(&header.device, header.id, header.stamp.nanoseconds(), &image) else { continue };
        assert!(matches!(&decode(&written, 7)[..], [Message::Image(_, again)] if again.pixels == image.pixels));
    }
});
