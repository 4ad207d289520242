//! The part of a B-scan round a vessel, with the log compression undone.

use probepath_us_capture::BScan;

/// What a grey level stands for: echo power, relative to grey 255.
#[derive(Clone, Debug)]
pub(crate) struct PowerOfGrey {
    double: [f64; 256],
    single: [f32; 256],
}

impl PowerOfGrey {
    /// For a machine that shows `dynamic_range_db` between grey 0 and 255.
    pub(crate) fn new(dynamic_range_db: f64) -> Self {
        let power = |grey: usize| 10_f64.powf(dynamic_range_db * (grey as f64 / 255.0 - 1.0) / 10.0);
        Self { double: std::array::from_fn(power), single: std::array::from_fn(|grey| power(grey) as f32) }
    }

    /// The power of a pixel.
    pub(crate) fn of(&self, grey: u8) -> f64 {
        self.double[usize::from(grey)]
    }

    /// The same in single precision.
    pub(crate) fn single(&self, grey: u8) -> f32 {
        self.single[usize::from(grey)]
    }
}

/// Mean echo power in cells of whole pixels. Lengths in metres, places from the centre of the B-scan's first pixel.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// Cells along a row.
    pub(crate) columns: usize,
    /// Cells along a column.
    pub(crate) rows: usize,
    /// Size of a cell along x and y.
    pub(crate) cell: (f64, f64),
    /// Centre of the first cell.
    pub(crate) origin: (f64, f64),
    /// Mean power, row after row.
    pub(crate) power: Vec<f32>,
}

impl Patch {
    /// The cells within `half` (m, along x and y) of `centre`, cut at the B-scan's edges, each about `cell` (m) in
    /// size. Nothing when less than 4 x 4 cells are inside.
    pub(crate) fn around(
        bscan: &BScan,
        table: &PowerOfGrey,
        centre: (f64, f64),
        half: (f64, f64),
        cell: (f64, f64),
    ) -> Option<Self> {
        let spacing = bscan.setting.spacing;
        let (x0, pixels_x, columns) = cells(centre.0, half.0, cell.0, spacing.x_m, bscan.width())?;
        let (y0, pixels_y, rows) = cells(centre.1, half.1, cell.1, spacing.y_m, bscan.height())?;
        let mut power = vec![0.0; columns * rows];
        for y in 0..rows * pixels_y {
            let start = (y0 + y) * bscan.width() + x0;
            let line = bscan.pixels().get(start..start + columns * pixels_x)?;
            let out = &mut power[y / pixels_y * columns..][..columns];
            for (sum, pixels) in out.iter_mut().zip(line.chunks_exact(pixels_x)) {
                *sum += pixels.iter().map(|&grey| table.single(grey)).sum::<f32>();
            }
        }
        let scale = 1.0 / (pixels_x * pixels_y) as f32;
        power.iter_mut().for_each(|sum| *sum *= scale);
        let first = |x0: usize, pixels: usize| x0 as f64 + (pixels as f64 - 1.0) / 2.0;
        Some(Self {
            columns,
            rows,
            cell: (pixels_x as f64 * spacing.x_m, pixels_y as f64 * spacing.y_m),
            origin: (first(x0, pixels_x) * spacing.x_m, first(y0, pixels_y) * spacing.y_m),
            power,
        })
    }

    /// Where the centre of a cell is.
    pub(crate) fn place(&self, cell: usize) -> (f64, f64) {
        let (column, row) = (cell % self.columns, cell / self.columns);
        (self.origin.0 + column as f64 * self.cell.0, self.origin.1 + row as f64 * self.cell.1)
    }

    /// The cell a place lies in.
    pub(crate) fn cell_at(&self, place: (f64, f64)) -> Option<usize> {
        let column = (place.0 - self.origin.0) / self.cell.0 + 0.5;
        let row = (place.1 - self.origin.1) / self.cell.1 + 0.5;
        let inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// The cells whose centres are within `reach` (m) of a place.
    pub(crate) fn within(&self, place: (f64, f64), reach: f64) -> impl Iterator<Item = usize> {
        let span = |at: f64, origin: f64, cell: f64, count: usize| {
            let first = ((at - reach - origin) / cell).ceil().max(0.0) as usize;
            let last = ((at + reach - origin) / cell).floor();
            first..if last < 0.0 { 0 } else { (last as usize + 1).min(count) }
        };
        let rows = span(place.1, self.origin.1, self.cell.1, self.rows);
        let columns = span(place.0, self.origin.0, self.cell.0, self.columns);
        let cells = rows.flat_map(move |row| columns.clone().map(move |column| row * self.columns + column));
        cells.filter(move |&cell| {
            let at = self.place(cell);
            let (dx, dy) = (at.0 - place.0, at.1 - place.1);
            dx * dx + dy * dy <= reach * reach
        })
    }

    /// The power smoothed by Gaussians of these standard deviations (m).
    pub(crate) fn smoothed(&self, sigma: (f64, f64)) -> Vec<f32> {
        let mut blur = Blur::new(self.columns, self.rows, (sigma.0 / self.cell.0, sigma.1 / self.cell.1));
        blur.apply(&self.power)
    }
}

/// First pixel, pixels a cell, and cells along one axis.
fn cells(centre: f64, half: f64, cell: f64, spacing: f64, count: usize) -> Option<(usize, usize, usize)> {
    let first = ((centre - half) / spacing).round().max(0.0);
    let end = ((centre + half) / spacing).round().min(count as f64);
    let pixels = (cell / spacing).round().max(1.0) as usize;
    if first.is_nan() || end.is_nan() || end <= first {
        return None;
    }
    let number = (end - first) as usize / pixels;
    (number >= 4).then_some((first as usize, pixels, number))
}

/// A separable Gaussian blur of one grid, its edges repeated; it keeps its scratch for the next call.
pub(crate) struct Blur {
    columns: usize,
    taps: (Vec<f32>, Vec<f32>),
    between: Vec<f32>,
    line: Vec<f32>,
}

impl Blur {
    /// With standard deviations in cells.
    pub(crate) fn new(columns: usize, rows: usize, sigma: (f64, f64)) -> Self {
        let taps = (taps(sigma.0), taps(sigma.1));
        Self { columns, taps, between: vec![0.0; columns * rows], line: Vec::new() }
    }

