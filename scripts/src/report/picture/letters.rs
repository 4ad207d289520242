//! Text in a picture: the public-domain 8x8 letters of `font8x8`.

use font8x8::legacy::BASIC_LEGACY;

use super::{Colour, Picture};

/// Columns and rows of a letter.
pub const LETTER: i64 = 8;
/// What a letter that the font does not have becomes.
const UNKNOWN: char = '?';

impl Picture {
    /// Writes a line of text, its upper left corner at `(column, row)`, with a shadow so that it reads on any grey.
    /// Letters beyond ASCII become `?`; what leaves the picture is cut.
    pub fn text(&mut self, (column, row): (i64, i64), text: &str, colour: Colour) {
        for shadow in [(1, 0), (0, 1), (1, 1), (-1, 0), (0, -1)] {
            self.letters((column + shadow.0, row + shadow.1), text, [0, 0, 0]);
        }
        self.letters((column, row), text, colour);
    }

    /// Writes text in lines that fit the picture, broken between words; gives the row below the last.
    pub fn paragraph(&mut self, (column, row): (i64, i64), text: &str, colour: Colour) -> i64 {
        let letters = ((self.width as i64 - column) / LETTER).max(1) as usize;
        let mut row = row;
        for line in broken(text, letters) {
            self.text((column, row), &line, colour);
            row += LETTER + 3;
        }
        row
    }

    fn letters(&mut self, (column, row): (i64, i64), text: &str, colour: Colour) {
        for (nth, letter) in (0..).zip(text.chars()) {
            let glyph = BASIC_LEGACY.get(letter as usize).or_else(|| BASIC_LEGACY.get(UNKNOWN as usize));
            for (down, bits) in (0..).zip(glyph.into_iter().flatten()) {
                for across in (0..LETTER).filter(|across| bits >> across & 1 == 1) {
                    self.set(column + nth * LETTER + across, row + down, colour);
                }
            }
        }
    }
}

/// Lines of at most `letters` letters; a word longer than that stands alone, and is cut by the picture's edge.
fn broken(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words() {
        assert_eq!(broken("only two dots were found", 10), ["only two", "dots were", "found"]);
        assert_eq!(broken("", 10), Vec::<String>::new());
    }

    #[test]
    fn a_letter_is_drawn_the_right_way_round() {
        let mut picture = Picture::filled(8, 8, [0; 3]);
        picture.letters((0, 0), "L", [255; 3]);
        let lit: Vec<usize> = picture.rgb.chunks(3).map(|p| usize::from(p[0] > 0)).collect();
        let column = |c: usize| (0..8).map(|r| lit[r * 8 + c]).sum::<usize>();
        // The stroke of an L stands on the left, its foot lies at the bottom.
        assert!(column(1) + column(2) > column(4) + column(5), "{lit:?}");
        assert!(lit[6 * 8..7 * 8].iter().sum::<usize>() > lit[0..8].iter().sum::<usize>(), "{lit:?}");
    }

    #[test]
    fn any_text_anywhere_is_cut_and_not_a_panic() {
        let mut picture = Picture::filled(20, 10, [0; 3]);
        picture.text((-5, -5), "wires ± µm \u{1F600}", [255; 3]);
        picture.text((i64::from(i32::MAX), 5), "far", [255; 3]);
        assert_eq!(picture.rgb.len(), 600);
    }
}
