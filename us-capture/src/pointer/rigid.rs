//! The rigid motion that carries points onto points with the least squares (Kabsch 1976; Arun 1987).

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A motion and what is left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid {
    /// Carries the first points onto the second.
    pub motion: Isometry3<f64>,
    /// Root mean square distance that is left (m).
    pub rms_m: f64,
    /// The same, were a mirror allowed (m).
    pub mirrored_rms_m: f64,
}

/// `None` when the singular values are not found, which finite numbers do not do.
pub(super) fn rigid(from: &[Vector3<f64>], onto: &[Vector3<f64>]) -> Option<Rigid> {
    let (from_mean, onto_mean) = (mean(from), mean(onto));
    let products = from.iter().zip(onto).map(|(p, q)| (p - from_mean) * (q - onto_mean).transpose());
    let svd = products.sum::<Matrix3<f64>>().try_svd(true, true, f64::EPSILON, 1000)?;
    let (u, v) = (svd.u?, svd.v_t?.transpose());
    // Of the rotations and reflections that maximise the trace, the rotation: the last axis is turned back.
    let handed = if (v * u.transpose()).determinant() < 0.0 { -1.0 } else { 1.0 };
    let rotation = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handed)) * u.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let motion = Isometry3::from_parts(Translation3::from(onto_mean - rotation * from_mean), rotation);
    let left = from.iter().zip(onto).map(|(p, q)| (motion * Point3::from(*p)).coords - q);
    let count = from.len() as f64;
    let left_m2 = left.map(|e| e.norm_squared()).sum::<f64>() / count;
    // A mirror would turn the sign of the last singular value once more.
    let gain = if handed < 0.0 {
        4.0 * svd.singular_values[2] / count
    } else {
        -4.0 * svd.singular_values[2] / count
    };
    Some(Rigid { motion, rms_m: left_m2.sqrt(), mirrored_rms_m: (left_m2 - gain).max(0.0).sqrt() })
}

/// How far points are from the line that fits them best, root mean square (m).
pub(super) fn off_line_m(points: &[Vector3<f64>]) -> f64 {
    let mean = mean(points);
    let spread = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>();
    let squares = spread.symmetric_eigenvalues();
    ((squares.sum() - squares.max()).max(0.0) / points.len().max(1) as f64).sqrt()
}

pub(super) fn mean(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}
