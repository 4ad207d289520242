//! Smooth lines and areas: how much of each pixel a shape covers.

use super::{Colour, Picture};

/// Rows that a pixel is looked at in when an area is filled.
const SUBROWS: usize = 4;

impl Picture {
    /// Draws a line through points, so many pixels wide, with smooth edges and round joints.
    pub fn stroke(&mut self, points: &[(f64, f64)], width: f64, colour: Colour) {
        let half = width.max(0.5) / 2.0;
        let Some(mut cover) = Cover::round(points, half + 1.0, self) else { return };
        for pair in points.windows(2) {
            cover.segment(pair[0], pair[1], half);
        }
        cover.blend(self, colour, 1.0);
    }

    /// Fills the inside of a closed line with smooth edges; `opacity` 1 hides what is under it.
    pub fn fill(&mut self, corners: &[(f64, f64)], colour: Colour, opacity: f64) {
        let Some(mut cover) = Cover::round(corners, 1.0, self) else { return };
        cover.area(corners);
        cover.blend(self, colour, opacity);
    }

    /// Mixes a colour into a pixel; outside the picture it does nothing.
    pub fn mix(&mut self, column: i64, row: i64, colour: Colour, part: f64) {
        let inside = (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
        if !inside {
            return;
        }
        let at = 3 * (row as usize * self.width + column as usize);
        let part = part.clamp(0.0, 1.0);
        for (old, new) in self.rgb.iter_mut().skip(at).zip(colour) {
            *old = (f64::from(*old) + (f64::from(new) - f64::from(*old)) * part).round() as u8;
        }
    }

    /// A smaller picture, each of whose pixels is the mean of `times` by `times` of this one.
    #[must_use]
    pub fn shrunk(&self, times: usize) -> Self {
        let times = times.max(1);
        let mut small = Self::filled(self.width / times, self.height / times, [0; 3]);
        let count = (times * times) as u32;
        for (i, pixel) in small.rgb.chunks_exact_mut(3).enumerate() {
            let (column, row) = (i % small.width * times, i / small.width * times);
            let mut sums = [count / 2; 3];
            for y in row..row + times {
                let from = 3 * (y * self.width + column);
                for rgb in self.rgb.get(from..from + 3 * times).unwrap_or_default().chunks_exact(3) {
                    sums.iter_mut().zip(rgb).for_each(|(sum, level)| *sum += u32::from(*level));
                }
            }
            pixel.iter_mut().zip(sums).for_each(|(level, sum)| *level = (sum / count) as u8);
        }
        small
    }
}

/// How much of each pixel of a rectangle is covered.
struct Cover {
    first: (i64, i64),
    width: usize,
    height: usize,
    part: Vec<f32>,
}

impl Cover {
    /// The rectangle round points, as far as it lies in the picture.
    fn round(points: &[(f64, f64)], margin: f64, picture: &Picture) -> Option<Self> {
        if points.is_empty() || !points.iter().all(|p| p.0.is_finite() && p.1.is_finite()) {
            return None;
        }
        let range = |values: &mut dyn Iterator<Item = f64>, size: usize| {
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            let inside = |x: f64| x.clamp(0.0, size as f64) as usize;
            (inside((low - margin).floor()), inside((high + margin).ceil() + 1.0))
        };
        let (left, right) = range(&mut points.iter().map(|p| p.0), picture.width);
        let (top, bottom) = range(&mut points.iter().map(|p| p.1), picture.height);
        let (width, height) = (right.checked_sub(left)?, bottom.checked_sub(top)?);
        Some(Self { first: (left as i64, top as i64), width, height, part: vec![0.0; width * height] })
    }

