//! [`Path`]: what was taught, cleaned: poses at uniform spacing along the skin.

mod beside;
mod bins;
mod clean;
mod contact;
mod file;
mod progress;
mod resample;
mod smooth;
#[cfg(test)]
mod taught;
mod tube;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Direction, Point, Pose, Probe};
use probepath_robot::motion::follow::PoseCurve;
use serde::{Deserialize, Serialize};

pub use clean::{Bridge, Cleaning, CleaningReport, Tube};
pub use contact::ContactSign;
pub use file::Listed;

use crate::PathError;

/// Which leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The patient's left leg.
    Left,
    /// The patient's right leg.
    Right,
}

impl Side {
    /// The other leg.
    pub const fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

/// What a path is filed under.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// A study code, never a name.
    pub study: String,
    /// Which leg.
    pub side: Side,
    /// The day it was taught, as the caller writes it (2026-11-22).
    pub date: String,
}

/// One pose of a path, and what smoothing did to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// The probe's pose.
    pub base_from_probe: Pose<Base, Probe>,
    /// How far smoothing moved it, across the path (m), and turned it (rad); none where the probe was off the skin
    /// and the path was bridged.
    pub moved: Option<(f64, f64)>,
}

/// The force along the probe's axis while the path was taught (N, pressing is positive). Where the sensor carries
/// probe and handle together it is the sum of hand and skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaughtForce {
    /// Mean (N).
    pub mean: f64,
    /// Standard deviation (N).
    pub sd: f64,
    /// Smallest (N).
    pub least: f64,
    /// Largest (N).
    pub most: f64,
}

/// A taught path of the probe: poses at uniform spacing along it, twice continuously differentiable in between.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    label: Label,
    spacing: f64,
    points: Vec<PathPoint>,
    force: Option<TaughtForce>,
    curve: PoseCurve,
}

impl Path {
    /// The path through `points`, `spacing` metres apart.
    ///
    /// # Errors
    /// When they make no curve: fewer than four, a number not finite, or turned too far.
    pub fn new(
        label: Label,
        spacing: f64,
        points: Vec<PathPoint>,
        force: Option<TaughtForce>,
    ) -> Result<Self, PathError> {
        let poses: Vec<_> = points.iter().map(|point| point.base_from_probe).collect();
        let curve = PoseCurve::through(spacing, &poses)?;
        Ok(Self { label, spacing, points, force, curve })
    }

    /// What it is filed under.
    pub const fn label(&self) -> &Label {
        &self.label
    }

    /// Distance between two points along the path (m).
    pub const fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The points, in the order they were taught.
    pub fn points(&self) -> &[PathPoint] {
        &self.points
    }

    /// How long it is (m).
    pub fn length(&self) -> f64 {
        self.spacing * (self.points.len() - 1) as f64
    }

    /// The force while it was taught, if there was a sensor.
    pub const fn force(&self) -> Option<TaughtForce> {
        self.force
    }

    /// The smooth curve through the points, asked at any distance along it.
    pub const fn curve(&self) -> &PoseCurve {
        &self.curve
    }

    /// The part between two distances along it (m), to the points inside.
    ///
    /// # Errors
    /// When the distances lie outside the path or in the wrong order, or fewer than four points are left.
    pub fn trimmed(&self, from: f64, until: f64) -> Result<Self, PathError> {
        let slack = 1e-6 * self.spacing;
        if !(from >= -slack && from < until && until <= self.length() + slack) {
            return Err(PathError::Trim {
                from_mm: from * 1e3,
                until_mm: until * 1e3,
                length_mm: self.length() * 1e3,
            });
        }
        let first = ((from - slack) / self.spacing).ceil().max(0.0) as usize;
        let last = (((until + slack) / self.spacing).floor() as usize).min(self.points.len() - 1);
        let kept = self.points.get(first..=last).unwrap_or_default();
        if kept.len() < 4 {
            let length_mm = kept.len().saturating_sub(1) as f64 * self.spacing * 1e3;
            return Err(PathError::TooShort { length_mm, least_mm: 3.0 * self.spacing * 1e3 });
        }
        Self::new(self.label.clone(), self.spacing, kept.to_vec(), self.force)
    }

