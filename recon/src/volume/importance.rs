//! What each part of an image counts.

use serde::{Deserialize, Serialize};

use super::VolumeError;

/// A table of weights stretched over every image: the centre more than the edges, the depth where the focus is more
/// than the rest, nothing where the screen has its text. A pixel takes the weight of the cell it lies in; 0 is not used.
///
/// It is data: in a file it is `columns`, `rows` and `weights`, row after row from the probe down.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Importance {
    /// Cells across the image.
    pub columns: usize,
    /// Cells down the image.
    pub rows: usize,
    /// Weights of the cells, row after row.
    pub weights: Vec<u8>,
}

impl Importance {
    /// Full weight along the middle column, falling to `edge` at the sides.
    pub fn of_the_middle(edge: u8) -> Self {
        let columns = 32_usize;
        let from_middle = |column: usize| (2 * column).abs_diff(columns - 1) as f64 / (columns - 1) as f64;
        let weight = |column| 255.0 + (f64::from(edge) - 255.0) * from_middle(column);
        let weights = (0..columns).map(|column| weight(column).round() as u8).collect();
        Self { columns, rows: 1, weights }
    }

    pub(super) fn check(&self) -> Result<(), VolumeError> {
        let cells = self.columns.checked_mul(self.rows);
        if cells != Some(self.weights.len()) || self.weights.iter().all(|weight| *weight == 0) {
            let (columns, rows, weights) = (self.columns, self.rows, self.weights.len());
            return Err(VolumeError::BadImportance { columns, rows, weights });
        }
        Ok(())
    }

    /// One weight for each pixel of an image.
    pub(super) fn over(&self, width: usize, height: usize) -> Vec<u8> {
        let cell = |row: usize, column: usize| {
            (row * self.rows / height.max(1)) * self.columns + column * self.columns / width.max(1)
        };
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
        pixels.map(|(row, column)| self.weights.get(cell(row, column)).copied().unwrap_or(0)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_takes_the_weight_of_the_cell_it_lies_in() {
        let table = Importance { columns: 3, rows: 2, weights: vec![1, 2, 3, 4, 5, 6] };
        assert!(table.check().is_ok());
        assert_eq!(table.over(6, 2), [1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6]);
        assert_eq!(table.over(2, 3), [1, 2, 1, 2, 4, 5]);
    }

    #[test]
    fn the_middle_counts_most_and_both_sides_alike() {
        let table = Importance::of_the_middle(64);
        assert_eq!((table.weights[0], table.weights[31]), (64, 64));
        assert!(table.weights[15] == table.weights[16] && table.weights[15] > 245);
    }

    #[test]
    fn a_table_that_is_none_is_refused() {
        for (columns, rows, weights) in [(3, 2, vec![1; 5]), (2, 1, vec![0, 0]), (usize::MAX, 2, vec![1])] {
            assert!(Importance { columns, rows, weights }.check().is_err());
        }
    }
}
