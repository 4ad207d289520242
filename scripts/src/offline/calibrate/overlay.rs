//! A picture of what was seen in an image: every dot, the wires' names, where the calibration expects them, or why
//! the image was refused.

use probepath_us_capture::dots::Dot;

use super::wishes::Region;
use crate::report::picture::{Colour, Picture};

/// Dots that no wire made.
const UNLABELLED: Colour = [120, 120, 255];
/// Where the calibration expects a wire.
const EXPECTED: Colour = [255, 255, 255];
/// The edge of the region that is looked at.
const EDGE: Colour = [90, 90, 90];
/// Words about an image that is used, and one that is not.
const SAID: Colour = [160, 230, 160];
const REFUSED: Colour = [255, 110, 90];
/// Dots are drawn at so many standard deviations of their shape.
const SIGMAS: f64 = 2.5;
/// Half of a cross (pixels).
const CROSS: f64 = 4.0;

/// What is drawn of one image. Places are MF pixels.
#[derive(Clone, Debug)]
pub(super) struct Seen<'a> {
    pub size: (usize, usize),
    pub pixels: &'a [u8],
    pub region: Option<Region>,
    /// Everything that was found.
    pub dots: &'a [Dot],
    /// The dot of every wire, with the wire's name, in the phantom's order.
    pub wires: Vec<(&'a str, Option<Dot>)>,
    /// Where the calibration expects every wire.
    pub expected: Vec<Option<[f64; 2]>>,
    pub said: String,
    pub refused: Option<String>,
}

impl Seen<'_> {
    pub(super) fn draw(&self) -> Picture {
        let mut picture = Picture::grey(self.size.0, self.size.1, self.pixels);
        if let Some(Region { origin: [x, y], size: [width, height] }) = self.region {
            let first = (x as f64, y as f64);
            picture.rectangle(first, (first.0 + width as f64 - 1.0, first.1 + height as f64 - 1.0), EDGE);
        }
        for dot in self.dots.iter().filter(|dot| !self.is_labelled(dot)) {
            picture.ellipse(dot.at_px, &dot.spread_px2, SIGMAS, UNLABELLED);
        }
        for (nth, (name, dot)) in self.wires.iter().enumerate() {
            if let Some(dot) = dot {
                labelled(&mut picture, dot, name, colour(nth));
            }
        }
        for expected in self.expected.iter().flatten() {
            picture.cross(*expected, CROSS, EXPECTED);
        }
        self.words(&mut picture);
        picture
    }

    fn is_labelled(&self, dot: &Dot) -> bool {
        self.wires.iter().any(|(_, labelled)| labelled.as_ref() == Some(dot))
    }

    fn words(&self, picture: &mut Picture) {
        let below = picture.paragraph((4, 4), &self.said, SAID);
        if let Some(why) = &self.refused {
            picture.paragraph((4, below), &format!("refused: {why}"), REFUSED);
        }
    }
}

/// A dot with its wire's name beside it, above and below in turn so that neighbours' names do not cover each other.
fn labelled(picture: &mut Picture, dot: &Dot, name: &str, colour: Colour) {
    picture.ellipse(dot.at_px, &dot.spread_px2, SIGMAS, colour);
    picture.cross(dot.at_px, 1.0, colour);
    let half = SIGMAS * dot.spread_px2[(1, 1)].max(1.0).sqrt();
    picture.text((dot.at_px[0] as i64 - 8, (dot.at_px[1] + half) as i64 + 4), name, colour);
}

/// A colour of one's own for every wire: hues a golden section apart, so that neighbours differ.
fn colour(nth: usize) -> Colour {
    let hue = (0.12 + nth as f64 * 0.618_034).fract() * 6.0;
    let channel = |shift: f64| {
        let at = (hue + shift).rem_euclid(6.0);
        let level = (2.0 - (at - 3.0).abs()).clamp(0.0, 1.0);
        (70.0 + 185.0 * level) as u8
    };
    [channel(3.0), channel(1.0), channel(5.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    fn dot(at_px: [f64; 2]) -> Dot {
        let spread_px2 = Matrix2::identity() * 9.0;
        Dot { at_px, covariance_px2: Matrix2::identity(), spread_px2, peak: 200.0, mass: 1e3, cut: false }
    }

    #[test]
    fn labels_dots_expectations_and_words_all_leave_their_colour() {
        let dots = [dot([30.0, 50.0]), dot([70.0, 50.0])];
        let seen = Seen {
            size: (100, 100),
            pixels: &[10; 10_000],
            region: Some(Region { origin: [2, 2], size: [96, 96] }),
            dots: &dots,
            wires: vec![("A", Some(dots[0])), ("B", None)],
            expected: vec![Some([30.5, 50.5]), Some([f64::NAN, 5.0])],
            said: "image 7".into(),
            refused: Some("too few dots".into()),
        };
        let picture = seen.draw();
        for wanted in [UNLABELLED, EXPECTED, EDGE, SAID, REFUSED, colour(0)] {
            assert!(picture.has(wanted), "{wanted:?}");
        }
        assert!(!picture.has(colour(1)));
    }

    #[test]
    fn the_first_wires_differ_in_colour() {
        let colours: Vec<Colour> = (0..12).map(colour).collect();
        for (nth, a) in colours.iter().enumerate() {
            for b in &colours[..nth] {
                let apart: i32 = a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(*b)).abs()).sum();
                assert!(apart > 40, "{a:?} {b:?}");
            }
        }
    }
}
