//! OpenIGTLink in any split: the same bytes give the same messages, and what was read can be written and is read again. The first byte
//! says how the stream is cut.

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

/// Panics where it does not hold.
pub fn check(bytes: &[u8]) {
    let Some((piece, bytes)) = bytes.split_first() else { return };
    let messages = decode(bytes, usize::from(*piece) + 1);
    assert_eq!(messages, decode(bytes, bytes.len().max(1)));
    for message in messages {
        let Message::Image(header, image) = message else { continue };
        let Ok(written) = encode_image(&header.device, header.id, header.stamp.nanoseconds(), &image) else {
            continue;
        };
        assert!(
            matches!(&decode(&written, 7)[..], [Message::Image(_, again)] if again.pixels == image.pixels)
        );
    }
}
