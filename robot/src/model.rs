//! [`Model`]: a serial arm from its URDF, and where its flange is.

mod builtin;
mod chain;
mod error;
mod inverse;
mod jacobian;
mod mesh;
mod newton;
pub(crate) mod solve;
#[cfg(test)]
mod tests;
mod text;
mod urdf;

use nalgebra::{Isometry3, Matrix3, Rotation3, SMatrix, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Frame, Pose};

pub use builtin::{PANDA_URDF, UR5E_URDF};
pub use error::{ModelError, ModelWarning, Value};
pub use inverse::{InverseOptions, NoInverse};
pub use jacobian::{Jacobian, Vector6, manipulability};
pub use mesh::Mesh;

use crate::Joints;

/// How far and how fast a joint may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimit {
    /// Lowest position (rad, m); negative infinity for a continuous joint.
    pub lower: f64,
    /// Highest position (rad, m); infinity for a continuous joint.
    pub upper: f64,
    /// Highest speed (rad/s, m/s); always above zero and finite.
    pub velocity: f64,
    /// Highest torque or force (N m, N).
    pub effort: f64,
}

/// One moving joint of the chain, turned so that it moves about (or along) the z axis of its own system.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    /// From the system of the joint before, which its motion is part of, to this joint's at zero.
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    slides: bool,
    /// Which of the model's joints moves it, and how: `scale * q + offset`. A mimic joint shares its master's.
    joint: usize,
    scale: f64,
    offset: f64,
}

/// A serial arm: constants only, so that it can be shared and asked from a step. No call but [`Model::inverse`]'s
/// message of failure touches the heap.
///
/// `Base` is the URDF link the chain begins at, `Flange` the link it ends at. Joints count from base to tip; fixed
/// joints are folded in, a mimic joint moves with its master.
///
/// ```
/// use probepath_robot::{Joints, Model};
///
/// let arm = Model::ur5e();
/// let bent = Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0])?;
/// let base_from_flange = arm.forward(&bent);
/// assert!((base_from_flange.origin().vector().x - 0.492).abs() < 1e-3);
/// # Ok::<(), probepath_robot::WrongJoints>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    name: String,
    base_link: String,
    tip_link: String,
    names: Vec<String>,
    limits: Vec<JointLimit>,
    segments: Vec<Segment>,
    tip_rotation: Matrix3<f64>,
    tip_translation: Vector3<f64>,
    meshes: Vec<Mesh>,
}

impl Model {
    /// The robot's name in its URDF.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The link that is `Base`.
    pub fn base_link(&self) -> &str {
        &self.base_link
    }

    /// The link that is `Flange`.
    pub fn tip_link(&self) -> &str {
        &self.tip_link
    }

    /// How many joints move independently.
    pub fn joints(&self) -> usize {
        self.limits.len()
    }

    /// Their names, from base to tip.
    pub fn joint_names(&self) -> &[String] {
        &self.names
    }

    /// Whether a joint slides (m) instead of turning (rad).
    pub fn slides(&self, joint: usize) -> bool {
        self.segments.iter().any(|segment| segment.joint == joint && segment.slides && segment.scale != 0.0)
    }

    /// Their limits, from base to tip.
    pub fn limits(&self) -> &[JointLimit] {
        &self.limits
    }

    /// The meshes that were found on disk.
    pub fn meshes(&self) -> &[Mesh] {
        &self.meshes
    }

    /// The first joint that is outside its limits by more than `slack` (rad, m), or is not finite.
    pub fn outside_limits(&self, joints: &Joints, slack: f64) -> Option<usize> {
        let inside = |(q, limit): (f64, &JointLimit)| q >= limit.lower - slack && q <= limit.upper + slack;
        joints.iter().zip(&self.limits).position(|pair| !inside(pair))
    }

