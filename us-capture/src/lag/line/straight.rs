//! The straight line through echoes.

use super::super::uncertainty::long_run_variance;
use super::Line;
use super::echoes::Echo;

/// A line as the search knows it: its row in the image's middle column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rough {
    middle: f64,
    pub row: f64,
    slope: f64,
}

/// Height of a cell of the search (px).
const CELL_PX: f64 = 3.0;
/// Echoes this near (px) belong to a line.
const NEAR_PX: f64 = 6.0;
/// Steepest line.
const STEEPEST: f64 = 1.0;
/// The least that a position can be believed to (px).
const LEAST_SD_PX: f64 = 0.02;

/// The line that gathers most brightness (Hough).
pub(super) fn brightest(echoes: &[Echo], middle: f64, height: usize) -> Rough {
    // Lines of neighbouring slopes are one cell apart at the image's sides.
    let steps = (STEEPEST * middle / CELL_PX).ceil().max(1.0);
    // Up to 45 degrees, a line that is seen at all passes the middle column within half a width of the image.
    let cells = ((height as f64 + 2.0 * middle) / CELL_PX).ceil() as usize + 2;
    let mut best = (0.0, Rough { middle, row: 0.0, slope: 0.0 });
    let mut gathered = vec![0.0; cells];
    for step in -(steps as i64)..=steps as i64 {
        let slope = step as f64 * STEEPEST / steps;
        gathered.fill(0.0);
        for echo in echoes {
            let cell = (echo.row - slope * (echo.column - middle) + middle) / CELL_PX;
            if let Some(cell) = gathered.get_mut(cell.max(0.0) as usize) {
                *cell += echo.contrast;
            }
        }
        for (i, pair) in gathered.windows(2).enumerate() {
            if pair[0] + pair[1] > best.0 {
                let row = (i as f64 + 1.0) * CELL_PX - middle;
                best = (pair[0] + pair[1], Rough { middle, row, slope });
            }
        }
    }
    best.1
}

impl Rough {
    /// The echoes on it, and the others.
    pub fn split(&self, echoes: &[Echo]) -> (Vec<Echo>, Vec<Echo>) {
        let off = |e: &Echo| e.row - self.row - self.slope * (e.column - self.middle);
        echoes.iter().partition(|e| off(e).abs() <= NEAR_PX)
    }
}

/// One echo a column: the brightest of those on the line.
pub(super) struct Support(Vec<Echo>);

impl Support {
    /// Of the echoes near a line, column after column.
    pub fn of(echoes: &[Echo]) -> Self {
        let mut one_a_column: Vec<Echo> = Vec::new();
        for echo in echoes {
            match one_a_column.last_mut().filter(|last| last.column.to_bits() == echo.column.to_bits()) {
                Some(last) if last.contrast < echo.contrast => *last = *echo,
                Some(_) => {}
                None => one_a_column.push(*echo),
            }
        }
        Self(one_a_column)
    }

    /// Columns that show the line.
    pub const fn columns(&self) -> usize {
        self.0.len()
    }

    /// All its contrast.
    pub fn brightness(&self) -> f64 {
        self.0.iter().map(|e| e.contrast).sum()
    }
}

/// A weighted fit.
struct Fitted {
    column: f64,
    row: f64,
    slope: f64,
    mass: f64,
    spread: f64,
}

/// The line through these echoes, outliers weighted down (Tukey's biweight on the median absolute deviation).
/// `None` when they do not spread over columns.
pub(super) fn through(support: &Support) -> Option<Line> {
    let echoes = &support.0;
    let mut weights = vec![1.0; echoes.len()];
    let mut fitted = fit(echoes, &weights)?;
    let mut limit = f64::INFINITY;
    for _ in 0..20 {
        limit = 4.685 * spread(echoes, &fitted).max(0.1);
        for (weight, echo) in weights.iter_mut().zip(echoes) {
            let off = fitted.off(echo) / limit;
            *weight = (1.0 - off * off).max(0.0).powi(2);
        }
        fitted = fit(echoes, &weights)?;
    }
    Some(line(echoes, limit, &fitted))
}

fn fit(echoes: &[Echo], weights: &[f64]) -> Option<Fitted> {
    let both = || echoes.iter().zip(weights);
    let mass: f64 = weights.iter().sum();
    let column = both().map(|(e, w)| w * e.column).sum::<f64>() / mass;
    let row = both().map(|(e, w)| w * e.row).sum::<f64>() / mass;
    let spread: f64 = both().map(|(e, w)| w * (e.column - column).powi(2)).sum();
    let slope = both().map(|(e, w)| w * (e.column - column) * (e.row - row)).sum::<f64>() / spread;
    (slope.is_finite() && row.is_finite()).then_some(Fitted { column, row, slope, mass, spread })
}

impl Fitted {
    fn off(&self, echo: &Echo) -> f64 {
        echo.row - self.row - self.slope * (echo.column - self.column)
    }
}

/// Robust standard deviation about the line (px).
fn spread(echoes: &[Echo], fitted: &Fitted) -> f64 {
    let mut off: Vec<f64> = echoes.iter().map(|e| fitted.off(e).abs()).collect();
    off.sort_by(f64::total_cmp);
    1.4826 * off.get(off.len() / 2).copied().unwrap_or_default()
}

/// The line with its errors: what its equations scatter by, over how steeply they stand (the sandwich of M-estimators,
/// Huber 1967). Speckle and a rough plane make neighbouring columns err together, so the scatter is that of sums along
/// the columns. Without the sandwich the stated variance is two thirds of the true one.
fn line(echoes: &[Echo], limit: f64, fitted: &Fitted) -> Line {
    let offs = echoes.iter().map(|e| fitted.off(e)).filter(|off| off.abs() < limit);
    let parts: Vec<(f64, f64)> = offs.map(|off| (off, (off / limit).powi(2))).collect();
    let pulls: Vec<f64> = parts.iter().map(|(off, square)| off * (1.0 - square).powi(2)).collect();
    let steep: f64 = parts.iter().map(|(_, square)| (1.0 - square) * (1.0 - 5.0 * square)).sum();
    let (n, together) = (pulls.len() as f64, long_run_variance(&pulls));
    let alone = pulls.iter().map(|pull| pull * pull).sum::<f64>();
    // The line leans to its echoes, and the more the fewer of them are independent.
    let leaning = if alone > 0.0 { (2.0 * together / alone).clamp(0.0, 0.5) } else { 0.0 };
    let row_sd_px = (n * together.max(0.0)).sqrt() / (steep.max(0.25 * n) * (1.0 - leaning));
    let slope_sd = row_sd_px * (fitted.mass / fitted.spread).sqrt();
    Line {
        column_px: fitted.column,
        row_px: fitted.row,
        slope: fitted.slope,
        row_sd_px: row_sd_px.max(LEAST_SD_PX),
        slope_sd: slope_sd.max(LEAST_SD_PX / fitted.spread.sqrt()),
        columns: parts.len(),
        contrast_grey: echoes.iter().map(|e| e.contrast).sum::<f64>() / echoes.len() as f64,
    }
}