    /// The blurred grid.
    pub(crate) fn apply(&mut self, field: &[f32]) -> Vec<f32> {
        let (columns, half) = (self.columns, self.taps.0.len() / 2);
        for (line, out) in field.chunks_exact(columns).zip(self.between.chunks_exact_mut(columns)) {
            self.line.clear();
            self.line.extend(std::iter::repeat_n(line[0], half));
            self.line.extend_from_slice(line);
            self.line.extend(std::iter::repeat_n(line[columns - 1], half));
            out.fill(0.0);
            for (k, tap) in self.taps.0.iter().enumerate() {
                out.iter_mut().zip(&self.line[k..]).for_each(|(sum, value)| *sum += tap * value);
            }
        }
        let (rows, half) = (field.len() / columns, self.taps.1.len() / 2);
        let mut result = vec![0.0; field.len()];
        for (row, out) in result.chunks_exact_mut(columns).enumerate() {
            for (k, tap) in self.taps.1.iter().enumerate() {
                let from = (row + k).saturating_sub(half).min(rows - 1);
                let line = &self.between[from * columns..][..columns];
                out.iter_mut().zip(line).for_each(|(sum, value)| *sum += tap * value);
            }
        }
        result
    }
}

/// Decibels of a power, to 0.01 dB: the exponent's bits are most of a logarithm.
pub(crate) fn decibel(power: f32) -> f32 {
    let bits = power.max(1e-9).to_bits();
    let exponent = (bits >> 23) as f32 - 127.0;
    let m = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000);
    // log2 of a number from 1 to 2 by the series of its area tangent.
    let t = (m - std::f32::consts::SQRT_2) / (m + std::f32::consts::SQRT_2);
    let log2 = 0.5 + t * (2.885_39 + t * t * 0.961_796_7);
    10.0 * std::f32::consts::LOG10_2 * (exponent + log2)
}

/// A Gaussian of unit sum. Cells are means already, so it is sampled, not integrated over a cell once more.
fn taps(sigma: f64) -> Vec<f32> {
    if sigma.is_nan() || sigma < 0.05 {
        return vec![1.0];
    }
    let half = (3.2 * sigma).ceil() as i64;
    let taps: Vec<f64> =
        (-half..=half).map(|k| (-(k as f64).powi(2) / (2.0 * sigma * sigma)).exp()).collect();
    let sum: f64 = taps.iter().sum();
    taps.iter().map(|tap| (tap / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_keeps_the_sum_and_has_its_variance() {
        let (columns, rows) = (41, 31);
        let mut field = vec![0.0; columns * rows];
        field[15 * columns + 20] = 1.0;
        let out = Blur::new(columns, rows, (2.0, 1.2)).apply(&field);
        let sum: f64 = out.iter().map(|v| f64::from(*v)).sum();
        let vx: f64 =
            out.iter().enumerate().map(|(i, v)| f64::from(*v) * ((i % columns) as f64 - 20.0).powi(2)).sum();
        let vy: f64 =
            out.iter().enumerate().map(|(i, v)| f64::from(*v) * ((i / columns) as f64 - 15.0).powi(2)).sum();
        assert!((sum - 1.0).abs() < 1e-6);
        assert!((vx - 4.0).abs() < 0.05 && (vy - 1.44).abs() < 0.03, "{vx} {vy}");
    }

    #[test]
    fn decibels_are_ten_times_the_logarithm() {
        for k in 0..9000 {
            let power = 10_f64.powf(-0.001 * f64::from(k)) as f32;
            let exact = 10.0 * f64::from(power).log10();
            assert!((f64::from(decibel(power)) - exact).abs() < 0.01, "{power}");
        }
    }

    #[test]
    fn the_cells_within_a_reach_are_those_within_it() {
        let bscan =
            crate::phantom_images::Phantom { pixels: (60, 50), ..Default::default() }.bscan(0, 0.0).bscan;
        let table = PowerOfGrey::new(60.0);
        let patch =
            Patch::around(&bscan, &table, (20e-3, 15e-3), (20e-3, 15e-3), (1e-3, 1e-3)).expect("a patch");
        for (place, reach) in [((0.0, 0.0), 3e-3), ((20e-3, 14e-3), 5.2e-3), ((39e-3, -9e-3), 4e-3)] {
            let near = |cell: &usize| {
                let at = patch.place(*cell);
                (at.0 - place.0).hypot(at.1 - place.1) <= reach
            };
            let all: Vec<usize> = (0..patch.power.len()).filter(near).collect();
            assert_eq!(patch.within(place, reach).collect::<Vec<_>>(), all);
        }
    }

    #[test]
    fn grey_levels_are_decibels() {
        let table = PowerOfGrey::new(60.0);
        assert!((table.of(255) - 1.0).abs() < 1e-12 && (table.of(0) - 1e-6).abs() < 1e-15);
    }
}
