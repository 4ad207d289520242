//! The settings of the paper's machine.

use probepath_us_capture::{PixelSpacing, Setting};

/// Columns of a B-scan.
pub const COLUMNS: usize = 640;
/// Rows of a B-scan.
pub const ROWS: usize = 480;
/// Length of the array (m): no picture is wider.
pub const ARRAY_M: f64 = 0.040;

/// The whole depth, as wide as the array. Focus: the middle of the machine's range.
pub fn whole_depth(depth_m: f64, focus_m: f64) -> Setting {
    window(depth_m, focus_m, 0.0, depth_m, ARRAY_M)
}

/// A zoom window `height_m` high around `middle_m` of depth, in square pixels while the array is wide enough.
pub fn zoomed(depth_m: f64, focus_m: f64, height_m: f64, middle_m: f64) -> Setting {
    let width = (height_m * COLUMNS as f64 / ROWS as f64).min(ARRAY_M);
    let top = (middle_m - height_m / 2.0).clamp(0.0, (depth_m - height_m).max(0.0));
    window(depth_m, focus_m, top, height_m, width)
}

fn window(depth_m: f64, focus_m: f64, top_m: f64, height_m: f64, width_m: f64) -> Setting {
    Setting {
        depth_m,
        focus_m,
        window_top_m: top_m,
        window_height_m: height_m,
        window_width_m: width_m,
        spacing: PixelSpacing { x_m: width_m / COLUMNS as f64, y_m: height_m / ROWS as f64 },
    }
}

/// The ten settings of [P1]'s tables I and II, by their names there. The vessel's axis is 34 mm deep, in the middle of
/// every zoom window.
pub fn paper() -> Vec<(&'static str, Setting)> {
    const AXIS_M: f64 = 0.034;
    let zoom = |height_m| zoomed(0.07, 0.045, height_m, AXIS_M);
    vec![
        ("depth 5 cm", whole_depth(0.05, 0.045)),
        ("depth 6 cm", whole_depth(0.06, 0.045)),
        ("depth 7 cm", whole_depth(0.07, 0.045)),
        ("depth 8 cm", whole_depth(0.08, 0.045)),
        ("focus 2-4 cm", whole_depth(0.07, 0.030)),
        ("focus 4-5 cm", whole_depth(0.07, 0.045)),
        ("focus 5-7 cm", whole_depth(0.07, 0.060)),
        ("zoom 2:7", zoom(0.02)),
        ("zoom 3:7", zoom(0.03)),
        ("zoom 4:7", zoom(0.04)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_window_lies_within_the_depth_and_holds_the_vessel() {
        for (name, setting) in paper() {
            let bottom = setting.window_top_m + setting.window_height_m;
            assert!(setting.window_top_m >= 0.0 && bottom <= setting.depth_m + 1e-12, "{name}");
            assert!(setting.window_top_m < 0.029 && bottom > 0.039, "{name}");
            assert!((setting.spacing.y_m * 480.0 - setting.window_height_m).abs() < 1e-12, "{name}");
        }
        let widths: Vec<f64> = paper()[7..].iter().map(|(_, s)| s.window_width_m).collect();
        assert!(
            widths.iter().zip([0.08 / 3.0, 0.04, 0.04]).all(|(w, expected)| (w - expected).abs() < 1e-12)
        );
    }
}
