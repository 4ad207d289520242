//! Dots in metres, as the labeller works with them.

use nalgebra::{Matrix2, Vector2};

use super::Refusal;
use crate::PixelSpacing;
use crate::dots::Dot;

/// A dot in the image's plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Its centre (m).
    pub at: Vector2<f64>,
    /// How uncertain it is (m²).
    pub covariance: Matrix2<f64>,
    /// Cut by an edge: it says which wire is there, not where.
    pub cut: bool,
}

/// The dots in metres.
///
/// # Errors
/// When a number is none.
pub(super) fn measured(dots: &[Dot], spacing: PixelSpacing) -> Result<Vec<Seen>, Refusal> {
    let good = |m: f64| m.is_finite() && m > 1e-7 && m < 1e-2;
    if !good(spacing.x_m) || !good(spacing.y_m) {
        return Err(Refusal::NotANumber { what: "the pixel size" });
    }
    if dots.iter().any(|d| !d.at_px.iter().chain(d.covariance_px2.iter()).all(|x| x.is_finite())) {
        return Err(Refusal::NotANumber { what: "a dot's place or covariance" });
    }
    let size = Matrix2::new(spacing.x_m, 0.0, 0.0, spacing.y_m);
    let seen = |d: &Dot| Seen {
        at: size * Vector2::from(d.at_px),
        covariance: size * d.covariance_px2 * size,
        cut: d.cut,
    };
    Ok(dots.iter().map(seen).collect())
}