    /// Raises the cover to that of a piece of line with round ends.
    fn segment(&mut self, a: (f64, f64), b: (f64, f64), half: f64) {
        let ((x0, y0), (dx, dy)) = (a, (b.0 - a.0, b.1 - a.1));
        let square = (dx * dx + dy * dy).max(1e-12);
        let (left, top) = (self.first.0 as f64, self.first.1 as f64);
        let reach = |from: f64, to: f64, start: f64, size: usize| {
            let inside = |x: f64| (x - start).clamp(0.0, size as f64) as usize;
            inside((from.min(to) - half - 1.0).floor())..inside((from.max(to) + half + 2.0).ceil())
        };
        for row in reach(a.1, b.1, top, self.height) {
            for column in reach(a.0, b.0, left, self.width) {
                let (x, y) = (left + column as f64, top + row as f64);
                let along = (((x - x0) * dx + (y - y0) * dy) / square).clamp(0.0, 1.0);
                let off = (x - x0 - along * dx).hypot(y - y0 - along * dy);
                let part = (half + 0.5 - off).clamp(0.0, 1.0) as f32;
                let old = &mut self.part[row * self.width + column];
                *old = old.max(part);
            }
        }
    }

    /// Adds the inside of a closed line (even-odd).
    fn area(&mut self, corners: &[(f64, f64)]) {
        let (left, top) = (self.first.0 as f64, self.first.1 as f64);
        for sub in 0..self.height * SUBROWS {
            // Pixel centres lie on whole numbers.
            let y = top - 0.5 + (sub as f64 + 0.5) / SUBROWS as f64;
            let edges = corners.iter().zip(corners.iter().cycle().skip(1));
            let crosses = edges.filter(|(a, b)| (a.1 <= y) != (b.1 <= y));
            let mut at: Vec<f64> =
                crosses.map(|(a, b)| a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0) - left + 0.5).collect();
            at.sort_by(f64::total_cmp);
            let row = sub / SUBROWS * self.width;
            for span in at.chunks_exact(2) {
                self.span(row, span[0].max(0.0), span[1].min(self.width as f64));
            }
        }
    }

    fn span(&mut self, row: usize, from: f64, to: f64) {
        for column in from as usize..(to.max(0.0).ceil() as usize).min(self.width) {
            let inside = (to.min(column as f64 + 1.0) - from.max(column as f64)).max(0.0);
            self.part[row + column] += (inside / SUBROWS as f64) as f32;
        }
    }

    fn blend(&self, picture: &mut Picture, colour: Colour, opacity: f64) {
        for (i, part) in self.part.iter().enumerate().filter(|(_, part)| **part > 0.0) {
            let (column, row) = (i % self.width, i / self.width);
            let place = (self.first.0 + column as i64, self.first.1 + row as i64);
            picture.mix(place.0, place.1, colour, f64::from(*part) * opacity);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(picture: &Picture) -> f64 {
        picture.rgb.iter().step_by(3).map(|level| f64::from(*level) / 255.0).sum()
    }

    #[test]
    fn an_area_covers_as_many_pixels_as_it_is_large_wherever_it_lies() {
        for shift in [0.0, 0.25, 0.5, 0.8] {
            let mut picture = Picture::filled(40, 40, [0; 3]);
            let corners = [(10.0, 8.0), (30.0, 8.0), (30.0, 20.0), (10.0, 20.0)];
            picture.fill(&corners.map(|(x, y)| (x + shift, y + shift)), [255; 3], 1.0);
            assert!((sum(&picture) - 240.0).abs() < 3.0, "{shift}: {}", sum(&picture));
        }
    }

    #[test]
    fn a_line_is_as_wide_as_it_is_asked_to_be_in_any_direction() {
        for turn in 0..12 {
            let angle = f64::from(turn) * 0.2;
            let mut picture = Picture::filled(80, 80, [0; 3]);
            let end = |t: f64| (40.0 + t * angle.cos(), 40.0 + t * angle.sin());
            picture.stroke(&[end(-25.0), end(25.0)], 4.0, [255; 3]);
            // 50 by 4, and two half discs.
            assert!((sum(&picture) - 212.6).abs() < 8.0, "{angle}: {}", sum(&picture));
        }
    }

    #[test]
    fn what_is_no_number_or_outside_is_not_drawn() {
        let mut picture = Picture::filled(10, 10, [0; 3]);
        picture.stroke(&[(f64::NAN, 1.0), (3.0, 3.0)], 2.0, [255; 3]);
        picture.fill(&[(-50.0, -50.0), (-40.0, -50.0), (-40.0, -40.0)], [255; 3], 1.0);
        picture.stroke(&[(1e9, 1e9), (2e9, 2e9)], 2.0, [255; 3]);
        assert!(sum(&picture) < 1e-9);
    }
}
