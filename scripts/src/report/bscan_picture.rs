//! A B-scan as a picture, in its true proportions, with the lumen's contour and a scale of depth.

use probepath_us_capture::BScan;

use super::picture::{Anchor, Colour, Picture};

/// Width of the drawn picture in pixels.
const WIDTH: usize = 640;
/// A yellow that stands off every grey, for any colour vision.
const CONTOUR: Colour = [255, 214, 10];
const SCALE: Colour = [235, 240, 245];
const SHADE: Colour = [12, 16, 22];
const LETTERS: f64 = 17.0;

/// Draws a B-scan; `contour` is in its pixels, column and row.
pub fn draw(bscan: &BScan, contour: Option<&[(f64, f64)]>) -> Picture {
    let (columns, rows) = (bscan.width() as f64, bscan.height() as f64);
    let spacing = &bscan.setting.spacing;
    let proportion = (rows * spacing.y_m) / (columns * spacing.x_m);
    let height = ((WIDTH as f64 * proportion).round() as usize).clamp(1, 4 * WIDTH);
    let (across, down) = (columns / WIDTH as f64, rows / height as f64);
    let mut picture = Picture::filled(WIDTH, height, [0, 0, 0]);
    for row in 0..height {
        for column in 0..WIDTH {
            let place = ((column as f64 + 0.5) * across - 0.5, (row as f64 + 0.5) * down - 0.5);
            picture.set(column as i64, row as i64, [grey(bscan, place); 3]);
        }
    }
    if let Some(contour) = contour {
        let drawn = |p: &(f64, f64)| ((p.0 + 0.5) / across - 0.5, (p.1 + 0.5) / down - 0.5);
        let closed: Vec<(f64, f64)> = contour.iter().chain(contour.first()).map(drawn).collect();
        picture.stroke(&closed, 2.0, CONTOUR);
    }
    depth_scale(&mut picture, bscan);
    picture
}

/// The grey level between pixels, straight from each to the next.
fn grey(bscan: &BScan, (u, v): (f64, f64)) -> u8 {
    let axis = |x: f64, size: usize| {
        let x = x.clamp(0.0, size as f64 - 1.0);
        (x as usize, (x as usize + 1).min(size - 1), x.fract())
    };
    let ((a, b, right), (c, d, below)) = (axis(u, bscan.width()), axis(v, bscan.height()));
    let at = |column: usize, row: usize| {
        f64::from(bscan.pixels().get(row * bscan.width() + column).copied().unwrap_or(0))
    };
    let above = at(a, c) + (at(b, c) - at(a, c)) * right;
    let under = at(a, d) + (at(b, d) - at(a, d)) * right;
    (above + (under - above) * below).round() as u8
}

/// A tick every centimetre of depth under the probe's face.
fn depth_scale(picture: &mut Picture, bscan: &BScan) {
    let setting = &bscan.setting;
    let shown = bscan.height() as f64 * setting.spacing.y_m;
    let usable = shown.is_finite() && shown > 0.0 && setting.window_top_m.is_finite();
    if !usable || shown > 1.0 {
        return;
    }
    let per_metre = picture.height() as f64 / shown;
    let first = (setting.window_top_m * 100.0).ceil() as i64;
    let last = ((setting.window_top_m + shown) * 100.0) as i64;
    for centimetre in first..=last {
        let y = (centimetre as f64 * 0.01 - setting.window_top_m) * per_metre;
        // Dark round it: pictures are bright, too.
        picture.stroke(&[(0.0, y), (10.0, y)], 4.5, SHADE);
        picture.stroke(&[(0.0, y), (9.0, y)], 2.0, SCALE);
        let words = if centimetre == last { format!("{centimetre} cm") } else { centimetre.to_string() };
        if y > LETTERS && y < picture.height() as f64 - 3.0 {
            let (x, y) = (14.0, y + LETTERS * 0.35);
            for (right, down) in [(-1.3, 0.0), (1.3, 0.0), (0.0, -1.3), (0.0, 1.3), (0.9, 0.9), (-0.9, 0.9)] {
                picture.write((x + right, y + down), &words, LETTERS, Anchor::Start, SHADE);
            }
            picture.write((x, y), &words, LETTERS, Anchor::Start, SCALE);
        }
    }
}
