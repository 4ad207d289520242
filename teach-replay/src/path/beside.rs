//! [`Beside`]: the way that came back beside the path.

use nalgebra::Vector3;

use crate::{PathError, Sample};

/// A hand that doubles back stays nearer than this (m) to what it did, across the probe's axis.
const APART: f64 = 0.004;
/// A longer way than this (m) further off is no doubling back.
const MOST: f64 = 0.02;
/// Steps in which the way is measured (m), so that tremor is none.
const STRIDE: f64 = 0.001;

/// The way on the skin that brought nothing forward and was not where the path is either.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Beside {
    /// How long it is (m).
    pub(super) length: f64,
    /// The furthest from the path, across the probe's axis (m).
    away: f64,
}

impl Beside {
    /// Of states, their steady places, and the nearest place of the line where they doubled back.
    pub(super) fn of<'a>(
        places: impl Iterator<Item = ((&'a Sample, Vector3<f64>), Option<Vector3<f64>>)>,
    ) -> Self {
        let (mut found, mut last) = (Self::default(), None::<Vector3<f64>>);
        for ((sample, place), line) in places {
            let away = line.map_or(0.0, |line| across(&(place - line), sample).norm());
            if away <= APART {
                last = None;
                continue;
            }
            let step = across(&(place - *last.get_or_insert(place)), sample).norm();
            if step >= STRIDE {
                found.length += step;
                last = Some(place);
            }
            found.away = found.away.max(away);
        }
        found
    }

    /// Refuses what would be lost silently.
    pub(super) fn check(&self) -> Result<(), PathError> {
        if self.length <= MOST {
            return Ok(());
        }
        Err(PathError::ComesBack { length_mm: self.length * 1e3, away_mm: self.away * 1e3 })
    }
}

/// What lies across the probe's axis: a hand presses now more, now less.
fn across(way: &Vector3<f64>, sample: &Sample) -> Vector3<f64> {
    let axis = sample.base_from_probe.z_axis().vector();
    way - axis * way.dot(&axis)
}
