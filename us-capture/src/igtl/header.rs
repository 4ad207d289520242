//! [`Header`]: the 58 bytes before every message.

use probepath_frames::{ImageClock, Stamp};

use super::error::IgtlError;

/// Length of the header.
pub const HEADER_BYTES: usize = 58;

/// Length of the extended header of version 2, which is the body's beginning.
pub(super) const EXTENDED_BYTES: usize = 12;

/// Before every message, all of it big-endian: version (2 bytes), type (12), device (20), stamp (8), length of the body
/// (8), its checksum (8).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// 1, or 2 with an extended header.
    pub version: u16,
    /// `IMAGE`, `TRANSFORM`, `STATUS`, ...
    pub kind: String,
    /// Who sent it.
    pub device: String,
    /// When, by the sender's clock; zero where it says nothing.
    pub stamp: Stamp<ImageClock>,
    /// The message's number where the extended header has one, else zero.
    pub id: u32,
    /// Length of the body.
    pub body: u64,
    pub(super) crc: u64,
}

impl Header {
    /// Reads it.
    ///
    /// # Errors
    /// When its version is none.
    pub(super) fn read(bytes: &[u8; HEADER_BYTES]) -> Result<Self, IgtlError> {
        let version = u16::from_be_bytes(part(bytes, 0));
        if !(1..=3).contains(&version) {
            let begins = String::from_utf8_lossy(&bytes[..12]).into_owned();
            return Err(IgtlError::Version { found: version, begins });
        }
        Ok(Self {
            version,
            kind: text(&part::<12>(bytes, 2)),
            device: text(&part::<20>(bytes, 14)),
            stamp: stamp_of(u64::from_be_bytes(part(bytes, 34))),
            id: 0,
            body: u64::from_be_bytes(part(bytes, 42)),
            crc: u64::from_be_bytes(part(bytes, 50)),
        })
    }

    /// Whether the body begins with an extended header.
    pub(super) const fn is_extended(&self) -> bool {
        self.version > 1
    }
}

/// `N` bytes from `at`; zeros past the end.
pub(super) fn part<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
}

/// Text up to its first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(bytes.get(..end).unwrap_or_default()).trim_end().to_owned()
}

const PER_SECOND: u64 = 1_000_000_000;

/// Seconds in the upper 32 bits, 2^-32 s in the lower, to the nearest nanosecond.
fn stamp_of(fixed: u64) -> Stamp<ImageClock> {
    let fraction = ((fixed & 0xffff_ffff) * PER_SECOND + (1 << 31)) >> 32;
    let nanoseconds = (fixed >> 32) * PER_SECOND + fraction;
    Stamp::from_nanoseconds(i64::try_from(nanoseconds).unwrap_or(i64::MAX))
}

/// The reverse; what is read again is the same nanosecond. `None` outside the 136 years that fit.
pub(super) fn fixed_of(nanoseconds: i64) -> Option<u64> {
    let nanoseconds = u64::try_from(nanoseconds).ok()?;
    let seconds = u32::try_from(nanoseconds / PER_SECOND).ok()?;
    let fraction = ((nanoseconds % PER_SECOND) << 32).div_ceil(PER_SECOND);
    Some(u64::from(seconds) << 32 | fraction)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

    use super::*;

    #[test]
    fn every_nanosecond_comes_back() {
        for ns in (0..3000).chain(999_999_000..1_000_001_000).chain((0..100_000).map(|n| n * 42_949_672 + 17))
        {
            assert_eq!(stamp_of(fixed_of(ns).unwrap()).nanoseconds(), ns);
        }
        assert_eq!(stamp_of(1 << 31).nanoseconds(), 500_000_000);
        assert_eq!(fixed_of(-1), None);
        assert_eq!(fixed_of(i64::MAX), None);
        assert_eq!(stamp_of(u64::MAX).nanoseconds(), 4_294_967_296_000_000_000);
    }
}
