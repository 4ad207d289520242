//! [`Grid`]: where the echoes of scatterers are summed before the beam smears them.

use probepath_us_capture::Setting;

use super::beam::Beam;
use super::settings::{COLUMNS, ROWS};

/// Along the beam, samples are at most this far apart (m): a third of the sharpest spread's deviation.
const AXIAL_STEP_M: f64 = 0.05e-3;
/// Across it, nodes are about this far apart (m).
const LATERAL_STEP_M: f64 = 0.125e-3;
/// How far a spread reaches, in standard deviations.
const REACH_SIGMAS: f64 = 3.0;

/// Samples along the beam (rows of the grid) by nodes across it, wider than the picture by the spread's reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Distance between samples (m), and how many make a row of the picture.
    pub(super) axial_m: f64,
    pub(super) per_row: usize,
    /// Distance between nodes (m), and how many columns of the picture they span.
    pub(super) lateral_m: f64,
    pub(super) per_node: usize,
    /// Samples before the first row, nodes before the first column.
    pub(super) before: [usize; 2],
    pub(super) samples: usize,
    pub(super) nodes: usize,
    /// Nodes that the picture itself spans.
    pub(super) shown: usize,
}

impl Grid {
    pub(super) fn new(setting: &Setting, beam: &Beam) -> Self {
        let bottom = setting.window_top_m + setting.window_height_m;
        let widest = beam.widest(Beam::lateral, setting.window_top_m, bottom);
        let per_row = (setting.spacing.y_m / AXIAL_STEP_M).ceil().max(1.0) as usize;
        let per_node = ((LATERAL_STEP_M / setting.spacing.x_m).round() as usize).clamp(1, 16);
        let axial_m = setting.spacing.y_m / per_row as f64;
        let lateral_m = setting.spacing.x_m * per_node as f64;
        let reach = |sigma: f64, step: f64| (REACH_SIGMAS * sigma / step).ceil() as usize + 1;
        let before = [reach(beam.axial(), axial_m), reach(widest, lateral_m)];
        let shown = COLUMNS.div_ceil(per_node) + 1;
        Self {
            axial_m,
            per_row,
            lateral_m,
            per_node,
            before,
            samples: (ROWS - 1) * per_row + 1 + 2 * before[0],
            nodes: shown + 2 * before[1],
            shown,
        }
    }

    /// Place in the Image of sample 0 and node 0 (m): y and x.
    pub(super) fn origin(&self) -> [f64; 2] {
        [-(self.before[0] as f64) * self.axial_m, -(self.before[1] as f64) * self.lateral_m]
    }

    /// A Gaussian of deviation `sigma` over steps of `step`, cut at its reach, whose squares sum to one: white echoes
    /// keep their power.
    pub(super) fn kernel(sigma: f64, step: f64) -> Vec<f32> {
        let half = (REACH_SIGMAS * sigma / step).ceil() as i32;
        let weight = |i: i32| (-0.5 * (f64::from(i) * step / sigma).powi(2)).exp();
        let power: f64 = (-half..=half).map(|i| weight(i).powi(2)).sum();
        (-half..=half).map(|i| (weight(i) / power.sqrt()) as f32).collect()
    }
}
