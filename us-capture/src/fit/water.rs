//! How fast sound is in water.

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

#[cfg(test)]
mod tests {
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
}
