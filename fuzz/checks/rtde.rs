//! RTDE, both ends of it: however a stream is cut it reads the same, and a packet that was read is written again.
//! The first byte says how the stream is cut.

use probepath_robot::drivers::ur::rtde::{
    Decoder, Frame, Recipe, Reply, Request, RtdeError, Version, output_type,
};

/// Panics where it does not hold.
pub fn check(bytes: &[u8]) {
    let Some((cut, stream)) = bytes.split_first() else { return };
    let whole = read(stream, usize::MAX);
    assert_eq!(read(stream, usize::from(*cut).max(1)), whole);
    for (kind, payload) in whole.iter().flatten() {
        for version in [Version::V1, Version::V2] {
            let frame = Frame { kind: *kind, payload };
            let mut written = Vec::new();
            if let Ok(request) = Request::read(frame, version) {
                request.write(version, &mut written).expect("what was read fits");
                assert_eq!(written.len(), payload.len() + 3);
            }
            written.clear();
            if let Ok(reply) = Reply::read(frame, version) {
                reply.write(version, &mut written).expect("what was read fits");
                assert_eq!(written.len(), payload.len() + 3);
                agree(reply);
            }
        }
    }
}

/// An answer to a recipe, taken as one.
fn agree(reply: Reply<'_>) {
    let Reply::Outputs { recipe, types } = reply else { return };
    for asked in ["timestamp,actual_q,runtime_state", "timestamp"] {
        if let Ok(recipe) = Recipe::agreed(asked, output_type, recipe, types) {
            let fields = vec![0x55; recipe.size()];
            assert_eq!(recipe.values(&fields).count(), recipe.len());
            let _ = recipe.values(types.as_bytes()).count();
        }
    }
}

fn read(stream: &[u8], piece: usize) -> Result<Vec<(u8, Vec<u8>)>, RtdeError> {
    let (mut decoder, mut frames, mut rest) = (Decoder::new(), Vec::new(), stream);
    while !rest.is_empty() {
        let taken = decoder.feed(&rest[..piece.min(rest.len())]);
        rest = &rest[taken..];
        while let Some(frame) = decoder.next()? {
            frames.push((frame.kind, frame.payload.to_vec()));
        }
    }
    Ok(frames)
}
