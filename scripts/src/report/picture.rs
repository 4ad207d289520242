//! Pictures inside the report: PNG as a data URI, so that one file holds everything.

mod lettering;
mod letters;
mod paint;
mod shapes;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

pub use lettering::{Anchor, width};

/// An RGB picture under construction, origin at the top left.
#[derive(Clone, Debug)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// A colour: red, green, blue.
pub type Colour = [u8; 3];

impl Picture {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, colour: Colour) -> Self {
        Self { width, height, rgb: colour.repeat(width * height) }
    }

    /// A picture of grey pixels, row after row; what is missing stays black.
    pub fn grey(width: usize, height: usize, pixels: &[u8]) -> Self {
        let mut picture = Self::filled(width, height, [0, 0, 0]);
        for (rgb, grey) in picture.rgb.chunks_exact_mut(3).zip(pixels) {
            rgb.fill(*grey);
        }
        picture
    }

    /// Columns.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// The colour of a pixel; black outside.
    #[cfg(test)]
    pub(crate) fn pixel(&self, column: usize, row: usize) -> Colour {
        let at = 3 * (row * self.width + column);
        self.rgb.get(at..at + 3).and_then(|rgb| rgb.try_into().ok()).unwrap_or_default()
    }

    /// Whether any pixel has this colour.
    #[cfg(test)]
    pub(crate) fn has(&self, colour: Colour) -> bool {
        self.rgb.chunks_exact(3).any(|pixel| pixel == colour)
    }

    /// Colours a pixel; outside the picture it does nothing.
    pub fn set(&mut self, column: i64, row: i64, colour: Colour) {
        let inside = (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
        if inside {
            let at = 3 * (row as usize * self.width + column as usize);
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Draws a straight line, one pixel wide.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: Colour) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().clamp(1.0, 1e4);
        for i in 0..=steps as usize {
            let t = i as f64 / steps;
            let (x, y) = (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1));
            self.set(x.round() as i64, y.round() as i64, colour);
        }
    }

    /// The picture as PNG bytes.
    ///
    /// # Errors
    /// When the encoder refuses (a picture without pixels).
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// The picture as an address that a page can hold inside itself.
    ///
    /// # Errors
    /// As [`Self::png`].
    pub fn data_uri(&self) -> Result<String, png::EncodingError> {
        Ok(address(&self.png()?))
    }
}

/// The bytes of a PNG as an address that a page can hold inside itself.
pub fn address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}
