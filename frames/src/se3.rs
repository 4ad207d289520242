//! Exponential and logarithm of rigid motions: the straight way between two poses.
//!
//! Sources: Murray, Li, Sastry, *A Mathematical Introduction to Robotic Manipulation* (1994), appendix A;
//! the series near zero are Taylor expansions to the order that keeps 1e-15.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// Below this angle (rad) the closed forms lose digits and the series are exact to rounding.
const SMALL: f64 = 1e-3;

/// The screw `(v, w)` whose exponential is `motion`; `|w| <= pi`, the short way round.
pub(crate) fn log(motion: &Isometry3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let w = rotation_log(&motion.rotation);
    let angle = w.norm();
    let hat = w.cross_matrix();
    let c = if angle < SMALL {
        let a2 = angle * angle;
        1.0 / 12.0 + a2 / 720.0 + a2 * a2 / 30240.0
    } else {
        let half = angle / 2.0;
        (1.0 - half * half.cos() / half.sin()) / (angle * angle)
    };
    let v_inverse = Matrix3::identity() - hat * 0.5 + hat * hat * c;
    (v_inverse * motion.translation.vector, w)
}

/// The motion along the screw `(v, w)` for one unit of time.
pub(crate) fn exp(v: &Vector3<f64>, w: &Vector3<f64>) -> Isometry3<f64> {
    let angle = w.norm();
    let hat = w.cross_matrix();
    let (b, c) = if angle < SMALL {
        let a2 = angle * angle;
        (0.5 - a2 / 24.0 + a2 * a2 / 720.0, 1.0 / 6.0 - a2 / 120.0 + a2 * a2 / 5040.0)
    } else {
        ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / (angle * angle * angle))
    };
    let left = Matrix3::identity() + hat * b + hat * hat * c;
    Isometry3::from_parts(Translation3::from(left * v), UnitQuaternion::from_scaled_axis(*w))
}

/// Rotation vector of a unit quaternion; exact near zero and near pi, where `acos` is not.
fn rotation_log(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (mut w, mut v) = (q.w, q.imag());
    if w < 0.0 {
        (w, v) = (-w, -v);
    }
    let sine = v.norm();
    if sine < 1e-12 {
        return v * 2.0;
    }
    v * (2.0 * sine.atan2(w) / sine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-limit..limit).prop_map(Vector3::from)
    }

    /// The same cases on every machine and every day.
    fn seeded(cases: u32) -> ProptestConfig {
        ProptestConfig {
            cases,
            rng_seed: RngSeed::Fixed(1),
            failure_persistence: None,
            ..ProptestConfig::default()
        }
    }

    proptest! {
        #![proptest_config(seeded(5000))]

        #[test]
        fn logarithm_undoes_the_exponential(v in vector(2.0), w in vector(1.8), scale in -12.0..0.0f64) {
            let w = w * 10f64.powf(scale);
            let (v2, w2) = log(&exp(&v, &w));
            prop_assert!((v - v2).norm() < 1e-9, "{v} {v2}");
            prop_assert!((w - w2).norm() < 1e-9, "{w} {w2}");
        }
    }
}
