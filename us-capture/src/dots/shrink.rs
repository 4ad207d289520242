//! The image as it is searched: smoothed a little, and no larger than needed.

/// More pixels than this are searched in blocks of 2x2, 3x3, ... (centres are still taken from the whole image).
const MOST: usize = 700_000;

/// How many pixels of the image, in each direction, one of the searched image stands for.
pub(super) fn factor(width: usize, height: usize) -> usize {
    (1..).find(|k| width.div_ceil(*k) * height.div_ceil(*k) <= MOST).unwrap_or(1)
}

/// Fills `small` with the image, blocks averaged; or smoothed by (1 2 1)/4 both ways where nothing is averaged.
pub(super) fn shrink(pixels: &[u8], width: usize, k: usize, small: &mut [u8], sums: &mut Vec<u16>) {
    let wide = width.div_ceil(k);
    if k > 1 {
        for (to, rows) in small.chunks_exact_mut(wide).zip(pixels.chunks(width * k)) {
            average(rows, width, k, to);
        }
        return;
    }
    let rows = pixels.len() / width;
    sums.resize(width, 0);
    for (row, to) in small.chunks_exact_mut(width).enumerate() {
        let at = |row: usize| &pixels[row * width..(row + 1) * width];
        smooth([at(row.saturating_sub(1)), at(row), at((row + 1).min(rows - 1))], sums, to);
    }
}

fn average(rows: &[u8], width: usize, k: usize, to: &mut [u8]) {
    for (column, to) in to.iter_mut().enumerate() {
        let (first, last) = (column * k, ((column + 1) * k).min(width));
        let blocks = rows.chunks_exact(width).map(|row| &row[first..last]);
        let (sum, count) = blocks.flatten().fold((0_u32, 0_u32), |(sum, n), p| (sum + u32::from(*p), n + 1));
        *to = (sum / count.max(1)) as u8;
    }
}

fn smooth([above, row, below]: [&[u8]; 3], sums: &mut [u16], to: &mut [u8]) {
    for (((sum, a), r), b) in sums.iter_mut().zip(above).zip(row).zip(below) {
        *sum = u16::from(*a) + 2 * u16::from(*r) + u16::from(*b);
    }
    let width = to.len();
    for ((to, w), _) in to[1..width - 1].iter_mut().zip(sums.windows(3)).zip(0..width) {
        *to = ((w[0] + 2 * w[1] + w[2] + 8) / 16) as u8;
    }
    to[0] = ((3 * sums[0] + sums[1] + 8) / 16) as u8;
    to[width - 1] = ((3 * sums[width - 1] + sums[width - 2] + 8) / 16) as u8;
}
