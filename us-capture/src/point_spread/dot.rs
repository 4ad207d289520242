//! The shape of one dot: the parabola through its decibels.

use nalgebra::{Matrix2, Matrix6, Vector6};

use crate::dots::Dot;

/// Decibels below its summit down to which a dot is fitted.
const DROP_DB: f64 = 12.0;
/// Fewest pixels that are neither black nor saturated.
const LEAST_PIXELS: usize = 20;
/// No more than this part of a dot may be saturated: what is left is its skirt.
const MOST_SATURATED: f64 = 0.6;
/// A dot that is farther from a parabola than this is more than one echo (dB, root mean square).
const MOST_OFF_DB: f64 = 1.5;
/// How often the pixels are chosen anew by the parabola that they gave.
const ROUNDS: usize = 3;
/// Decibels of a factor e in amplitude.
const DB_PER_E: f64 = 8.685_889_638_065_037;

/// A picture whose grey levels are decibels.
#[derive(Clone, Copy)]
pub(super) struct Picture<'a> {
    pub(super) pixels: &'a [u8],
    pub(super) width: usize,
    pub(super) db_per_grey: f64,
}

/// Why a dot has no shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unfit {
    /// Too much of it is white.
    Saturated,
    /// Too small, or no single summit.
    Shapeless,
}

/// Variances and covariance of a dot's amplitude, in pixels.
pub(super) fn shape(picture: Picture<'_>, dot: &Dot) -> Result<Matrix2<f64>, Unfit> {
    // Of a paraboloid cut off at its base, the second moments are a sixth of the squared half axes.
    let start = dot.spread_px2.try_inverse().ok_or(Unfit::Shapeless)? / 6.0;
    let mut summit = Parabola { at: dot.at_px, inside: start, off_db: 0.0 };
    for _ in 0..ROUNDS {
        summit = summit.again(picture)?;
    }
    if summit.off_db > MOST_OFF_DB {
        return Err(Unfit::Shapeless);
    }
    // At the rim the exponent is half of the squared distance in standard deviations.
    let precision = summit.inside * (2.0 * DROP_DB / DB_PER_E);
    precision.try_inverse().ok_or(Unfit::Shapeless)
}

/// A summit, and the ellipse `x' inside x = 1` around it that is fitted next.
struct Parabola {
    at: [f64; 2],
    inside: Matrix2<f64>,
    off_db: f64,
}

