//! Which way round the images are stored (PLUS's `UltrasoundImageOrientation`).

use std::fmt;

use super::SequenceError;

/// Orientation of a stored B-scan: first letter the side the columns run toward (M marked first: toward the unmarked
/// side, U the other way), second the way the rows run (F: away from the probe, N: toward it). Everything behind the
/// reader is MF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// As ours: columns toward the unmarked side, rows away from the probe.
    Mf,
    /// Columns the other way.
    Uf,
    /// Rows the other way.
    Mn,
    /// Both the other way.
    Un,
}

impl Orientation {
    /// What a header says: `None` when it says nothing (absent, empty or `XX`).
    ///
    /// # Errors
    /// RF lines (FM, FU, NM, NU), and anything that is no orientation.
    pub fn parse(text: Option<&str>) -> Result<Option<Self>, SequenceError> {
        let text = text.unwrap_or_default().trim();
        // The third letter is the order of a 3D image's planes; A (ascending) is the only one a sequence can have.
        match text.strip_suffix('A').unwrap_or(text) {
            "" | "XX" | "XXX" => Ok(None),
            "MF" => Ok(Some(Self::Mf)),
            "UF" => Ok(Some(Self::Uf)),
            "MN" => Ok(Some(Self::Mn)),
            "UN" => Ok(Some(Self::Un)),
            "FM" | "FU" | "NM" | "NU" => Err(SequenceError::RfLines { orientation: text.into() }),
            _ => Err(SequenceError::Unsupported {
                key: "UltrasoundImageOrientation".into(),
                value: super::header::beginning(text),
                why: "known are MF, UF, MN and UN, with or without an A",
            }),
        }
    }

    /// Turns an image of that orientation into MF, in place.
    pub fn bring_to_mf(self, pixels: &mut [u8], width: usize) {
        if width == 0 || self == Self::Mf {
            return;
        }
        if matches!(self, Self::Uf | Self::Un) {
            pixels.chunks_exact_mut(width).for_each(<[u8]>::reverse);
        }
        if matches!(self, Self::Mn | Self::Un) {
            let rows = pixels.len() / width;
            let (top, bottom) = pixels.split_at_mut(rows / 2 * width);
            for (a, b) in top.chunks_exact_mut(width).zip(bottom.chunks_exact_mut(width).rev()) {
                a.swap_with_slice(b);
            }
        }
    }
}

impl fmt::Display for Orientation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mf => "MF",
            Self::Uf => "UF",
            Self::Mn => "MN",
            Self::Un => "UN",
        })
    }
}
