//! A curve of poses over its arc length: what is followed.

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Pose, Probe};
use thiserror::Error;

use super::spline::Spline;

/// How far an orientation may be from the curve's middle one (rad): the chart of rotation vectors is one to one
/// and smooth below pi.
const CHART_WITHIN: f64 = 2.4;

/// A smooth path of the probe, asked at a distance along it (m).
pub trait Curve {
    /// How long it is (m).
    fn length(&self) -> f64;

    /// The pose at `s` metres along, and how it changes there; an `s` outside is taken to the nearest end.
    fn at(&self, s: f64) -> CurvePoint;
}

/// A pose of a curve and its derivatives over the distance along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// The probe's pose.
    pub base_from_probe: Pose<Base, Probe>,
    /// First three derivatives of the probe's origin, in Base's axes (1, 1/m, 1/m^2).
    pub origin: [Vector3<f64>; 3],
    /// First three derivatives of the rotation vector that turns the curve's middle orientation into this one,
    /// written in the middle one's axes (rad/m, rad/m^2, rad/m^3).
    pub turn: [Vector3<f64>; 3],
}

/// Why poses make no curve.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum CurveError {
    /// Too few poses for a curve.
    #[error("{found} poses make no curve: at least 4 are needed")]
    TooFew {
        /// How many came.
        found: usize,
    },
    /// The spacing is no length.
    #[error("a spacing of {spacing_m} m is no length")]
    Spacing {
        /// The spacing given (m).
        spacing_m: f64,
    },
    /// A pose has a number that is not finite.
    #[error("pose {index} has a number that is not finite")]
    NotFinite {
        /// Counted from zero.
        index: usize,
    },
    /// The orientation turns too far for one curve.
    #[error(
        "pose {index} is turned {angle_deg:.0} degrees against the middle of the path, more than {most_deg:.0}: \
         cut the path in two"
    )]
    TurnsTooFar {
        /// Counted from zero.
        index: usize,
        /// The angle found (degrees).
        angle_deg: f64,
        /// The widest allowed (degrees).
        most_deg: f64,
    },
}

/// A twice continuously differentiable curve through poses at uniform spacing: a cubic spline of the origin and of
/// the rotation vector against the middle pose's orientation.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseCurve {
    middle: UnitQuaternion<f64>,
    spline: Spline<6>,
}

impl PoseCurve {
    /// The curve through `poses`, which lie `spacing_m` apart along it.
    ///
    /// # Errors
    /// When there are fewer than four, a number is not finite, or the orientation turns more than 137 degrees away
    /// from the middle pose's.
    pub fn through(spacing_m: f64, poses: &[Pose<Base, Probe>]) -> Result<Self, CurveError> {
        let too_few = CurveError::TooFew { found: poses.len() };
        let middle = poses.get(poses.len() / 2).ok_or_else(|| too_few.clone())?.isometry().rotation;
        if poses.len() < 4 {
            return Err(too_few);
        }
        if let Some(index) = poses.iter().position(|pose| !pose.is_finite()) {
            return Err(CurveError::NotFinite { index });
        }
        let knots =
            poses.iter().enumerate().map(|(i, pose)| knot(&middle, i, pose)).collect::<Result<_, _>>()?;
        let spline = Spline::through(spacing_m, knots).ok_or(CurveError::Spacing { spacing_m })?;
        Ok(Self { middle, spline })
    }

    /// The distance between the poses it goes through (m).
    pub fn spacing(&self) -> f64 {
        self.spline.step()
    }
}

/// Origin and rotation vector of one pose.
fn knot(
    middle: &UnitQuaternion<f64>,
    index: usize,
    pose: &Pose<Base, Probe>,
) -> Result<SVector<f64, 6>, CurveError> {
    let turn = (middle.inverse() * pose.isometry().rotation).scaled_axis();
    let angle = turn.norm();
    if angle > CHART_WITHIN {
        let (angle_deg, most_deg) = (angle.to_degrees(), CHART_WITHIN.to_degrees());
        return Err(CurveError::TurnsTooFar { index, angle_deg, most_deg });
    }
    let origin = pose.isometry().translation.vector;
    Ok(SVector::from([origin.x, origin.y, origin.z, turn.x, turn.y, turn.z]))
}

