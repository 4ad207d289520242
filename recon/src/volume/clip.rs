//! Which pixels of an image are used: for every row, runs of columns.

use std::ops::Range;

use probepath_us_capture::plus::Fan;

use super::{Importance, Region};

/// Runs of columns for the rows of an image of one size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Clip {
    width: usize,
    height: usize,
    runs: Vec<(usize, Range<usize>)>,
    /// For every row the first of its runs, and the end of the last row's.
    first: Vec<usize>,
    /// Importance of every pixel, when they differ.
    weights: Option<Vec<u8>>,
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
        let runs: Vec<_> = rows.flat_map(|row| runs_of(region.fan.as_ref(), columns.clone(), row)).collect();
        let first = (0..=height).map(|row| runs.partition_point(|(at, _)| *at < row)).collect();
        Self { width, height, runs, first, weights: None }
    }

    /// The number of the clip for images of this size, made when there is none yet.
    pub(super) fn number(
        clips: &mut Vec<Self>,
        (width, height): (usize, usize),
        make: impl FnOnce(usize, usize) -> Self,
    ) -> usize {
        let known = clips.iter().position(|clip| (clip.width, clip.height) == (width, height));
        known.unwrap_or_else(|| {
            clips.push(make(width, height));
            clips.len() - 1
        })
    }

    /// With the importance of every pixel.
    pub(super) fn weighted(self, importance: Option<&Importance>) -> Self {
        let weights = importance.map(|table| table.over(self.width, self.height));
        Self { weights, ..self }
    }

    /// The importance of some pixels.
    pub(super) fn weights(&self, pixels: Range<usize>) -> Option<&[u8]> {
        self.weights.as_ref()?.get(pixels)
    }

    /// Whether the pixel nearest to a place is used, and counts anything.
    pub(super) fn holds(&self, column: f64, row: f64) -> bool {
        let (column, row) = (column + 0.5, row + 0.5);
        if !(column >= 0.0 && row >= 0.0 && row < self.height as f64) {
            return false;
        }
        let (column, row) = (column as u32 as usize, row as u32 as usize);
        let runs = match (self.first.get(row), self.first.get(row + 1)) {
            (Some(first), Some(end)) => self.runs.get(*first..*end).unwrap_or_default(),
            _ => &[],
        };
        let counts =
            |weights: &Vec<u8>| weights.get(row * self.width + column).is_some_and(|weight| *weight > 0);
        runs.iter().any(|(_, run)| run.contains(&column)) && self.weights.as_ref().is_none_or(counts)
    }

    /// The places that are used, along columns and rows, where they are a rectangle and all count alike.
    pub(super) fn rectangle(&self) -> Option<[Range<f64>; 2]> {
        let (columns, rows) = self.bounds()?;
        let alike = self.weights.is_none()
            && self.runs.len() == rows.len()
            && self.runs.iter().all(|(_, run)| *run == columns);
        // Pixels have a size: half of one round their centres.
        alike.then(|| [columns, rows].map(|range| range.start as f64 - 0.5..range.end as f64 - 0.5))
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

/// The runs of one row: none, one, or two where the transducer's face is between them.
fn runs_of(fan: Option<&Fan>, columns: Range<usize>, row: usize) -> Vec<(usize, Range<usize>)> {
    let runs = match fan {
        None => vec![columns],
        Some(fan) => fan_runs(fan, columns, row as f64 - fan.origin_px[1]),
    };
    runs.into_iter().filter(|run| !run.is_empty()).map(|run| (row, run)).collect()
}

/// The columns inside a fan, `y` rows below its apex: with a margin of one column at its sides and its far arc, where
/// the picture fades into the screen, and one column into the near arc, all as PLUS's
/// (vtkIGSIOPasteSliceIntoVolumeHelperOptimized; its references correlate at 0.991 with the margin, 0.984 without).
fn fan_runs(fan: &Fan, columns: Range<usize>, y: f64) -> Vec<Range<usize>> {
    if y < 0.0 {
        return Vec::new();
    }
    let apex = fan.origin_px[0];
    let sides = fan.angles_rad.map(|angle| y * angle.tan());
    let mut inside = between(&columns, apex + sides[0] + 1.0, apex + sides[1] - 1.0);
    let Some(arc) = fan.radius_px else { return vec![inside] };
    let half_width = |radius: f64| (radius * radius - y * y).max(-1.0).sqrt();
    let far = half_width(arc.stop);
    // NaN where the row lies beyond the arc.
    if far.is_nan() {
        return Vec::new();
    }
    inside = between(&inside, apex - far + 1.0, apex + far - 1.0);
    let near = half_width(arc.start);
    if near.is_nan() || near < 1.0 {
        return vec![inside];
    }
    let face = between(&columns, apex - near + 1.0, apex + near - 1.0);
    if face.is_empty() {
        return vec![inside];
    }
    vec![inside.start..inside.end.min(face.start), inside.start.max(face.end)..inside.end]
}

/// The whole columns of a run from `low` to `high`, both included.
fn between(run: &Range<usize>, low: f64, high: f64) -> Range<usize> {
    let low = (low.ceil().max(0.0) as usize).max(run.start);
    let high = ((high.floor() + 1.0).max(0.0) as usize).min(run.end);
    low..high.max(low)
}

#[cfg(test)]
mod tests {
    use probepath_us_capture::plus::FanArc;

    use super::*;

    #[test]
    fn a_fan_holds_the_pixels_between_its_angles_and_arcs() {
        let fan = Fan {
            origin_px: [40.0, -5.0],
            angles_rad: [-0.6, 0.5],
            radius_px: Some(FanArc { start: 20.0, stop: 60.0 }),
        };
        let clip = Clip::of(&Region { rectangle: None, fan: Some(fan) }, 80, 70);
        let mut used = vec![false; 80 * 70];
        for (row, run) in clip.runs() {
            run.for_each(|column| used[row * 80 + column] = true);
        }
        for (index, used) in used.into_iter().enumerate() {
            let (x, y) = ((index % 80) as f64 - 40.0, (index / 80) as f64 + 5.0);
            let (angle, radius) = (x.atan2(y), x.hypot(y));
            // A pixel clearly inside is used, a pixel clearly outside is not; the margin is under two pixels.
            let slack = 2.0 / radius;
            let inside = angle > -0.6 + slack && angle < 0.5 - slack && radius > 20.0 && radius < 57.0;
            let outside = !(-0.6..=0.5).contains(&angle) || !(18.0..=60.0).contains(&radius);
            let right = if used { !outside } else { !inside };
            assert!(right, "{x} {y}: {used}");
        }
    }

    #[test]
    fn a_rectangle_holds_what_its_runs_hold() {
        let rectangle = Some(probepath_us_capture::plus::Rectangle { origin: [7, 3], size: [20, 11] });
        let clip = Clip::of(&Region { rectangle, fan: None }, 40, 30);
        let [columns, rows] = clip.rectangle().unwrap_or_default();
        let mut held = 0;
        for (u, v) in (-8..170).flat_map(|u| (-8..130).map(move |v| (f64::from(u) / 4.0, f64::from(v) / 4.0)))
        {
            let inside = columns.contains(&u) && rows.contains(&v);
            assert_eq!(inside, clip.holds(u, v), "{u} {v}");
            held += usize::from(inside);
        }
        assert_eq!(held, 20 * 4 * 11 * 4);
        let fan = Fan { origin_px: [20.0, -5.0], angles_rad: [-0.6, 0.5], radius_px: None };
        assert!(Clip::of(&Region { rectangle: None, fan: Some(fan) }, 40, 30).rectangle().is_none());
    }
}
