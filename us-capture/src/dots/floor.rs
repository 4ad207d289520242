//! The floor: the grey level, block by block, that noise and speckle around a place do not exceed.

/// The floor is one level over so many columns and rows.
pub(super) const CELL: usize = 8;
/// Every how many pixels one is counted.
const EVERY: usize = 2;
/// How many times the distance from the median to the upper quartile the floor is above the median. The logarithm of
/// a Rayleigh amplitude exceeds it once in some ten thousand.
const ABOVE: u32 = 4;

/// The floor over an image.
pub(super) struct Floor {
    block: usize,
    wide: usize,
    levels: Vec<Option<u8>>,
    smooth: Vec<u8>,
    cells_wide: usize,
    cells: Vec<u8>,
    histogram: [u32; 256],
}

impl Floor {
    pub(super) fn new(width: usize, height: usize, block: usize) -> Self {
        let (wide, high) = (width.div_ceil(block), height.div_ceil(block));
        Self {
            block,
            wide,
            levels: vec![None; wide * high],
            smooth: vec![0; wide * high],
            cells_wide: width.div_ceil(CELL),
            cells: vec![0; width.div_ceil(CELL) * height.div_ceil(CELL)],
            histogram: [0; 256],
        }
    }

    /// Lays the floor under an image; `inside` is not zero where it is looked at.
    pub(super) fn lay(&mut self, image: &[u8], inside: &[u8], width: usize, least: u8) {
        for index in 0..self.levels.len() {
            self.levels[index] = self.level(image, inside, width, index);
        }
        let high = self.levels.len() / self.wide;
        for index in 0..self.levels.len() {
            let median = self.median_around(index % self.wide, index / self.wide, high);
            self.smooth[index] = median.saturating_add(least);
        }
        for cell in 0..self.cells.len() {
            self.cells[cell] = self.between_blocks(cell);
        }
    }

    fn level(&mut self, image: &[u8], inside: &[u8], width: usize, index: usize) -> Option<u8> {
        let (left, top) = (index % self.wide * self.block, index / self.wide * self.block);
        let (right, bottom) = ((left + self.block).min(width), (top + self.block).min(image.len() / width));
        self.histogram.fill(0);
        for row in (top..bottom).step_by(EVERY) {
            let span = row * width + left..row * width + right;
            let pairs = image[span.clone()].iter().zip(&inside[span]).step_by(EVERY);
            pairs.filter(|(_, inside)| **inside != 0).for_each(|(p, _)| self.histogram[usize::from(*p)] += 1);
        }
        let count: u32 = self.histogram.iter().sum();
        let enough = count as usize * 8 * EVERY * EVERY >= self.block * self.block;
        enough.then(|| {
            let (median, upper) = (self.quantile(count / 2), self.quantile(count * 3 / 4));
            (median + ABOVE * (upper - median)).min(255) as u8
        })
    }

    /// The grey level below or at which more than `rank` pixels are.
    fn quantile(&self, rank: u32) -> u32 {
        let mut below = 0;
        let found = self.histogram.iter().position(|count| {
            below += count;
            below > rank
        });
        found.unwrap_or(255) as u32
    }

    /// A bar or a dot that fills one block does not raise the floor.
    fn median_around(&self, column: usize, row: usize, high: usize) -> u8 {
        let mut near = [0_u8; 9];
        let mut count = 0;
        for r in row.saturating_sub(1)..(row + 2).min(high) {
            for c in column.saturating_sub(1)..(column + 2).min(self.wide) {
                if let Some(level) = self.levels[r * self.wide + c] {
                    near[count] = level;
                    count += 1;
                }
            }
        }
        near[..count].sort_unstable();
        near.get(count.saturating_sub(1) / 2).copied().unwrap_or(0)
    }

    /// The floor in the cell at `column`, `row` (counted in cells).
    pub(super) fn cell(&self, column: usize, row: usize) -> u8 {
        self.cells[row * self.cells_wide + column]
    }

    /// The floor at a pixel.
    pub(super) fn at(&self, column: usize, row: usize) -> u8 {
        self.cell(column / CELL, row / CELL)
    }

    /// Between the blocks' centres the floor is straight.
    fn between_blocks(&self, cell: usize) -> u8 {
        let high = self.smooth.len() / self.wide;
        let (l, r, s) = self.around(cell % self.cells_wide, self.wide);
        let (a, b, t) = self.around(cell / self.cells_wide, high);
        let at = |row: usize, column: usize| f32::from(self.smooth[row * self.wide + column]);
        let side = |column: usize| at(a, column) + (at(b, column) - at(a, column)) * t;
        (side(l) + (side(r) - side(l)) * s) as u8
    }

    /// The blocks whose centres are before and after a cell's, and how far it is between them.
    fn around(&self, cell: usize, blocks: usize) -> (usize, usize, f32) {
        let place = ((cell as f32 + 0.5) * CELL as f32 / self.block as f32 - 0.5).max(0.0);
        let (first, last) = (place as usize, blocks - 1);
        (first.min(last), (first + 1).min(last), place.fract())
    }
}