    /// The same path for the other leg: reflected across the plane through `point` with `normal` (the body's
    /// midsagittal plane, in Base). A reflected probe would be left-handed, so its x axis is turned round: the
    /// beam and the way of travel are the mirror's, and the marked side of the array stays on the patient's same
    /// side, left or right.
    ///
    /// # Errors
    /// When the reflected points make no curve, which cannot be unless these did not.
    pub fn mirrored(&self, point: Point<Base>, normal: Direction<Base>) -> Result<Self, PathError> {
        let label = Label { side: self.label.side.other(), ..self.label.clone() };
        let points = self
            .points
            .iter()
            .map(|p| PathPoint {
                base_from_probe: reflected(&p.base_from_probe, point, normal),
                moved: p.moved,
            })
            .collect();
        Self::new(label, self.spacing, points, self.force)
    }
}

fn reflected(pose: &Pose<Base, Probe>, point: Point<Base>, normal: Direction<Base>) -> Pose<Base, Probe> {
    let n = normal.vector();
    let reflection = Matrix3::identity() - n * n.transpose() * 2.0;
    let origin = pose.origin().vector();
    let place = origin - n * (2.0 * (origin - point.vector()).dot(&n));
    let turn_x = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    let rotation = reflection * pose.isometry().rotation.to_rotation_matrix().matrix() * turn_x;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    // FRAMES: a probe in Base, reflected within Base; two reflections make the rotation proper again.
    Pose::assume(Isometry3::from_parts(Translation3::from(place), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use probepath_robot::motion::follow::Curve;

    pub(super) fn example() -> Path {
        let points = (0..201)
            .map(|i| {
                let s = 0.0005 * f64::from(i);
                let origin = Vector3::new(0.4 + 0.002 * (s * 60.0).sin(), s * 0.995, 0.2);
                // FRAMES: a made-up path of a probe in a base.
                let base_from_probe = Pose::assume(Isometry3::new(origin, Vector3::new(3.0, 0.1, s)));
                PathPoint { base_from_probe, moved: (i % 50 != 7).then_some((1e-4, 1e-3)) }
            })
            .collect();
        let label = Label { study: "S-017".into(), side: Side::Left, date: "2026-11-22".into() };
        let force = Some(TaughtForce { mean: 4.9, sd: 0.8, least: 2.0, most: 7.5 });
        Path::new(label, 0.0005, points, force).unwrap()
    }

    #[test]
    fn trimming_keeps_the_points_inside_and_refuses_the_rest() {
        let path = example();
        let part = path.trimmed(0.0101, 0.0502).unwrap();
        assert!((part.length() - 0.0395).abs() < 1e-9, "{}", part.length());
        assert_eq!(part.points()[0], path.points()[21]);
        assert!(matches!(path.trimmed(0.05, 0.01), Err(PathError::Trim { .. })));
        assert!(matches!(path.trimmed(-0.01, 0.01), Err(PathError::Trim { .. })));
        assert!(matches!(path.trimmed(0.0, f64::NAN), Err(PathError::Trim { .. })));
        assert!(matches!(path.trimmed(0.0, 0.001), Err(PathError::TooShort { .. })));
    }

    #[test]
    fn a_mirrored_path_is_proper_and_mirrored_twice_it_is_itself() {
        let path = example();
        let (point, normal) =
            (Point::new(0.0, 0.3, 0.0), Direction::of(Vector3::new(0.1, 1.0, -0.05)).unwrap());
        let other = path.mirrored(point, normal).unwrap();
        assert_eq!(other.label().side, Side::Right);
        let n = normal.vector();
        let reflect = |v: Vector3<f64>| v - n * (2.0 * v.dot(&n));
        for (a, b) in path.points().iter().zip(other.points()) {
            let (a, b) = (&a.base_from_probe, &b.base_from_probe);
            assert!((reflect(a.z_axis().vector()) - b.z_axis().vector()).norm() < 1e-12);
            assert!((reflect(a.y_axis().vector()) - b.y_axis().vector()).norm() < 1e-12);
            assert!((reflect(a.x_axis().vector()) + b.x_axis().vector()).norm() < 1e-12);
            let middle = (a.origin().vector() + b.origin().vector()) / 2.0 - point.vector();
            assert!(middle.dot(&n).abs() < 1e-12);
        }
        let again = other.mirrored(point, normal).unwrap();
        for (a, b) in path.points().iter().zip(again.points()) {
            let (metres, radians) = a.base_from_probe.distance(&b.base_from_probe);
            assert!(metres < 1e-12 && radians < 1e-7);
        }
    }

    #[test]
    fn its_curve_goes_through_its_points() {
        let path = example();
        for (i, point) in path.points().iter().enumerate() {
            let (metres, radians) =
                path.curve().at(i as f64 * path.spacing()).base_from_probe.distance(&point.base_from_probe);
            assert!(metres < 1e-12 && radians < 1e-7);
        }
    }
}
