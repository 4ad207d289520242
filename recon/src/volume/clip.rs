//! Which pixels of an image are used: for every row, runs of columns.

use std::ops::Range;

use probepath_us_capture::plus::Fan;

use super::Region;

/// Runs of columns for the rows of an image of one size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Clip {
    pub(super) width: usize,
    pub(super) height: usize,
    runs: Vec<(usize, Range<usize>)>,
}

impl Clip {
    pub(super) fn of(region: &Region, width: usize, height: usize) -> Self {
        let (columns, rows) = match region.rectangle {
            None => (0..width, 0..height),
            Some(r) => {
                let within =
                    |at: usize, size: usize, limit: usize| at.min(limit)..at.saturating_add(size).min(limit);
                (within(r.origin[0], r.size[0], width), within(r.origin[1], r.size[1], height))
            }
        };
        let runs = rows.flat_map(|row| runs_of(region.fan.as_ref(), columns.clone(), row)).collect();
        Self { width, height, runs }
    }

    /// Rows with their runs, from the top.
    pub(super) fn runs(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        self.runs.iter().cloned()
    }

    /// The columns and rows between which all runs lie; `None` when nothing is left.
    pub(super) fn bounds(&self) -> Option<(Range<usize>, Range<usize>)> {
        let (first, last) = (self.runs.first()?.0, self.runs.last()?.0);
        let left = self.runs.iter().map(|(_, run)| run.start).min()?;
        let right = self.runs.iter().map(|(_, run)| run.end).max()?;
        Some((left..right, first..last + 1))
    }
}

/// The runs of one row.
fn runs_of(fan: Option<&Fan>, columns: Range<usize>, row: usize) -> Vec<(usize, Range<usize>)> {
    let Some(fan) = fan else {
        return if columns.is_empty() { Vec::new() } else { vec![(row, columns)] };
    };
    let mut runs: Vec<(usize, Range<usize>)> = Vec::new();
    for column in columns.filter(|column| inside(fan, *column as f64, row as f64)) {
        match runs.last_mut() {
            Some((_, run)) if run.end == column => run.end += 1,
            _ => runs.push((row, column..column + 1)),
        }
    }
    runs
}

fn inside(fan: &Fan, column: f64, row: f64) -> bool {
    let (x, y) = (column - fan.origin_px[0], row - fan.origin_px[1]);
    let angle = x.atan2(y);
    let in_arc = fan.radius_px.is_none_or(|arc| (arc.start..=arc.stop).contains(&x.hypot(y)));
    in_arc && (fan.angles_rad[0]..=fan.angles_rad[1]).contains(&angle)
}
