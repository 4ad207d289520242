//! [`Image`]: what an IMAGE message holds, when it is a B-scan.

use super::error::IgtlError;
use super::header::{EXTENDED_BYTES, Header, part};

/// Length of the image's own header.
pub(super) const IMAGE_BYTES: usize = 72;

/// An 8-bit grey picture of one slice.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub columns: u16,
    /// Rows.
    pub rows: u16,
    /// From one column to the next, and from one row to the next (mm).
    pub spacing_mm: [f64; 2],
    /// Grey levels, row after row.
    pub pixels: Vec<u8>,
}

/// `UINT8` among the protocol's scalar types.
pub(super) const UINT8: u8 = 3;

impl Image {
    /// Reads the body of an IMAGE message; gives the message's number too.
    ///
    /// # Errors
    /// When it is no B-scan, or its parts do not fit into it.
    pub(super) fn read(header: &Header, mut body: Vec<u8>) -> Result<(u32, Self), IgtlError> {
        let (id, content) = if header.is_extended() { extended(header, &body)? } else { (0, 0..body.len()) };
        body.truncate(content.end);
        body.drain(..content.start);
        let refused = |why| IgtlError::NoBScan { device: header.device.clone(), why };
        Self::content(body).map(|image| (id, image)).map_err(refused)
    }

    fn content(mut content: Vec<u8>) -> Result<Self, String> {
        let Some(head) = content.first_chunk::<IMAGE_BYTES>() else {
            return Err(format!("{} bytes are too few for its own header of {IMAGE_BYTES}", content.len()));
        };
        let (components, scalar) = (head[2], head[3]);
        if components != 1 || scalar != UINT8 {
            return Err(format!(
                "{components} components of scalar type {scalar}; send 1 component of type {UINT8} (8-bit grey)"
            ));
        }
        let [columns, rows, slices, from @ .., n0, n1, n2] = shape(head);
        if columns == 0 || rows == 0 || slices != 1 {
            return Err(format!("{columns} x {rows} x {slices} pixels; send columns x rows x 1"));
        }
        if from != [0; 3] || [n0, n1, n2] != [columns, rows, slices] {
            return Err(format!(
                "only a part of it came ({n0} x {n1} x {n2} from {from:?}); send whole pictures"
            ));
        }
        let spacing_mm = [axis(head, 0), axis(head, 1)];
        if !spacing_mm.iter().all(|mm| mm.is_finite() && *mm > 0.0) {
            return Err(format!("its pixels are {spacing_mm:?} mm; a spacing is more than zero"));
        }
        let (wanted, found) = (usize::from(columns) * usize::from(rows), content.len() - IMAGE_BYTES);
        if found != wanted {
            return Err(format!("{columns} x {rows} pixels need {wanted} bytes, {found} came"));
        }
        Ok(Self { columns, rows, spacing_mm, pixels: content.split_off(IMAGE_BYTES) })
    }
}

/// Size, first index and size of the part.
fn shape(head: &[u8; IMAGE_BYTES]) -> [u16; 9] {
    std::array::from_fn(|i| u16::from_be_bytes(part(head, if i < 3 { 6 + 2 * i } else { 54 + 2 * i })))
}

/// Length of an axis of the matrix: its rows are the axes, each as long as a pixel (mm).
fn axis(head: &[u8; IMAGE_BYTES], which: usize) -> f64 {
    let number = |i: usize| f64::from(f32::from_be_bytes(part(head, 12 + 12 * which + 4 * i)));
    (0..3).map(|i| number(i).powi(2)).sum::<f64>().sqrt()
}

/// The message's number, and where the content is between extended header and metadata.
fn extended(header: &Header, body: &[u8]) -> Result<(u32, std::ops::Range<usize>), IgtlError> {
    let size = u64::from(u16::from_be_bytes(part(body, 0)));
    let metadata =
        u64::from(u16::from_be_bytes(part(body, 2))) + u64::from(u32::from_be_bytes(part(body, 4)));
    let id = u32::from_be_bytes(part(body, 8));
    let end = usize::try_from(metadata).ok().and_then(|metadata| body.len().checked_sub(metadata));
    match (usize::try_from(size), end) {
        (Ok(start), Some(end)) if (EXTENDED_BYTES..=end).contains(&start) => Ok((id, start..end)),
        _ => Err(IgtlError::ExtendedHeader {
            device: header.device.clone(),
            bytes: body.len(),
            claimed: size.saturating_add(metadata),
        }),
    }
}
