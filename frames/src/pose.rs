//! [`Pose<A, B>`]: system B, defined in A.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::{Direction, Frame, FrameError, Point, Twist, Wrench, se3};

/// How far a rotation read from a file may be from orthogonal. Six printed digits leave 2e-6, but a real tracker's
/// matrices (PLUS's water tank) are off by up to 4.3e-4 each, and a chain adds two of them up. Anything beyond this is
/// a scale or a shear that no rigid pose can hold: it moves a point 100 mm away by 0.1 mm.
const ORTHOGONAL_WITHIN: f64 = 2e-3;

/// System `B`, defined in `A`: variable `a_from_b`, equation `A_T_B`. Always rigid, in metres.
///
/// ```
/// # use probepath_frames::*;
/// fn place(base_from_probe: Pose<Base, Probe>, probe_from_image: Pose<Probe, Image>) -> Pose<Base, Image> {
///     base_from_probe * probe_from_image
/// }
/// ```
///
/// A product of the wrong systems does not compile:
///
/// ```compile_fail
/// # use probepath_frames::*;
/// fn place(base_from_probe: Pose<Base, Probe>, image_from_probe: Pose<Image, Probe>) -> Pose<Base, Image> {
///     base_from_probe * image_from_probe
/// }
/// ```
pub struct Pose<A, B> {
    isometry: Isometry3<f64>,
    systems: PhantomData<fn() -> (A, B)>,
}

impl<A: Frame, B: Frame> Pose<A, B> {
    /// The one door from bare numbers to a pose. Each use has a `// FRAMES:` line that says why it holds.
    pub const fn assume(isometry: Isometry3<f64>) -> Self {
        Self { isometry, systems: PhantomData }
    }

    /// The pose of a homogeneous 4x4 matrix (metres) that takes column vectors from `B` to `A`.
    ///
    /// # Errors
    /// When a number is not finite, the last row is not `0 0 0 1`, or the 3x3 part is not a rotation
    /// (scaled, sheared or mirrored): a pose is always rigid.
    pub fn from_matrix(matrix: &Matrix4<f64>) -> Result<Self, FrameError> {
        if matrix.iter().any(|x| !x.is_finite()) {
            return Err(FrameError::NotFinite { what: pair::<A, B>() });
        }
        let last = matrix.row(3);
        if (last[0].abs() + last[1].abs() + last[2].abs()) > 1e-9 || (last[3] - 1.0).abs() > 1e-9 {
            return Err(FrameError::LastRow { what: pair::<A, B>() });
        }
        let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let off = (linear.transpose() * linear - Matrix3::identity()).abs().max();
        let determinant = linear.determinant();
        if off > ORTHOGONAL_WITHIN || determinant <= 0.0 {
            return Err(FrameError::NotRigid { what: pair::<A, B>(), off, determinant });
        }
        let rotation =
            Rotation3::from_matrix_eps(&linear, 1e-15, 100, Rotation3::from_matrix_unchecked(linear));
        let translation: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        Ok(Self::assume(Isometry3::from_parts(
            Translation3::from(translation),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )))
    }

    /// The bare isometry, for arithmetic that no frame survives (files, the wire, a solver's matrices).
    pub const fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// `A` defined in `B`.
    pub fn inverse(&self) -> Pose<B, A> {
        Pose::assume(self.isometry.inverse())
    }

    /// Where `B`'s origin is, in `A`.
    pub fn origin(&self) -> Point<A> {
        Point::from_vector(self.isometry.translation.vector)
    }

    /// `B`'s x axis, written in `A`.
    pub fn x_axis(&self) -> Direction<A> {
        Direction::assume(self.isometry.rotation * Vector3::x())
    }

    /// `B`'s y axis, written in `A`.
    pub fn y_axis(&self) -> Direction<A> {
        Direction::assume(self.isometry.rotation * Vector3::y())
    }

    /// `B`'s z axis, written in `A`.
    pub fn z_axis(&self) -> Direction<A> {
        Direction::assume(self.isometry.rotation * Vector3::z())
    }

