//! Tracked sequences, header and payload in one: what is read can be written, and is read again as it was.
#![no_main]

use libfuzzer_sys::fuzz_target;
use probepath_us_capture::sequence::{Header, ReadOptions, Sequence};

fn read(bytes: &[u8]) -> Option<Sequence> {
    let header = Header::parse(bytes).ok()?;
    let payload = bytes.get(header.payload_at..)?;
    Sequence::assemble(&header, payload, &ReadOptions::default()).ok()
}

fuzz_target!(|bytes: &[u8]| {
    let Some(sequence) = read(bytes) else { return };
    for written in [sequence.to_mha(), sequence.to_nrrd()].into_iter().flatten() {
        let again = read(&written).expect("what was written");
        assert_eq!(again.images().len(), sequence.images().len());
    }
});
