//! The linear solution: where pixels lie in the probe as an affine map, from pairs of a pixel and a point.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Point, Pose, Probe};

use super::robust::scale;
use super::{FitError, Robust};
use crate::{PixelMap, PixelSpacing};

/// A pixel, and where it lies in the probe (m).
pub(super) type Pair = ([f64; 2], Vector3<f64>);

/// Rounds of weighing outliers down.
const ROUNDS: usize = 15;
/// Farther from a right angle than this (rad), the pairs are of no rigid image: wrong names of poses, a wrong
/// phantom. An uncorrected lag of half a second shears by some degrees.
const SHEAR_LIMIT_RAD: f64 = 0.45;
/// A pixel whose size is wrong by more than this factor is of another depth, or in another unit.
const SIZE_LIMIT: f64 = 1.6;

/// The affine map that fits best, outliers weighed down, and what it leaves of a pair that is none (m).
pub(super) fn solve(pairs: &[Pair]) -> Result<(PixelMap<Probe>, f64), FitError> {
    let mut weights = vec![1.0; pairs.len()];
    let (mut map, mut left) = (weighted(pairs, &weights)?, 0.0);
    for _ in 0..ROUNDS {
        let off = |(at, point): &Pair| (map.at(at[0], at[1]).vector() - point).norm_squared();
        let squared: Vec<f64> = pairs.iter().map(off).collect();
        let sigma = scale(&mut squared.clone(), 6).unwrap_or(0.0).max(1e-6);
        left = sigma;
        let weight = |s: &f64| Robust::Cauchy(2.0).cost(s / (sigma * sigma)).1;
        weights = squared.iter().map(weight).collect();
        map = weighted(pairs, &weights)?;
    }
    Ok((map, left))
}

fn weighted(pairs: &[Pair], weights: &[f64]) -> Result<PixelMap<Probe>, FitError> {
    let total: f64 = weights.iter().sum();
    let mean = |of: &dyn Fn(&Pair) -> Vector3<f64>| {
        pairs.iter().zip(weights).map(|(pair, w)| of(pair) * *w).sum::<Vector3<f64>>() / total
    };
    let pixel = |(at, _): &Pair| Vector3::new(at[0], at[1], 0.0);
    let (middle, centre) = (mean(&pixel), mean(&|pair| pair.1));
    let (mut square, mut mixed) = (Matrix3::zeros(), Matrix3::zeros());
    for (pair, w) in pairs.iter().zip(weights) {
        let from_middle = pixel(pair) - middle;
        square += from_middle * from_middle.transpose() * *w;
        mixed += (pair.1 - centre) * from_middle.transpose() * *w;
    }
    let (xx, xy, yy) = (square[(0, 0)], square[(0, 1)], square[(1, 1)]);
    let determinant = xx * yy - xy * xy;
    // Middles on one line of the image say nothing about the direction across it.
    let flat = determinant.is_nan() || determinant < 1e-4 * (xx + yy) * (xx + yy) / 4.0;
    if flat {
        return Err(FitError::NoStart {
            why: "the middle wires of all Zs lie on one line of the images; label Zs of several depths, or move over \
                  the phantom so that they do not, or give a start"
                .into(),
        });
    }
    let (x, y) = (mixed.column(0), mixed.column(1));
    let column = (x * yy - y * xy) / determinant;
    let row = (y * xx - x * xy) / determinant;
    let origin = centre - column * middle.x - row * middle.y;
    Ok(PixelMap::new(Point::from_vector(origin), column, row))
}

/// The rigid image nearest to an affine map, about `middle_px`.
///
/// # Errors
/// When the map is too far from rigid to be a start.
pub(super) fn nearest_pose(
    map: &PixelMap<Probe>,
    spacing: PixelSpacing,
    middle_px: [f64; 2],
) -> Result<Pose<Probe, Image>, FitError> {
    let (x, y) = (map.column_step(), map.row_step());
    let (column, row) = (x.norm() / spacing.x_m, y.norm() / spacing.y_m);
    let sized = |factor: f64| (1.0 / SIZE_LIMIT..=SIZE_LIMIT).contains(&factor);
    let shear = map.shear_rad();
    if !(shear.abs() <= SHEAR_LIMIT_RAD && sized(column) && sized(row)) {
        return Err(FitError::NotRigid { shear_deg: shear.to_degrees(), column, row });
    }
    let (x, y) = (x.normalize(), y.normalize());
    // Each axis gives up half of what the two lack of a right angle.
    let (sum, difference) = ((x + y).normalize(), (x - y).normalize());
    let (x, y) = ((sum + difference) / 2_f64.sqrt(), (sum - difference) / 2_f64.sqrt());
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    let middle = spacing.point(middle_px[0], middle_px[1]).vector();
    let shift = map.at(middle_px[0], middle_px[1]).vector() - turn * middle;
    // FRAMES: both axes and the origin are written in the Probe, and are the Image's.
    Ok(Pose::assume(Isometry3::from_parts(Translation3::from(shift), turn)))
}
