//! The primary interface's messages: however a stream is cut, the same is heard, and what is refused is refused. The
//! first byte says how the stream is cut.
#![no_main]

use libfuzzer_sys::fuzz_target;
use probepath_robot::drivers::ur::primary::{PrimaryReader, Said};

fuzz_target!(|bytes: &[u8]| {
    let Some((cut, stream)) = bytes.split_first() else { return };
    assert_eq!(heard(stream, stream.len().max(1)), heard(stream, usize::from(*cut).max(1)));
});

/// What was heard, and whether the whole stream could be read.
fn heard(stream: &[u8], piece: usize) -> (Vec<Said>, bool) {
    let (mut reader, mut all) = (PrimaryReader::default(), Vec::new());
    for piece in stream.chunks(piece) {
        if reader.feed(piece, |said| all.push(said)).is_err() {
            return (all, false);
        }
    }
    (all, true)
}
