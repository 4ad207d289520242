//! The dashboard's lines: however a stream is cut, what is refused whole is refused in pieces, and what is read is the
//! same. The first byte says how the stream is cut.

use probepath_robot::drivers::ur::lines::{LONGEST, Lines};

/// Panics where it does not hold.
pub fn check(bytes: &[u8]) {
    let Some((cut, stream)) = bytes.split_first() else { return };
    let (whole, in_pieces) = (read(stream, usize::MAX), read(stream, usize::from(*cut).max(1)));
    assert_eq!(whole, in_pieces);
    assert!(whole.iter().flatten().all(|line| line.len() <= LONGEST && !line.contains('\n')));
}

fn read(stream: &[u8], piece: usize) -> Option<Vec<String>> {
    let (mut lines, mut all, mut rest) = (Lines::new(), Vec::new(), stream);
    while !rest.is_empty() {
        let taken = lines.feed(&rest[..piece.min(rest.len())]);
        rest = &rest[taken..];
        while let Some(line) = lines.next().ok()? {
            all.push(line.to_owned());
        }
    }
    Some(all)
}