    /// Where the flange is. Not finite when `joints` has another length than the model or is not finite itself.
    pub fn forward(&self, joints: &Joints) -> Pose<Base, Flange> {
        let (rotation, translation) = self.walk(joints, |_, _, _| {});
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        // FRAMES: the product of every transform of the chain from the base link to the tip link.
        Pose::assume(Isometry3::from_parts(Translation3::from(translation), rotation))
    }

    /// Whether a whole turn of this joint brings every link back to where it was.
    fn turns_freely(&self, joint: usize) -> bool {
        let moved = self.segments.iter().filter(|segment| segment.joint == joint);
        moved.clone().all(|segment| !segment.slides && segment.scale.fract() == 0.0)
    }

    /// The geometric Jacobian of a tool's origin. Not finite where [`Self::forward`] is not.
    pub fn jacobian<T: Frame>(&self, joints: &Joints, flange_from_tool: &Pose<Flange, T>) -> Jacobian {
        self.reach(joints, flange_from_tool.isometry()).jacobian
    }

    /// The tool's place and Jacobian in one walk along the chain.
    pub(crate) fn reach(&self, joints: &Joints, flange_from_tool: &Isometry3<f64>) -> Reach {
        // A joint turns points about its axis z through o with z × (p - o): the part that does not hold p is summed
        // on the way out, the other once the tool's place p is known.
        let mut turning = [Vector3::zeros(); crate::MAX_JOINTS];
        let mut moment = [Vector3::zeros(); crate::MAX_JOINTS];
        let (rotation, position) = self.walk(joints, |segment, rotation, origin| {
            let axis = rotation.column(2) * segment.scale;
            if segment.slides {
                moment[segment.joint] += axis;
            } else {
                turning[segment.joint] += axis;
                moment[segment.joint] += origin.cross(&axis);
            }
        });
        let position = position + rotation * flange_from_tool.translation.vector;
        let rotation = rotation * flange_from_tool.rotation.to_rotation_matrix().matrix();
        let mut matrix = SMatrix::<f64, 6, { crate::MAX_JOINTS }>::zeros();
        for (j, (turning, moment)) in turning.iter().zip(&moment).enumerate().take(self.joints()) {
            matrix.fixed_view_mut::<3, 1>(0, j).copy_from(&(turning.cross(&position) + moment));
            matrix.fixed_view_mut::<3, 1>(3, j).copy_from(turning);
        }
        Reach { rotation, position, jacobian: Jacobian { matrix, len: self.joints() } }
    }

    /// Goes along the chain; at each moving joint `at` gets the joint's system in `Base` (its axis is z; about or
    /// along z it has not moved yet, or has: the axis is the same). Gives the flange's rotation and place.
    fn walk(
        &self,
        joints: &Joints,
        mut at: impl FnMut(&Segment, &Matrix3<f64>, &Vector3<f64>),
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let mut rotation = Matrix3::identity();
        let mut place = Vector3::zeros();
        let right_length = joints.len() == self.joints();
        for segment in &self.segments {
            place += rotation * segment.translation;
            rotation *= segment.rotation;
            at(segment, &rotation, &place);
            let q = if right_length { joints[segment.joint] } else { f64::NAN };
            let moved = segment.scale * q + segment.offset;
            if segment.slides {
                place += rotation.column(2) * moved;
            } else {
                rotation = turned_about_z(&rotation, moved);
            }
        }
        (rotation * self.tip_rotation, place + rotation * self.tip_translation)
    }
}

/// A tool's place in `Base`, and its Jacobian there.
pub(crate) struct Reach {
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) position: Vector3<f64>,
    pub(crate) jacobian: Jacobian,
}

/// `rotation * Rz(angle)`: only the first two columns change.
fn turned_about_z(rotation: &Matrix3<f64>, angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    let (x, y) = (rotation.column(0), rotation.column(1));
    Matrix3::from_columns(&[x * c + y * s, y * c - x * s, rotation.column(2).into_owned()])
}
