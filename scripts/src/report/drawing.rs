//! A drawing of lines, areas and words, once as SVG for the page and once as a picture.

use std::fmt::Write as _;

use super::picture::{Anchor, Colour, Picture};

/// One thing that is drawn. Places are columns and rows of the drawing.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line through points.
    Line {
        /// The points.
        points: Vec<(f64, f64)>,
        /// How wide it is.
        width: f64,
        /// Its colour.
        colour: Colour,
        /// Whether it is broken into dashes.
        dashed: bool,
    },
    /// The inside of a closed line.
    Area {
        /// Its corners.
        points: Vec<(f64, f64)>,
        /// Its colour.
        colour: Colour,
        /// 1 hides what is under it.
        opacity: f64,
    },
    /// A line of text.
    Text {
        /// Where its foot stands.
        at: (f64, f64),
        /// Which part of it stands there.
        anchor: Anchor,
        /// What it says.
        text: String,
        /// How high it is.
        size: f64,
        /// Its colour.
        colour: Colour,
    },
}

/// Shapes on white, the later over the earlier.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Columns and rows.
    pub size: (f64, f64),
    /// What it shows, in words, for those who cannot see it.
    pub title: String,
    /// What is drawn.
    pub shapes: Vec<Shape>,
}

/// Length of a dash and of the gap after it.
const DASH: (f64, f64) = (5.0, 4.0);

impl Drawing {
    /// Adds a line.
    pub fn line(&mut self, points: &[(f64, f64)], width: f64, colour: Colour) {
        self.shapes.push(Shape::Line { points: points.into(), width, colour, dashed: false });
    }

    /// Adds a dashed line.
    pub fn dashes(&mut self, points: &[(f64, f64)], width: f64, colour: Colour) {
        self.shapes.push(Shape::Line { points: points.into(), width, colour, dashed: true });
    }

    /// Adds an area.
    pub fn area(&mut self, points: &[(f64, f64)], colour: Colour, opacity: f64) {
        self.shapes.push(Shape::Area { points: points.into(), colour, opacity });
    }

    /// Adds words.
    pub fn text(&mut self, at: (f64, f64), text: &str, size: f64, anchor: Anchor, colour: Colour) {
        self.shapes.push(Shape::Text { at, anchor, text: text.into(), size, colour });
    }

    /// The drawing as an inline SVG.
    pub fn svg(&self) -> String {
        let ((width, height), title) = (self.size, super::html::escape(&self.title));
        let mut svg = format!("<svg viewBox='0 0 {width} {height}' role='img' aria-label='{title}'>");
        for shape in &self.shapes {
            match shape {
                Shape::Line { points, width, colour, dashed } => {
                    let dash = if *dashed {
                        format!(" stroke-dasharray='{} {}'", DASH.0, DASH.1)
                    } else {
                        String::new()
                    };
                    let _ = write!(
                        svg,
                        "<polyline points='{}' fill='none' stroke='{}' stroke-width='{width}' stroke-linejoin='round'{dash}/>",
                        list(points),
                        hex(*colour)
                    );
                }
                Shape::Area { points, colour, opacity } => {
                    let (points, colour) = (list(points), hex(*colour));
                    let _ =
                        write!(svg, "<polygon points='{points}' fill='{colour}' fill-opacity='{opacity}'/>");
                }
                Shape::Text { at, anchor, text, size, colour } => {
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let _ = write!(
                        svg,
                        "<text x='{:.1}' y='{:.1}' font-size='{size}' text-anchor='{anchor}' fill='{}'>{}</text>",
                        at.0,
                        at.1,
                        hex(*colour),
                        super::html::escape(text)
                    );
                }
            }
        }
        svg.push_str("</svg>");
        svg
    }

    /// The drawing as a picture, `scale` pixels for each column and row.
    pub fn picture(&self, scale: f64) -> Picture {
        let mut picture =
            Picture::filled((self.size.0 * scale) as usize, (self.size.1 * scale) as usize, [255; 3]);
        self.paint(&mut picture, scale);
        picture
    }

    /// Draws it over a picture.
    pub fn paint(&self, picture: &mut Picture, scale: f64) {
        let place = |(x, y): (f64, f64)| (x * scale, y * scale);
        let places = |points: &[(f64, f64)]| points.iter().map(|p| place(*p)).collect::<Vec<_>>();
        for shape in &self.shapes {
            match shape {
                Shape::Line { points, width, colour, dashed: false } => {
                    picture.stroke(&places(points), width * scale, *colour);
                }
                Shape::Line { points, width, colour, dashed: true } => {
                    let dashes = dashes(points);
                    dashes.iter().for_each(|dash| picture.stroke(&places(dash), width * scale, *colour));
                }
                Shape::Area { points, colour, opacity } => picture.fill(&places(points), *colour, *opacity),
                Shape::Text { at, anchor, text, size, colour } => {
                    picture.write(place(*at), text, size * scale, *anchor, *colour);
                }
            }
        }
    }
}

/// The pieces of a dashed line.
fn dashes(points: &[(f64, f64)]) -> Vec<[(f64, f64); 2]> {
    let (mut pieces, mut done) = (Vec::new(), 0.0);
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let at = |d: f64| (a.0 + (b.0 - a.0) * d / length, a.1 + (b.1 - a.1) * d / length);
        let period = DASH.0 + DASH.1;
        let mut from = -(done % period);
        while length.is_finite() && from < length {
            let (start, end) = (from.max(0.0), (from + DASH.0).min(length));
            if end > start {
                pieces.push([at(start), at(end)]);
            }
            from += period;
        }
        done += length;
    }
    pieces
}

fn list(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_says_the_same_as_svg_and_as_a_picture() {
        let mut drawing = Drawing { size: (60.0, 40.0), title: "a < b".into(), shapes: Vec::new() };
        drawing.area(&[(5.0, 5.0), (25.0, 5.0), (25.0, 25.0), (5.0, 25.0)], [255, 0, 0], 1.0);
        drawing.dashes(&[(0.0, 35.0), (60.0, 35.0)], 2.0, [0, 0, 255]);
        drawing.text((30.0, 20.0), "5 < 6", 10.0, Anchor::Start, [0, 0, 0]);
        let svg = drawing.svg();
        assert!(
            svg.contains("5 &lt; 6") && svg.contains("stroke-dasharray") && svg.contains("#ff0000"),
            "{svg}"
        );
        let picture = drawing.picture(2.0);
        assert_eq!((picture.width(), picture.height()), (120, 80));
        assert!(picture.has([255, 0, 0]) && picture.has([0, 0, 255]));
    }

    #[test]
    fn a_dashed_line_is_dashes_and_gaps() {
        let pieces = dashes(&[(0.0, 0.0), (12.0, 0.0), (12.0, 15.0)]);
        let drawn: f64 = pieces.iter().map(|[a, b]| (b.0 - a.0).hypot(b.1 - a.1)).sum();
        assert!((drawn - 15.0).abs() < 1e-9, "{pieces:?}");
    }
}