    /// How far `other`'s origin is from this one's (m), and the angle between them (rad).
    pub fn distance(&self, other: &Self) -> (f64, f64) {
        let metres = (self.isometry.translation.vector - other.isometry.translation.vector).norm();
        (metres, self.isometry.rotation.angle_to(&other.isometry.rotation))
    }

    /// The pose a `fraction` of the way to `other`, along the one screw that joins them, the short way round.
    /// Independent of where either origin is. 0 gives `self`, 1 gives `other`; outside it extrapolates, so ask a
    /// [`Track`](crate::Track), which refuses to, when the fraction comes from stamps.
    pub fn interpolate(&self, other: &Self, fraction: f64) -> Self {
        let (v, w) = se3::log(&(self.isometry.inverse() * other.isometry));
        Self::assume(self.isometry * se3::exp(&(v * fraction), &(w * fraction)))
    }

    /// The constant velocity that carries `self` into `other` in one second, written in `B` at `B`'s origin.
    pub fn twist_to(&self, other: &Self) -> Twist<B> {
        let (linear, angular) = se3::log(&(self.isometry.inverse() * other.isometry));
        Twist::new(linear, angular)
    }

    /// Where the pose is after moving with `twist` (written in `B` at `B`'s origin) for `seconds`.
    pub fn moved_by(&self, twist: &Twist<B>, seconds: f64) -> Self {
        Self::assume(self.isometry * se3::exp(&(twist.linear * seconds), &(twist.angular * seconds)))
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.isometry.translation.vector.iter().all(|x| x.is_finite())
            && self.isometry.rotation.coords.iter().all(|x| x.is_finite())
    }
}

impl<A: Frame> Pose<A, A> {
    /// A system in itself.
    pub fn identity() -> Self {
        Self::assume(Isometry3::identity())
    }
}

/// `A_T_B` as text, for messages.
pub(crate) fn pair<A: Frame, B: Frame>() -> String {
    format!("{}_T_{}", A::NAME, B::NAME)
}

impl<A, B> Clone for Pose<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A, B> Copy for Pose<A, B> {}

impl<A, B> PartialEq for Pose<A, B> {
    fn eq(&self, other: &Self) -> bool {
        self.isometry == other.isometry
    }
}

impl<A: Frame, B: Frame> fmt::Debug for Pose<A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (t, r) = (self.isometry.translation.vector, self.isometry.rotation.scaled_axis());
        write!(f, "{}[{}, {}, {} m; {}, {}, {} rad]", pair::<A, B>(), t.x, t.y, t.z, r.x, r.y, r.z)
    }
}

impl<A: Frame, B: Frame, C: Frame> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;
    fn mul(self, right: Pose<B, C>) -> Pose<A, C> {
        Pose::assume(self.isometry * right.isometry)
    }
}

impl<A: Frame, B: Frame> Mul<Point<B>> for Pose<A, B> {
    type Output = Point<A>;
    fn mul(self, point: Point<B>) -> Point<A> {
        Point::from_vector(self.isometry.rotation * point.vector() + self.isometry.translation.vector)
    }
}

impl<A: Frame, B: Frame> Mul<Direction<B>> for Pose<A, B> {
    type Output = Direction<A>;
    fn mul(self, direction: Direction<B>) -> Direction<A> {
        Direction::assume(self.isometry.rotation * direction.vector())
    }
}

/// The same motion of the same body, written in `A` at `A`'s origin (the adjoint).
impl<A: Frame, B: Frame> Mul<Twist<B>> for Pose<A, B> {
    type Output = Twist<A>;
    fn mul(self, twist: Twist<B>) -> Twist<A> {
        let angular = self.isometry.rotation * twist.angular;
        let linear = self.isometry.rotation * twist.linear + self.isometry.translation.vector.cross(&angular);
        Twist::new(linear, angular)
    }
}

/// The same force on the same body, written in `A` about `A`'s origin (the transposed adjoint).
impl<A: Frame, B: Frame> Mul<Wrench<B>> for Pose<A, B> {
    type Output = Wrench<A>;
    fn mul(self, wrench: Wrench<B>) -> Wrench<A> {
        let force = self.isometry.rotation * wrench.force;
        let torque = self.isometry.rotation * wrench.torque + self.isometry.translation.vector.cross(&force);
        Wrench::new(force, torque)
    }
}
