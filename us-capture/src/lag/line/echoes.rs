//! The echoes of one column.

/// A peak of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    pub column: f64,
    /// To a fraction of a pixel.
    pub row: f64,
    /// Grey levels over the column's middle.
    pub contrast: f64,
}

/// Peaks taken from one column.
const MOST: usize = 3;
/// The peak's place is the centre of what is brighter than this part of it: a saturated echo has no top.
const TOP: f64 = 0.8;

/// The highest peaks of a column, brightest first.
pub(super) fn echoes(
    pixels: &[u8],
    (width, height): (usize, usize),
    column: usize,
    inside: &dyn Fn(usize, usize) -> bool,
    contrast: f64,
) -> Vec<Echo> {
    let raw: Vec<f64> = (0..height)
        .map(|row| {
            let pixel = pixels.get(row * width + column).filter(|_| inside(column, row));
            pixel.map_or(f64::NAN, |p| f64::from(*p))
        })
        .collect();
    let middle = median(&raw);
    // Outside the mask there is what a column shows without an echo.
    let filled: Vec<f64> = raw.iter().map(|g| if g.is_nan() { middle } else { *g }).collect();
    let smooth = box_mean(&box_mean(&filled));
    let is_peak = |w: &[f64]| w[1] > w[0] && w[1] >= w[2] && w[1] - middle >= contrast;
    let mut peaks: Vec<usize> =
        smooth.windows(3).enumerate().filter(|(_, w)| is_peak(w)).map(|(i, _)| i + 1).collect();
    peaks.retain(|row| inside(column, *row));
    peaks.sort_by(|a, b| smooth[*b].total_cmp(&smooth[*a]));
    peaks.truncate(MOST);
    let echo = |row: usize| Echo {
        column: column as f64,
        row: centre(&smooth, row, middle),
        contrast: smooth[row] - middle,
    };
    peaks.into_iter().map(echo).collect()
}

fn median(raw: &[f64]) -> f64 {
    let mut there: Vec<f64> = raw.iter().copied().filter(|g| !g.is_nan()).collect();
    let half = there.len() / 2;
    if there.is_empty() { 0.0 } else { *there.select_nth_unstable_by(half, f64::total_cmp).1 }
}

/// Mean over five rows; two of them are a Gaussian of two pixels to within what matters here.
fn box_mean(values: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let at = |i: usize, off: isize| values[i.saturating_add_signed(off).min(last)];
    (0..values.len()).map(|i| (-2..=2).map(|off| at(i, off)).sum::<f64>() / 5.0).collect()
}

/// Centre of the top around a peak.
fn centre(smooth: &[f64], peak: usize, floor: f64) -> f64 {
    let level = floor + TOP * (smooth[peak] - floor);
    let above = |i: &usize| smooth[*i] > level;
    let up = (0..=peak).rev().take_while(above);
    let down = (peak + 1..smooth.len()).take_while(above);
    let (sum, mass) = up.chain(down).fold((0.0, 0.0), |(sum, mass), i| {
        let weight = smooth[i] - level;
        (sum + weight * i as f64, mass + weight)
    });
    if mass > 0.0 { sum / mass } else { peak as f64 }
}
