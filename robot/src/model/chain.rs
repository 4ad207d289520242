//! From a URDF's tree to the one chain between two links.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use urdf_rs::{Joint, JointType};

use super::urdf::{Tree, refuse_unsupported};
use super::{JointLimit, Model, ModelError, Segment, Value};
use crate::MAX_JOINTS;

/// A joint on the way from base to tip, and whether the way goes through it from child to parent.
struct Step<'a> {
    joint: &'a Joint,
    backwards: bool,
}

/// What moves a joint: an independent joint of the chain, as `scale * q + offset`.
struct Drive<'a> {
    master: &'a Joint,
    scale: f64,
    offset: f64,
}

pub(super) fn model(tree: &Tree<'_>, base_link: &str, tip_link: &str) -> Result<Model, ModelError> {
    let steps = way(tree, base_link, tip_link)?;
    let masters = independent(tree, &steps, base_link, tip_link)?;
    let mut limits = masters.iter().map(|joint| tree.limit(joint)).collect::<Result<Vec<_>, _>>()?;
    let mut builder = Builder::default();
    for step in &steps {
        let origin = tree.origin(step.joint)?;
        if step.joint.joint_type == JointType::Fixed {
            builder.fixed(if step.backwards { origin.inverse() } else { origin });
            continue;
        }
        let drive = drive(tree, &masters, step.joint)?;
        let index = masters.iter().position(|master| std::ptr::eq(*master, drive.master)).unwrap_or_default();
        if step.joint.mimic.is_some() {
            limits[index] = narrowed(tree, step.joint, &drive, limits[index])?;
        }
        builder.moving(step, tree.axis(step.joint)?, origin, index, &drive);
    }
    Ok(Model {
        name: tree.robot.name.clone(),
        base_link: base_link.into(),
        tip_link: tip_link.into(),
        names: masters.iter().map(|joint| joint.name.clone()).collect(),
        limits,
        tip_rotation: builder.pending.rotation.to_rotation_matrix().into_inner(),
        tip_translation: builder.pending.translation.vector,
        segments: builder.segments,
        meshes: Vec::new(),
    })
}

/// Up from the base to the common ancestor, then down to the tip.
fn way<'a>(tree: &Tree<'a>, base_link: &str, tip_link: &str) -> Result<Vec<Step<'a>>, ModelError> {
    let (mut up, mut down) = (tree.way_up(base_link)?, tree.way_up(tip_link)?);
    let root = |way: &[&Joint], link: &str| way.last().map_or(link.to_owned(), |top| top.parent.link.clone());
    let (base_root, tip_root) = (root(&up, base_link), root(&down, tip_link));
    if base_root != tip_root {
        return Err(ModelError::NoChain {
            file: tree.file.into(),
            base: base_link.into(),
            tip: tip_link.into(),
            root: tip_root,
        });
    }
    while let (Some(a), Some(b)) = (up.last(), down.last()) {
        if !std::ptr::eq(*a, *b) {
            break;
        }
        up.pop();
        down.pop();
    }
    let up = up.into_iter().map(|joint| Step { joint, backwards: true });
    let down = down.into_iter().rev().map(|joint| Step { joint, backwards: false });
    let steps: Vec<_> = up.chain(down).collect();
    steps.iter().try_for_each(|step| refuse_unsupported(tree, step.joint))?;
    Ok(steps)
}

/// The joints of the chain that move by themselves.
fn independent<'a>(
    tree: &Tree<'a>,
    steps: &[Step<'a>],
    base_link: &str,
    tip_link: &str,
) -> Result<Vec<&'a Joint>, ModelError> {
    let moves = |joint: &Joint| joint.joint_type != JointType::Fixed && joint.mimic.is_none();
    let masters: Vec<_> = steps.iter().map(|step| step.joint).filter(|joint| moves(joint)).collect();
    let (file, base, tip) = (tree.file.into(), base_link.into(), tip_link.into());
    let lost = steps.iter().find(|step| step.joint.joint_type != JointType::Fixed);
    match (masters.len(), lost) {
        (0, None) => Err(ModelError::NoJoints { file, base, tip }),
        (0, Some(step)) => {
            Err(drive(tree, &masters, step.joint).err().unwrap_or(ModelError::NoJoints { file, base, tip }))
        }
        (found, _) if found > MAX_JOINTS => Err(ModelError::TooManyJoints { file, base, tip, found }),
        _ => Ok(masters),
    }
}

