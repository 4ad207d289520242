//! How large a speckle grain is, read from the images.

use super::super::{Slice, VolumeSettings};

/// The standard deviation of the logarithm of fully developed speckle (dB).
const SPECKLE_DB: f64 = 5.57;
/// Grains are not looked for beyond this many pixels or images.
const FARTHEST: usize = 24;
/// What is less alike than this counts as unlike.
const UNLIKE: f64 = 0.1;
/// Differences beyond this are edges, not speckle (dB).
const EDGE_DB: f64 = 20.0;
/// About so many pairs are compared for each lag.
const PAIRS: usize = 40_000;

/// A grain, and how many pixels of each kind a voxel takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grain {
    /// Along columns, along rows, and in images; one at least.
    pub(super) px: [f64; 3],
    /// Pixels along columns and rows that fall into a voxel.
    voxel_px: [f64; 2],
}

impl Grain {
    pub(super) fn of(sweep: &[Slice<'_>], settings: &VolumeSettings, dynamic_range_db: f64) -> Self {
        let db = dynamic_range_db / 255.0;
        let px = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|axis| length(sweep, axis, db));
        let spacing = settings.grid.as_ref().map_or(settings.spacing_m, |grid| grid.spacing_m);
        let voxel = nalgebra::Vector3::from(spacing);
        let pixels = |step: nalgebra::Vector3<f64>| (1.0 / step.component_div(&voxel).norm()).max(1.0);
        let steps = sweep
            .first()
            .map_or([1.0; 2], |slice| [pixels(slice.map.column_step()), pixels(slice.map.row_step())]);
        Self { px, voxel_px: steps }
    }

    /// Looks of so many pixels in a voxel: the grains that fit into them along columns, rows, and from image to image,
    /// at least one along each. Less than a pixel is less than a look.
    pub(super) fn looks(&self, pixels: f64) -> f64 {
        let [across, down] = self.voxel_px;
        let images = pixels / (across * down);
        let grains =
            [across, down, images].into_iter().zip(self.px).map(|(count, grain)| (count / grain).max(1.0));
        pixels.min(1.0) * grains.product::<f64>()
    }
}

/// The sum of the correlation over all lags along an axis: the grain's length in pixels or images.
fn length(sweep: &[Slice<'_>], axis: [usize; 3], db: f64) -> f64 {
    let mut length = 1.0;
    for lag in 1..=FARTHEST {
        let Some(alike) = alike(sweep, axis.map(|step| step * lag), db) else { break };
        if alike < UNLIKE {
            break;
        }
        length += 2.0 * alike;
    }
    length
}

/// How alike pixels so far apart are, by their squared difference beside speckle's variance: slow changes of the tissue
/// cancel in it. `None` when there are none to compare.
fn alike(sweep: &[Slice<'_>], [column, row, image]: [usize; 3], db: f64) -> Option<f64> {
    let pixels: usize = sweep.iter().map(|slice| slice.pixels.len()).sum();
    // An odd stride does not keep to the columns of the usual widths.
    let stride = (pixels / PAIRS).max(1) | 1;
    let (mut sum, mut count) = (0.0, 0.0);
    for (number, slice) in sweep.iter().enumerate() {
        let Some(other) = sweep.get(number + image).filter(|other| other.width == slice.width) else {
            continue;
        };
        for at in (0..slice.pixels.len()).step_by(stride) {
            if at % slice.width + column >= slice.width {
                continue;
            }
            let two = (slice.pixels.get(at), other.pixels.get(at + row * slice.width + column));
            let (Some(one), Some(two)) = two else { continue };
            // Black and white are cut off by the compression, and say nothing of speckle.
            if !(1..255).contains(one) || !(1..255).contains(two) {
                continue;
            }
            let apart = ((f64::from(*one) - f64::from(*two)) * db).abs().min(EDGE_DB);
            sum += 0.5 * apart * apart;
            count += 1.0;
        }
    }
    (count > 0.0).then(|| 1.0 - sum / count / (SPECKLE_DB * SPECKLE_DB))
}
