//! A B-scan as a picture, in its true proportions, with the lumen's contour drawn.

use probepath_us_capture::BScan;

use super::picture::{Colour, Picture};

/// Width of the drawn picture in pixels.
const WIDTH: usize = 480;
const CONTOUR: Colour = [255, 214, 10];

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
            let at = |x: usize, step: f64, most: usize| (((x as f64 + 0.5) * step) as usize).min(most - 1);
            let (u, v) = (at(column, across, bscan.width()), at(row, down, bscan.height()));
            let grey = bscan.pixels().get(v * bscan.width() + u).copied().unwrap_or(0);
            picture.set(column as i64, row as i64, [grey; 3]);
        }
    }
    if let Some(contour) = contour {
        let drawn = |p: (f64, f64)| ((p.0 + 0.5) / across - 0.5, (p.1 + 0.5) / down - 0.5);
        for (from, until) in contour.iter().zip(contour.iter().cycle().skip(1)) {
            picture.line(drawn(*from), drawn(*until), CONTOUR);
        }
    }
    picture
}
