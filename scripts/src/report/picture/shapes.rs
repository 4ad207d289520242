//! Marks in a picture: ellipses, crosses, rectangles.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};

use super::{Colour, Picture};

/// Corners of the polygon that an ellipse is drawn as.
const CORNERS: usize = 48;
/// Half axes are drawn between these (pixels): a smaller one could not be seen, a larger one hides the picture.
const HALF_AXIS: (f64, f64) = (1.0, 120.0);

impl Picture {
    /// Draws the ellipse of a covariance (px²), `sigmas` standard deviations from its centre.
    pub fn ellipse(&mut self, centre: [f64; 2], covariance: &Matrix2<f64>, sigmas: f64, colour: Colour) {
        if !covariance.iter().chain(&centre).all(|x| x.is_finite()) {
            return;
        }
        let eigen = SymmetricEigen::new(*covariance);
        let half = eigen.eigenvalues.map(|v| (sigmas * v.max(0.0).sqrt()).clamp(HALF_AXIS.0, HALF_AXIS.1));
        let corner = |nth: usize| {
            let angle = nth as f64 / CORNERS as f64 * std::f64::consts::TAU;
            let at = eigen.eigenvectors * Vector2::new(half.x * angle.cos(), half.y * angle.sin());
            (centre[0] + at.x, centre[1] + at.y)
        };
        for nth in 0..CORNERS {
            self.line(corner(nth), corner(nth + 1), colour);
        }
    }

    /// Draws an upright cross.
    pub fn cross(&mut self, [u, v]: [f64; 2], half: f64, colour: Colour) {
        if u.is_finite() && v.is_finite() {
            self.line((u - half, v), (u + half, v), colour);
            self.line((u, v - half), (u, v + half), colour);
        }
    }

    /// Draws a rectangle's edge: first and last column and row.
    pub fn rectangle(&mut self, first: (f64, f64), last: (f64, f64), colour: Colour) {
        let corners = [first, (last.0, first.1), last, (first.0, last.1)];
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            self.line(*from, *to, colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_lies_along_the_larger_variance() {
        let mut picture = Picture::filled(101, 101, [0; 3]);
        picture.ellipse([50.0, 50.0], &Matrix2::new(100.0, 0.0, 0.0, 9.0), 2.0, [255; 3]);
        let lit = |u: usize, v: usize| picture.rgb[3 * (v * 101 + u)] > 0;
        assert!(lit(70, 50) && lit(30, 50) && lit(50, 56) && lit(50, 44) && !lit(50, 70));
    }

    #[test]
    fn what_is_no_number_is_not_drawn() {
        let mut picture = Picture::filled(10, 10, [0; 3]);
        picture.ellipse([f64::NAN, 5.0], &Matrix2::identity(), 1.0, [255; 3]);
        picture.cross([5.0, f64::INFINITY], 3.0, [255; 3]);
        assert!(picture.rgb.iter().all(|p| *p == 0));
    }
}
