//! Letters of any size with smooth edges: the outlines of the font that comes with `epaint_default_fonts`.

use ab_glyph::{Font, FontRef, Glyph, ScaleFont, point};

use super::{Colour, Picture};

/// Which part of a line of text stands at the place it is written at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    #[default]
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

fn font() -> Option<FontRef<'static>> {
    FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok()
}

/// Width of a line of text (pixels) at a size.
pub fn width(text: &str, size: f64) -> f64 {
    font().map_or(0.0, |font| f64::from(line(&font, text, size).1))
}

/// The letters beside one another, and how wide they are together.
fn line(font: &FontRef<'_>, text: &str, size: f64) -> (Vec<Glyph>, f32) {
    let scaled = font.as_scaled(size as f32);
    let (mut glyphs, mut at, mut last) = (Vec::new(), 0.0, None);
    for letter in text.chars() {
        let id = scaled.glyph_id(letter);
        at += last.map_or(0.0, |last| scaled.kern(last, id));
        glyphs.push(id.with_scale_and_position(size as f32, point(at, 0.0)));
        at += scaled.h_advance(id);
        last = Some(id);
    }
    (glyphs, at)
}

impl Picture {
    /// Writes a line of text, `size` pixels high, its foot at `(x, y)`.
    pub fn write(&mut self, (x, y): (f64, f64), text: &str, size: f64, anchor: Anchor, colour: Colour) {
        let Some(font) = font() else { return };
        let (glyphs, width) = line(&font, text, size);
        let start = match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => width / 2.0,
            Anchor::End => width,
        };
        for mut glyph in glyphs {
            glyph.position.x += x as f32 - start;
            glyph.position.y += y as f32;
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            outline.draw(|column, row, part| {
                let place = (corner.x as i64 + i64::from(column), corner.y as i64 + i64::from(row));
                // A light face on paper: a little more weight makes it legible when it is small.
                self.mix(place.0, place.1, colour, f64::from(part).powf(0.75));
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_drawn_where_they_are_asked_for() {
        let ink = |anchor| {
            let mut picture = Picture::filled(200, 60, [255; 3]);
            picture.write((100.0, 40.0), "Lumen 12 mm²", 20.0, anchor, [0; 3]);
            let dark = (0..200 * 60).filter(|i| picture.rgb[3 * i] < 128).map(|i| i % 200);
            let columns: Vec<usize> = dark.collect();
            (columns.iter().copied().min().unwrap(), columns.iter().copied().max().unwrap())
        };
        let wide = width("Lumen 12 mm²", 20.0);
        assert!((60.0..160.0).contains(&wide), "{wide}");
        let ((a, b), (c, d), (e, f)) = (ink(Anchor::Start), ink(Anchor::Middle), ink(Anchor::End));
        assert!((98..106).contains(&a) && (94..102).contains(&f), "{a} {f}");
        assert!(b > d && d > f && a > c && c > e);
    }

    #[test]
    fn any_text_anywhere_is_cut_and_not_a_panic() {
        let mut picture = Picture::filled(20, 10, [0; 3]);
        picture.write((-5.0, -5.0), "± µm \u{1F600}", 14.0, Anchor::End, [255; 3]);
        picture.write((f64::MAX, f64::NAN), "far", 14.0, Anchor::Middle, [255; 3]);
        assert_eq!(picture.rgb.len(), 600);
    }
}