impl Parabola {
    /// The least-squares parabola through the pixels inside the ellipse.
    fn again(&self, picture: Picture<'_>) -> Result<Self, Unfit> {
        let (pixels, saturated) = self.pixels(picture);
        if saturated > MOST_SATURATED {
            return Err(Unfit::Saturated);
        }
        if pixels.len() < LEAST_PIXELS {
            return Err(Unfit::Shapeless);
        }
        let (mut matrix, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (row, db) in &pixels {
            matrix += row * row.transpose();
            right += row * *db;
        }
        let c: Vector6<f64> = matrix.cholesky().ok_or(Unfit::Shapeless)?.solve(&right);
        let curve = -Matrix2::new(c[3], c[4] / 2.0, c[4] / 2.0, c[5]);
        let inverse = curve.cholesky().ok_or(Unfit::Shapeless)?.inverse();
        let off = inverse * nalgebra::Vector2::new(c[1], c[2]) / 2.0;
        let squares: f64 = pixels.iter().map(|(row, db)| (db - row.dot(&c)).powi(2)).sum();
        let off_db = (squares / pixels.len() as f64).sqrt();
        Ok(Self { at: [self.at[0] + off.x, self.at[1] + off.y], inside: curve / DROP_DB, off_db })
    }

    /// Terms and decibels of every pixel that is neither black nor white, and how much of the ellipse is white.
    fn pixels(&self, picture: Picture<'_>) -> (Vec<(Vector6<f64>, f64)>, f64) {
        let height = picture.pixels.len() / picture.width.max(1);
        let half =
            self.inside.try_inverse().unwrap_or_default().diagonal().map(|square| square.max(0.0).sqrt());
        let span = |axis: usize, size: usize| {
            let from = (self.at[axis] - half[axis]).ceil().clamp(0.0, size as f64);
            let to = (self.at[axis] + half[axis]).floor().clamp(-1.0, size as f64 - 1.0);
            from as usize..(to + 1.0) as usize
        };
        let (mut found, mut white, mut all) = (Vec::new(), 0_usize, 0_usize);
        for row in span(1, height) {
            for column in span(0, picture.width) {
                let (x, y) = (column as f64 - self.at[0], row as f64 - self.at[1]);
                let away = self.inside[(0, 0)] * x * x
                    + 2.0 * self.inside[(0, 1)] * x * y
                    + self.inside[(1, 1)] * y * y;
                if away > 1.0 {
                    continue;
                }
                all += 1;
                match picture.pixels.get(row * picture.width + column) {
                    Some(255) => white += 1,
                    Some(&grey) if grey > 0 => {
                        let terms = Vector6::new(1.0, x, y, x * x, x * y, y * y);
                        found.push((terms, f64::from(grey) * picture.db_per_grey));
                    }
                    _ => {}
                }
            }
        }
        (found, white as f64 / all.max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gaussian echo of these variances (px²), its summit at `grey`, 0.2 dB a grey level.
    fn drawn(at: [f64; 2], spread: Matrix2<f64>, grey: f64) -> (Vec<u8>, Dot) {
        let precision = spread.try_inverse().unwrap();
        let level = |column: usize, row: usize| {
            let off = nalgebra::Vector2::new(column as f64 - at[0], row as f64 - at[1]);
            let db = -DB_PER_E * 0.5 * off.dot(&(precision * off));
            (grey + db / 0.2).round().clamp(0.0, 255.0) as u8
        };
        let pixels = (0..120 * 100).map(|k| level(k % 120, k / 120)).collect();
        let covariance_px2 = Matrix2::identity() * 0.01;
        // As the finder gives it: rough.
        let spread_px2 = Matrix2::from_diagonal(&spread.diagonal()) * 0.7;
        let dot = Dot {
            at_px: at.map(|x| x + 0.3),
            covariance_px2,
            spread_px2,
            peak: 255.0,
            mass: 1.0,
            cut: false,
        };
        (pixels, dot)
    }

    #[test]
    fn the_variances_of_a_gaussian_dot_are_read_whether_it_is_saturated_or_not() {
        for (k, grey) in [120.0, 180.0, 240.0, 262.0, 275.0].into_iter().enumerate() {
            for (lateral, axial, tilt) in [(6.4, 2.4, 0.0), (11.0, 3.1, 0.2), (4.0, 2.0, -0.3)] {
                let skew = tilt * lateral * axial;
                let spread = Matrix2::new(lateral * lateral, skew, skew, axial * axial);
                let (pixels, dot) = drawn([60.2 + 0.1 * k as f64, 49.7], spread, grey);
                let found = shape(Picture { pixels: &pixels, width: 120, db_per_grey: 0.2 }, &dot).unwrap();
                assert!(
                    (found - spread).norm() < 0.02 * spread.norm(),
                    "{grey}: {found} instead of {spread}"
                );
            }
        }
    }

    #[test]
    fn what_is_no_summit_has_no_shape() {
        let spread = Matrix2::new(36.0, 0.0, 0.0, 6.0);
        let (pixels, dot) = drawn([60.0, 50.0], spread, 600.0);
        let picture = |pixels| Picture { pixels, width: 120, db_per_grey: 0.2 };
        assert_eq!(shape(picture(&pixels), &dot), Err(Unfit::Saturated));
        let flat = vec![90_u8; 120 * 100];
        assert_eq!(shape(picture(&flat), &dot), Err(Unfit::Shapeless));
        let (mut two, dot) = drawn([60.0, 50.0], spread, 200.0);
        let (other, _) = drawn([68.0, 51.0], spread * 0.3, 230.0);
        two.iter_mut().zip(other).for_each(|(a, b)| *a = (*a).max(b));
        assert!(shape(picture(&two), &dot).is_err());
        let nowhere = Dot { at_px: [f64::NAN, 1e9], ..dot };
        assert!(shape(picture(&two), &nowhere).is_err());
    }
}
