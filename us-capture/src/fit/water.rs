//! How fast sound is in water, and what that does to the image.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use probepath_frames::{Image, Pose, Probe};

use crate::{PixelSpacing, Setting};

/// Coefficients of W. Marczak, "Water as a standard in the measurements of speed of sound in liquids", J. Acoust. Soc.
/// Am. 102 (1997) 2776: m/s over Celsius at atmospheric pressure, 0 to 95 degrees.
const MARCZAK: [f64; 6] = [1.402385e3, 5.038813, -5.799136e-2, 3.287156e-4, -1.398845e-6, 2.787860e-9];

/// Speed of sound in pure water (m/s) at `celsius` (0 to 95), after Marczak 1997.
pub fn speed_of_sound_in_water(celsius: f64) -> f64 {
    MARCZAK.iter().rev().fold(0.0, |sum, coefficient| sum * celsius + coefficient)
}

/// How much faster a degree makes it (m/s per Celsius).
pub(super) fn speed_slope(celsius: f64) -> f64 {
    let powers = MARCZAK.iter().enumerate().skip(1);
    powers.map(|(n, coefficient)| n as f64 * coefficient * celsius.powi(n as i32 - 1)).sum()
}

/// Where the image's plane is for scanning tissue, with the setting's own spacing, from where it was found in water.
///
/// `found` and `spacing` are what was fitted there. Sound is slower in water than the scanner takes it to be, so that a
/// row is less high, in the ratio of the speeds, and so is everything above the first row: its centre is half a row under
/// the window's top, and was less deep under the face in the same ratio. The rows begin at the face, along Image y. In
/// the medium that the scanner assumes the ratio is one, and nothing changes.
pub fn in_tissue(found: &Pose<Probe, Image>, spacing: PixelSpacing, setting: &Setting) -> Pose<Probe, Image> {
    let down = Translation3::new(0.0, deeper_in_tissue_m(spacing, setting), 0.0);
    // FRAMES: the same axes, the first row's centre as deep as it is in tissue.
    let moved = Pose::<Image, Image>::assume(Isometry3::from_parts(down, UnitQuaternion::identity()));
    *found * moved
}

/// How much deeper the first row is in tissue than it was with rows of this spacing (m).
pub(crate) fn deeper_in_tissue_m(spacing: PixelSpacing, setting: &Setting) -> f64 {
    first_row_m(setting) * (1.0 - spacing.y_m / setting.spacing.y_m)
}

/// How deep the first row's centre is under the face in tissue (m).
pub(crate) fn first_row_m(setting: &Setting) -> f64 {
    setting.window_top_m + setting.spacing.y_m / 2.0
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn sound_in_water_is_as_fast_as_published() {
        // Published: 1402.4 at 0 C, 1482.3 at 20 C, 1496.7 at 25 C, 1555.1 (the fastest) at 74 C.
        for (celsius, published) in [(0.0, 1402.4), (20.0, 1482.3), (25.0, 1496.7), (74.0, 1555.1)] {
            let found = speed_of_sound_in_water(celsius);
            assert!((found - published).abs() < 0.1, "{celsius} C: {found} m/s, published {published}");
        }
    }

    #[test]
    fn its_slope_is_its_derivative() {
        for celsius in [5.0, 20.0, 37.0, 74.2] {
            let step = 1e-4;
            let rise = speed_of_sound_in_water(celsius + step) - speed_of_sound_in_water(celsius - step);
            assert!((rise / (2.0 * step) - speed_slope(celsius)).abs() < 1e-6);
        }
    }

    /// Echoes are sorted by their time: the same time is the same row in any medium, and deeper where sound is faster.
    #[test]
    fn an_echo_of_the_same_time_is_the_same_pixel_in_water_and_in_tissue() {
        let mut dice = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..1000 {
            let mut within = |low: f64, high: f64| dice.random_range(low..high);
            let (assumed, speed) = (1540.0, speed_of_sound_in_water(within(5.0, 50.0)));
            let (top_m, pixel) = (within(0.0, 0.05), PixelSpacing { x_m: 1e-4, y_m: within(5e-5, 3e-4) });
            let setting = Setting {
                depth_m: 0.1,
                focus_m: 0.04,
                window_top_m: top_m,
                window_height_m: 400.0 * pixel.y_m,
                window_width_m: 0.04,
                spacing: pixel,
            };
            let turn = Vector3::new(within(-3.0, 3.0), within(-1.0, 1.0), within(-1.0, 1.0));
            // A point of the face on the first column, from which depths count along the rows.
            let face = Isometry3::new(Vector3::new(within(-0.1, 0.1), 0.0, within(-0.1, 0.1)), turn);
            // Where the echo of row v is in a medium: half its time's way.
            let at = |v: f64, speed_m_s: f64| {
                let time_s = 2.0 * (top_m + (v + 0.5) * pixel.y_m) / assumed;
                face * nalgebra::Point3::new(0.0, speed_m_s * time_s / 2.0, 0.0)
            };
            let first = Translation3::from(at(0.0, speed).coords);
            // FRAMES: made up for the test.
            let found = Pose::assume(Isometry3::from_parts(first, face.rotation));
            let spacing = PixelSpacing { y_m: pixel.y_m * speed / assumed, ..pixel };
            let tissue = in_tissue(&found, spacing, &setting);
            for v in [0.0, 17.0, 399.0] {
                let in_water = found * spacing.point(0.0, v);
                assert!((in_water.vector() - at(v, speed).coords).norm() < 1e-12);
                let off = ((tissue * pixel.point(0.0, v)).vector() - at(v, assumed).coords).norm();
                assert!(off < 1e-12, "row {v} is {off} m off");
            }
        }
    }

    #[test]
    fn rows_of_the_scanners_own_size_are_left_where_they_are() {
        let spacing = PixelSpacing { x_m: 1e-4, y_m: 2e-4 };
        let setting = Setting {
            depth_m: 0.07,
            focus_m: 0.04,
            window_top_m: 0.02,
            window_height_m: 0.04,
            window_width_m: 0.04,
            spacing,
        };
        // FRAMES: made up for the test.
        let found = Pose::assume(Isometry3::new(Vector3::new(0.01, 0.02, 0.03), Vector3::new(1.0, 0.2, 0.3)));
        assert_eq!(in_tissue(&found, spacing, &setting), found);
    }
}
