//! The standard error of a reconstructed point, as a picture of the image.

use probepath_us_capture::PixelSpacing;
use probepath_us_capture::fit::StandardErrorMap;

use crate::report::picture::{Colour, Picture};

/// Columns of the picture.
const WIDTH: usize = 480;
/// Rows below the map, for its words.
const WORDS: usize = 34;
const SAID: Colour = [235, 235, 235];
/// So many lines of equal error, about.
const LINES: f64 = 5.0;

/// The map over an image of `size` pixels, in its true proportions: dark where the calibration is sure, yellow where it is
/// least; lines of equal error, numbers at the corners and in the middle.
pub(super) fn draw(map: &StandardErrorMap, size: (usize, usize), spacing: PixelSpacing) -> Picture {
    let proportion = (size.1 as f64 * spacing.y_m) / (size.0 as f64 * spacing.x_m);
    let height = ((WIDTH as f64 * proportion) as usize).clamp(60, 3 * WIDTH);
    let (least, most) =
        map.errors_m.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), e| (a.min(*e), b.max(*e)));
    let mut picture = Picture::filled(WIDTH, height + WORDS, [0, 0, 0]);
    let at = |column: usize, row: usize| {
        between(map, column as f64 / (WIDTH - 1) as f64, row as f64 / (height - 1) as f64)
    };
    let line_mm = round((most - least) * 1e3 / LINES);
    let band = |column: usize, row: usize| (at(column, row) * 1e3 / line_mm).floor();
    for row in 0..height {
        for column in 0..WIDTH {
            let line = column > 0 && row > 0 && (band(column, row) - band(column - 1, row - 1)).abs() > 0.5;
            let colour =
                if line { SAID } else { shade((at(column, row) - least) / (most - least).max(1e-12)) };
            picture.set(column as i64, row as i64, colour);
        }
    }
    numbers(&mut picture, height, &at);
    let words = format!(
        "a line every {line_mm} mm; standard error of a point: {:.3} mm mean, {:.3} mm at the 95th percentile",
        map.mean_m() * 1e3,
        map.p95_m() * 1e3
    );
    picture.paragraph((4, height as i64 + 5), &words, SAID);
    picture
}

fn numbers(picture: &mut Picture, height: usize, at: &impl Fn(usize, usize) -> f64) {
    for (column, row) in
        [(0, 0), (WIDTH - 1, 0), (WIDTH / 2, height / 2), (0, height - 1), (WIDTH - 1, height - 1)]
    {
        let text = format!("{:.3} mm", at(column, row) * 1e3);
        let left = (column as i64 - 36).clamp(4, WIDTH as i64 - 8 * text.len() as i64 - 4);
        picture.text((left, (row as i64 - 4).clamp(4, height as i64 - 12)), &text, SAID);
    }
}

/// 1, 2 or 5 times a power of ten, the first that is not smaller.
fn round(step: f64) -> f64 {
    let step = step.max(1e-4);
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= step * 0.999).unwrap_or(10.0 * power)
}

/// Between the map's points; `across` and `down` run from 0 to 1.
fn between(map: &StandardErrorMap, across: f64, down: f64) -> f64 {
    let (columns, rows) = map.size;
    let (x, y) = (across * (columns - 1) as f64, down * (rows - 1) as f64);
    let (left, top) = ((x as usize).min(columns.saturating_sub(2)), (y as usize).min(rows.saturating_sub(2)));
    let value = |i: usize, k: usize| map.errors_m.get(k * columns + i).copied().unwrap_or(f64::NAN);
    let (x, y) = (x - left as f64, y - top as f64);
    let upper = value(left, top) * (1.0 - x) + value(left + 1, top) * x;
    let lower = value(left, top + 1) * (1.0 - x) + value(left + 1, top + 1) * x;
    upper * (1.0 - y) + lower * y
}

/// From deep blue over red to yellow: lighter is worse, in grey too.
fn shade(part: f64) -> Colour {
    const STOPS: [[f64; 3]; 4] =
        [[20.0, 20.0, 70.0], [110.0, 30.0, 110.0], [205.0, 80.0, 60.0], [250.0, 225.0, 110.0]];
    let at = part.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let low = (at as usize).min(STOPS.len() - 2);
    let mix = |k: usize| STOPS[low][k] + (STOPS[low + 1][k] - STOPS[low][k]) * (at - low as f64);
    [mix(0) as u8, mix(1) as u8, mix(2) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_corner_is_the_lightest() {
        // No line of equal error (every 0.02 mm) goes through the worst corner.
        let errors_m = (0..9).map(|k| 1e-4 + 1.05e-5 * f64::from(k)).collect();
        let map = StandardErrorMap { size: (3, 3), step_px: (10.0, 10.0), errors_m };
        assert!((between(&map, 1.0, 1.0) - 1.84e-4).abs() < 1e-12);
        assert!((between(&map, 0.25, 0.0) - 1.0525e-4).abs() < 1e-12);
        let picture = draw(&map, (640, 480), PixelSpacing { x_m: 1e-4, y_m: 1e-4 });
        assert_eq!((picture.width(), shade(0.0)[0] < shade(1.0)[0]), (480, true));
        assert!(picture.has(shade(1.0)));
    }
}
