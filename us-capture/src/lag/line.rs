//! The plane as one image shows it: a bright line, found to a fraction of a pixel.

mod echoes;
mod straight;

use super::NoLine;
use echoes::{Echo, echoes};
use straight::{Support, brightest, through};

/// What counts as an echo, and as a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineOptions {
    /// An echo is at least so many grey levels over the middle of its column.
    pub contrast_grey: f64,
    /// The line has to be seen in this part of the image's columns.
    pub least_width: f64,
    /// Of the columns that show an echo, this part has to show it on the line.
    pub least_share: f64,
}

impl Default for LineOptions {
    /// Eight grey levels, a twentieth of the columns, a third of those with an echo.
    fn default() -> Self {
        Self { contrast_grey: 8.0, least_width: 0.05, least_share: 1.0 / 3.0 }
    }
}

/// A line in an image: at `column_px`, where it is known best, it passes through `row_px`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Mean of the columns it was seen in (px).
    pub column_px: f64,
    /// Its row there (px).
    pub row_px: f64,
    /// Rows per column.
    pub slope: f64,
    /// Standard deviation of the row there (px); echoes of neighbouring columns are not counted as independent.
    pub row_sd_px: f64,
    /// Standard deviation of the slope, independent of the row's.
    pub slope_sd: f64,
    /// Columns it was seen in, of those that were looked at.
    pub columns: usize,
    /// How far it stands out, on the average (grey levels).
    pub contrast_grey: f64,
}

impl Line {
    /// Its row at a column, and the standard deviation of it (px).
    pub fn at(&self, column_px: f64) -> (f64, f64) {
        let away = column_px - self.column_px;
        (self.row_px + self.slope * away, self.row_sd_px.hypot(self.slope_sd * away))
    }
}

/// The brightest straight line of an image of `width` columns (8-bit grey, row after row), at most 45 degrees from
/// level, among the pixels (column, row) that `inside` holds.
///
/// Every column gives its three highest peaks, so that neither a reverberation below nor a bar above hides the plane;
/// the line that gathers most brightness wins (Hough), and is fitted robustly (Tukey's biweight).
///
/// # Errors
/// [`NoLine`]: too few columns with an echo, echoes on no common line, or two lines that are as bright.
pub fn find_line(
    pixels: &[u8],
    (width, height): (usize, usize),
    inside: &dyn Fn(usize, usize) -> bool,
    options: &LineOptions,
) -> Result<Line, NoLine> {
    if width.checked_mul(height) != Some(pixels.len()) || pixels.is_empty() {
        return Err(NoLine::Size { width, height, bytes: pixels.len() });
    }
    let stride = (width / 400).max(1);
    let looked_at = width.div_ceil(stride);
    let columns = (0..width).step_by(stride);
    let found: Vec<Vec<Echo>> =
        columns.map(|c| echoes(pixels, (width, height), c, inside, options.contrast_grey)).collect();
    let with_echo = found.iter().filter(|f| !f.is_empty()).count();
    let needed = ((looked_at as f64 * options.least_width) as usize).max(15);
    if with_echo < needed {
        let contrast_grey = options.contrast_grey;
        return Err(NoLine::Dark { columns: with_echo, needed, contrast_grey });
    }
    let all = capped(found);
    let middle = width as f64 / 2.0;
    let first = brightest(&all, middle, height);
    let (on_it, rest) = first.split(&all);
    let support = Support::of(&on_it);
    let scattered = NoLine::Scattered { on_it: support.columns(), columns: with_echo };
    if support.columns() < needed || (support.columns() as f64) < options.least_share * with_echo as f64 {
        return Err(scattered);
    }
    let second = brightest(&rest, middle, height);
    let rival = Support::of(&second.split(&rest).0);
    let (brightness, columns) = (0.9 * support.brightness(), 0.7 * support.columns() as f64);
    if rival.brightness() > brightness && rival.columns() as f64 > columns {
        return Err(NoLine::TwoLines { first_row: first.row, second_row: second.row });
    }
    through(&support).ok_or(scattered)
}

/// All echoes, none brighter than half again the usual best one of a column: a few bright spots are no line.
fn capped(found: Vec<Vec<Echo>>) -> Vec<Echo> {
    let mut best: Vec<f64> = found.iter().filter_map(|f| Some(f.first()?.contrast)).collect();
    best.sort_by(f64::total_cmp);
    let cap = 1.5 * best.get(best.len() / 2).copied().unwrap_or_default();
    found.into_iter().flatten().map(|e| Echo { contrast: e.contrast.min(cap), ..e }).collect()
}

#[cfg(test)]
mod tests;