/// Follows a mimic joint to the joint that moves it, through other mimic joints if need be.
fn drive<'a>(tree: &Tree<'a>, masters: &[&'a Joint], joint: &'a Joint) -> Result<Drive<'a>, ModelError> {
    let (mut here, mut scale, mut offset) = (joint, 1.0, 0.0);
    for _ in 0..=tree.robot.joints.len() {
        let Some(mimic) = &here.mimic else {
            let on_chain = masters.iter().any(|master| std::ptr::eq(*master, here));
            return if on_chain {
                Ok(Drive { master: here, scale, offset })
            } else {
                Err(broken(
                    tree,
                    joint,
                    &here.name,
                    "which does not move between base and tip; choose links with it",
                ))
            };
        };
        let (by, plus) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
        finite(tree, here, "mimic multiplier", by)?;
        finite(tree, here, "mimic offset", plus)?;
        (scale, offset) = (scale * by, offset + scale * plus);
        here =
            tree.robot.joints.iter().find(|other| other.name == mimic.joint).ok_or_else(|| {
                broken(tree, joint, &mimic.joint, "which is not in the file; correct the name")
            })?;
    }
    Err(broken(tree, joint, &here.name, "which mimics it in turn; let one of them move by itself"))
}

fn broken(tree: &Tree<'_>, joint: &Joint, master: &str, why: &'static str) -> ModelError {
    ModelError::Mimic { file: tree.file.into(), joint: joint.name.clone(), master: master.into(), why }
}

fn finite(tree: &Tree<'_>, joint: &Joint, field: &'static str, value: f64) -> Result<(), ModelError> {
    // A gear beyond a thousand is a damaged number, and its square would drown every other joint.
    if value.abs() <= 1000.0 {
        return Ok(());
    }
    Err(tree.number(joint, field, Value::One(value), "write a finite number within 1000 of zero"))
}

/// A mimic joint's own limits, where it has any, hold for its master too.
fn narrowed(
    tree: &Tree<'_>,
    joint: &Joint,
    drive: &Drive<'_>,
    master: JointLimit,
) -> Result<JointLimit, ModelError> {
    let own = &joint.limit;
    let range = Value::Range(own.lower, own.upper);
    if own.velocity.is_nan() || own.velocity < 0.0 {
        let fix = "write the highest speed (rad/s or m/s), above zero";
        return Err(tree.number(joint, "limit velocity", Value::One(own.velocity), fix));
    }
    if own.lower.is_nan() || own.upper.is_nan() || own.lower > own.upper {
        let fix = "lower must not be above upper, and both must be numbers";
        return Err(tree.number(joint, "limit lower to upper", range, fix));
    }
    // Left out, both read as zero: a mimic joint needs none.
    let given = own.lower < own.upper;
    let mut limit = master;
    if given && drive.scale != 0.0 && joint.joint_type != JointType::Continuous {
        let (a, b) = ((own.lower - drive.offset) / drive.scale, (own.upper - drive.offset) / drive.scale);
        (limit.lower, limit.upper) = (limit.lower.max(a.min(b)), limit.upper.min(a.max(b)));
    }
    if own.velocity > 0.0 && drive.scale != 0.0 {
        limit.velocity = limit.velocity.min(own.velocity / drive.scale.abs());
    }
    if limit.lower < limit.upper {
        return Ok(limit);
    }
    let fix = "with its master's limits no position is left: correct either";
    Err(tree.number(joint, "limit lower to upper", range, fix))
}

/// Folds fixed transforms into the moving joints, and turns each joint so that its axis is z.
struct Builder {
    segments: Vec<Segment>,
    /// From the last joint's moved system to here.
    pending: Isometry3<f64>,
}

impl Default for Builder {
    fn default() -> Self {
        Self { segments: Vec::new(), pending: Isometry3::identity() }
    }
}

impl Builder {
    fn fixed(&mut self, transform: Isometry3<f64>) {
        self.pending *= transform;
    }

    fn moving(
        &mut self,
        step: &Step<'_>,
        axis: Vector3<f64>,
        origin: Isometry3<f64>,
        index: usize,
        drive: &Drive<'_>,
    ) {
        // Backwards, (origin * motion)⁻¹ = motion⁻¹ * origin⁻¹: the joint moves about the reversed axis, first.
        let (before, axis, after) = match step.backwards {
            false => (origin, axis, Isometry3::identity()),
            true => (Isometry3::identity(), -axis, origin.inverse()),
        };
        let axis_from_z = z_onto(&axis);
        let place = self.pending * before * axis_from_z;
        self.segments.push(Segment {
            rotation: place.rotation.to_rotation_matrix().into_inner(),
            translation: place.translation.vector,
            slides: step.joint.joint_type == JointType::Prismatic,
            joint: index,
            scale: drive.scale,
            offset: drive.offset,
        });
        self.pending = axis_from_z.inverse() * after;
    }
}

/// A rotation that takes z onto `axis`.
fn z_onto(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}
