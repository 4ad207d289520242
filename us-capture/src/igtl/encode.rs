//! Writing messages: what the simulated machine sends, and what the decoder is tested with.

use super::crc::crc64;
use super::error::IgtlError;
use super::header::{EXTENDED_BYTES, HEADER_BYTES, fixed_of};
use super::image::{IMAGE_BYTES, Image, UINT8};

/// An IMAGE message with header 2 (protocol 3): `id` is its number, `stamp_ns` the sender's clock.
///
/// The picture lies in its own plane: its first axis along x, its second along y, its middle where its first pixel is at
/// the origin.
///
/// # Errors
/// When the pixels are not as many as the columns and rows say, or the name or stamp does not fit.
pub fn encode_image(device: &str, id: u32, stamp_ns: i64, image: &Image) -> Result<Vec<u8>, IgtlError> {
    let (columns, rows) = (image.columns, image.rows);
    if usize::from(columns) * usize::from(rows) != image.pixels.len() || image.pixels.is_empty() {
        let why = format!("{columns} x {rows} pixels, and {} bytes", image.pixels.len());
        return Err(IgtlError::Unwritable { why });
    }
    let mut body = Vec::with_capacity(EXTENDED_BYTES + IMAGE_BYTES + image.pixels.len() + 2);
    // The extended header: its own length, the length of the metadata's index (its count alone), of the metadata.
    body.extend([0, 12, 0, 2, 0, 0, 0, 0]);
    body.extend(id.to_be_bytes());
    // Version 1, one component, 8 bits, little-endian as if it mattered, LPS.
    body.extend([0, 1, 1, UINT8, 2, 2]);
    [columns, rows, 1].iter().for_each(|size| body.extend(size.to_be_bytes()));
    let [x, y] = image.spacing_mm.map(|mm| mm as f32);
    let middle = |count: u16, spacing: f32| f32::from(count - 1) / 2.0 * spacing;
    let matrix = [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 1.0, middle(columns, x), middle(rows, y), 0.0];
    matrix.iter().for_each(|number| body.extend(number.to_be_bytes()));
    [0, 0, 0, columns, rows, 1].iter().for_each(|index| body.extend(index.to_be_bytes()));
    body.extend(&image.pixels);
    body.extend([0, 0]);
    message(2, "IMAGE", device, stamp_ns, &body)
}

/// A STATUS message with header 1 that says all is well.
///
/// # Errors
/// When the name or stamp does not fit.
pub fn encode_status(device: &str, stamp_ns: i64) -> Result<Vec<u8>, IgtlError> {
    // Code 1 is OK; no sub-code, no name, no words.
    let mut body = [0; 31];
    body[1] = 1;
    message(1, "STATUS", device, stamp_ns, &body)
}

/// Any message.
///
/// # Errors
/// When the type, the name or the stamp does not fit.
pub(super) fn message(
    version: u16,
    kind: &str,
    device: &str,
    stamp_ns: i64,
    body: &[u8],
) -> Result<Vec<u8>, IgtlError> {
    let unwritable = |why: String| IgtlError::Unwritable { why };
    let stamp =
        fixed_of(stamp_ns).ok_or_else(|| unwritable(format!("the stamp {stamp_ns} ns does not fit")))?;
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len());
    bytes.extend(version.to_be_bytes());
    for (name, room) in [(kind, 12), (device, 20)] {
        let padding = usize::checked_sub(room, name.len())
            .ok_or_else(|| unwritable(format!("\"{name}\" is longer than {room} bytes")))?;
        bytes.extend(name.bytes().chain(std::iter::repeat_n(0, padding)));
    }
    bytes.extend(stamp.to_be_bytes());
    bytes.extend((body.len() as u64).to_be_bytes());
    bytes.extend(crc64(0, body).to_be_bytes());
    bytes.extend(body);
    Ok(bytes)
}
