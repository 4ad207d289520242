//! The pixels behind a header: plain, one zlib stream, or one gzip stream, taken image by image.

use std::io::{self, Read};

use flate2::bufread::{GzDecoder, ZlibDecoder};

use super::SequenceError;

/// Deflate cannot unpack a byte into more than this (258 bytes from two bits).
const DEFLATE_AT_MOST: u64 = 1032;
/// Header and checksum of a stream, so that tiny ones are not refused for them.
const STREAM_SLACK: u64 = 1032 * 16;

/// How the pixels are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// As they are.
    Raw,
    /// One zlib stream (MetaImage), of so many bytes when the header says.
    Zlib(Option<u64>),
    /// One gzip stream (NRRD).
    Gzip,
}

/// What the header claims: `count` blocks of `block` bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Bytes of one image.
    pub block: u64,
    /// Images.
    pub count: u64,
}

impl Claim {
    fn total(self) -> u64 {
        self.block.saturating_mul(self.count)
    }

    /// Refuses a claim above `limit`, or one that the payload could not hold however well it were packed.
    fn check(self, packing: Packing, holds: u64, limit: u64) -> Result<(), SequenceError> {
        let needs = self.total();
        if needs > limit {
            return Err(SequenceError::TooLarge { needs, limit });
        }
        let most = match packing {
            Packing::Raw if holds > needs => {
                return Err(SequenceError::TooLong { what: "pixels", needs, holds });
            }
            Packing::Raw => holds,
            _ => holds.saturating_mul(DEFLATE_AT_MOST).saturating_add(STREAM_SLACK),
        };
        if needs > most {
            return Err(SequenceError::CutShort { what: "pixels", needs, holds: most });
        }
        Ok(())
    }
}

/// Unpacks the payload and hands over each block with its number. Memory: one block at a time, growing only as
/// bytes really come.
///
/// # Errors
/// When the payload holds less or more than claimed, or the stream is damaged.
pub fn unpack(
    payload: &[u8],
    packing: Packing,
    claim: Claim,
    most_bytes: u64,
    take: impl FnMut(u64, Vec<u8>),
) -> Result<(), SequenceError> {
    let payload = compressed_part(payload, packing)?;
    claim.check(packing, payload.len() as u64, most_bytes)?;
    match packing {
        Packing::Raw => blocks(payload, claim, take),
        Packing::Zlib(_) => {
            let mut stream = ZlibDecoder::new(payload);
            blocks(&mut stream, claim, take)?;
            ended(stream.total_in(), payload.len() as u64)
        }
        Packing::Gzip => {
            let mut stream = GzDecoder::new(payload);
            blocks(&mut stream, claim, take)?;
            let left = stream.get_ref().len();
            ended((payload.len() - left) as u64, payload.len() as u64)
        }
    }
}

/// The bytes that `CompressedDataSize` says, all of them and no other.
fn compressed_part(payload: &[u8], packing: Packing) -> Result<&[u8], SequenceError> {
    let Packing::Zlib(Some(needs)) = packing else { return Ok(payload) };
    let (what, holds) = ("compressed pixels", payload.len() as u64);
    match needs.cmp(&holds) {
        std::cmp::Ordering::Greater => Err(SequenceError::CutShort { what, needs, holds }),
        std::cmp::Ordering::Less => Err(SequenceError::TooLong { what, needs, holds }),
        std::cmp::Ordering::Equal => Ok(payload),
    }
}

fn ended(used: u64, holds: u64) -> Result<(), SequenceError> {
    if used < holds {
        return Err(SequenceError::TooLong { what: "compressed pixels", needs: used, holds });
    }
    Ok(())
}

fn blocks(
    mut stream: impl Read,
    claim: Claim,
    mut take: impl FnMut(u64, Vec<u8>),
) -> Result<(), SequenceError> {
    for image in 0..claim.count {
        let mut block = Vec::new();
        let bad = |source| SequenceError::BadStream { image, source };
        stream.by_ref().take(claim.block).read_to_end(&mut block).map_err(bad)?;
        if (block.len() as u64) < claim.block {
            let holds = image * claim.block + block.len() as u64;
            return Err(SequenceError::CutShort { what: "pixels", needs: claim.total(), holds });
        }
        take(image, block);
    }
    // Reading past the last block also makes the decoder compare the checksum.
    let bad = |source| SequenceError::BadStream { image: claim.count, source };
    let more = io::copy(&mut stream.take(1), &mut io::sink()).map_err(bad)?;
    if more > 0 {
        let needs = claim.total();
        return Err(SequenceError::TooLong { what: "pixels", needs, holds: needs + more });
    }
    Ok(())
}