impl Curve for PoseCurve {
    fn length(&self) -> f64 {
        self.spline.end()
    }

    fn at(&self, s: f64) -> CurvePoint {
        let jet = self.spline.at(s);
        let upper = |v: &SVector<f64, 6>| Vector3::new(v[0], v[1], v[2]);
        let lower = |v: &SVector<f64, 6>| Vector3::new(v[3], v[4], v[5]);
        let rotation = self.middle * UnitQuaternion::from_scaled_axis(lower(&jet[0]));
        // FRAMES: the knots are origins and orientations of poses of Probe in Base.
        let base_from_probe =
            Pose::assume(Isometry3::from_parts(Translation3::from(upper(&jet[0])), rotation));
        CurvePoint {
            base_from_probe,
            origin: [upper(&jet[1]), upper(&jet[2]), upper(&jet[3])],
            turn: [lower(&jet[1]), lower(&jet[2]), lower(&jet[3])],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn helix(s: f64) -> Pose<Base, Probe> {
        let angle = s / 0.1;
        let origin = Vector3::new(0.08 * angle.cos(), 0.08 * angle.sin(), 0.06 * angle);
        // FRAMES: a made-up path of a probe in a base.
        Pose::assume(Isometry3::new(origin, Vector3::new(2.8, 0.3 * angle.sin(), 0.2 * angle)))
    }

    #[test]
    fn a_curve_through_poses_of_a_helix_is_the_helix_in_between() {
        let poses: Vec<_> = (0..401).map(|i| helix(0.0005 * f64::from(i))).collect();
        let curve = PoseCurve::through(0.0005, &poses).unwrap();
        assert!((curve.length() - 0.2).abs() < 1e-12);
        for i in 0..1990 {
            let s = 0.0001 * f64::from(i) + 0.00003;
            let (metres, radians) = curve.at(s).base_from_probe.distance(&helix(s));
            assert!(metres < 1e-9 && radians < 1e-8, "{s}: {metres} m, {radians} rad");
            assert!((curve.at(s).origin[0].norm() - 1.0).abs() < 2e-5);
        }
    }

    #[test]
    fn poses_that_make_no_curve_are_refused_with_the_reason() {
        let good: Vec<_> = (0..10).map(|i| helix(0.001 * f64::from(i))).collect();
        assert_eq!(PoseCurve::through(0.001, &good[..3]), Err(CurveError::TooFew { found: 3 }));
        assert_eq!(PoseCurve::through(0.001, &[]), Err(CurveError::TooFew { found: 0 }));
        assert!(matches!(PoseCurve::through(f64::NAN, &good), Err(CurveError::Spacing { .. })));
        let mut bad = good.clone();
        // FRAMES: a broken pose, made to be refused.
        bad[4] = Pose::assume(Isometry3::translation(f64::NAN, 0.0, 0.0));
        assert_eq!(PoseCurve::through(0.001, &bad), Err(CurveError::NotFinite { index: 4 }));
        // FRAMES: a pose turned against its neighbours, made to be refused.
        bad[4] = Pose::assume(Isometry3::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 0.0)));
        assert!(matches!(PoseCurve::through(0.001, &bad), Err(CurveError::TurnsTooFar { index: 4, .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn derivatives_agree_with_finite_differences(place in 0.01..0.99f64) {
            let poses: Vec<_> = (0..101).map(|i| helix(0.002 * f64::from(i))).collect();
            let curve = PoseCurve::through(0.002, &poses).unwrap();
            let s = place * curve.length();
            let h = 1e-6;
            let (before, here, after) = (curve.at(s - h), curve.at(s), curve.at(s + h));
            let origin = |p: &CurvePoint| p.base_from_probe.origin().vector();
            prop_assert!(((origin(&after) - origin(&before)) / (2.0 * h) - here.origin[0]).norm() < 1e-6);
            prop_assert!(((after.turn[0] - before.turn[0]) / (2.0 * h) - here.turn[1]).norm() < 1e-2);
            prop_assert!(((after.origin[0] - before.origin[0]) / (2.0 * h) - here.origin[1]).norm() < 1e-2);
        }
    }
}
