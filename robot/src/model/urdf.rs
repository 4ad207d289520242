//! Reading a URDF: XML to joints that have been checked one by one.
//!
//! `urdf-rs` accepts NaN axes, gives missing limits as 0 to 0, and does not look at the tree, so everything is
//! checked here.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use urdf_rs::{Joint, JointType, Robot};

use super::{JointLimit, Model, ModelError, ModelWarning, Value, chain, mesh, text};

/// An arm is metres long: a kilometre is a wrong unit or a damaged number.
const MAX_LENGTH_M: f64 = 1000.0;

impl Model {
    /// The chain between two links of a URDF. `source` names the text in messages, and is the file beside which
    /// meshes are looked for.
    ///
    /// The base may be anywhere in the tree: joints between it and the common ancestor are gone through backwards.
    ///
    /// # Errors
    /// When the text is no URDF, a link does not exist or no chain joins them, a number cannot be, or a joint on the
    /// chain is of a kind that is not supported: see [`ModelError`].
    pub fn from_urdf(
        text: &str,
        source: &str,
        base_link: &str,
        tip_link: &str,
    ) -> Result<(Self, Vec<ModelWarning>), ModelError> {
        let robot = parse(text, source)?;
        let tree = Tree::of(&robot, source)?;
        let mut model = chain::model(&tree, base_link, tip_link)?;
        let (meshes, mut warnings) = mesh::find(&robot, source);
        model.meshes = meshes;
        warnings.extend(left_out(&robot));
        Ok((model, warnings))
    }

    /// [`Model::from_urdf`] of a file.
    ///
    /// # Errors
    /// When the file cannot be read, and as [`Model::from_urdf`].
    pub fn from_urdf_file(
        path: &Path,
        base_link: &str,
        tip_link: &str,
    ) -> Result<(Self, Vec<ModelWarning>), ModelError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|cause| ModelError::Unreadable { file: file.clone(), why: cause.to_string() })?;
        Self::from_urdf(&text, &file, base_link, tip_link)
    }
}

fn parse(text: &str, source: &str) -> Result<Robot, ModelError> {
    let not_urdf = |why: String| ModelError::NotUrdf { file: source.into(), why };
    // Editors of one large system begin a text file with this mark; it is no part of the XML.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text::check(text).map_err(not_urdf)?;
    let robot = urdf_rs::read_from_string(text).map_err(|cause| not_urdf(cause.to_string()))?;
    if robot.links.is_empty() {
        return Err(not_urdf("it has no link".into()));
    }
    Ok(robot)
}

fn left_out(robot: &Robot) -> impl Iterator<Item = ModelWarning> + '_ {
    robot.joints.iter().filter_map(|joint| {
        let kind = unsupported(&joint.joint_type)?;
        Some(ModelWarning::JointLeftOut { joint: joint.name.clone(), kind })
    })
}

fn unsupported(kind: &JointType) -> Option<&'static str> {
    match kind {
        JointType::Floating => Some("floating"),
        JointType::Planar => Some("planar"),
        JointType::Spherical => Some("spherical"),
        JointType::Revolute | JointType::Continuous | JointType::Prismatic | JointType::Fixed => None,
    }
}

/// The links and joints by name, each name once, each joint between two links that exist.
pub(super) struct Tree<'a> {
    pub(super) file: &'a str,
    pub(super) robot: &'a Robot,
    /// The joint above each link.
    above: HashMap<&'a str, &'a Joint>,
}

impl<'a> Tree<'a> {
    fn of(robot: &'a Robot, file: &'a str) -> Result<Self, ModelError> {
        unique(file, "link", robot.links.iter().map(|link| link.name.as_str()))?;
        unique(file, "joint", robot.joints.iter().map(|joint| joint.name.as_str()))?;
        let mut tree = Self { file, robot, above: HashMap::new() };
        for joint in &robot.joints {
            tree.known(joint, "parent", &joint.parent.link)?;
            tree.known(joint, "child", &joint.child.link)?;
            if let Some(first) = tree.above.insert(&joint.child.link, joint) {
                return Err(ModelError::TwoParents {
                    file: file.into(),
                    link: joint.child.link.clone(),
                    first: first.name.clone(),
                    second: joint.name.clone(),
                });
            }
        }
        Ok(tree)
    }

    fn has(&self, link: &str) -> bool {
        self.robot.links.iter().any(|other| other.name == link)
    }

    fn known(&self, joint: &Joint, field: &'static str, link: &str) -> Result<(), ModelError> {
        if self.has(link) {
            return Ok(());
        }
        Err(ModelError::UnknownLink {
            file: self.file.into(),
            joint: joint.name.clone(),
            field,
            link: link.into(),
        })
    }

    /// The joints from a link up to the root of its tree.
    ///
    /// # Errors
    /// When the link does not exist, or the way up is a loop.
    pub(super) fn way_up(&self, link: &str) -> Result<Vec<&'a Joint>, ModelError> {
        if !self.has(link) {
            let exist = self.robot.links.iter().map(|link| link.name.clone()).collect();
            return Err(ModelError::NoSuchLink { file: self.file.into(), link: link.into(), exist });
        }
        let (mut way, mut here) = (Vec::new(), link);
        while let Some(joint) = self.above.get(here) {
            way.push(*joint);
            here = &joint.parent.link;
            if way.len() > self.robot.joints.len() {
                return Err(ModelError::Loop {
                    file: self.file.into(),
                    joint: joint.name.clone(),
                    link: here.into(),
                });
            }
        }
        Ok(way)
    }

    pub(super) fn number(
        &self,
        joint: &Joint,
        field: &'static str,
        value: Value,
        fix: &'static str,
    ) -> ModelError {
        ModelError::Number { file: self.file.into(), joint: joint.name.clone(), field, value, fix }
    }

    /// The joint's system at zero, in its parent link.
    pub(super) fn origin(&self, joint: &Joint) -> Result<Isometry3<f64>, ModelError> {
        let (xyz, rpy) = (joint.origin.xyz.0, joint.origin.rpy.0);
        if !xyz.iter().all(|x| x.abs() <= MAX_LENGTH_M) {
            let fix = "write three finite lengths in metres, each below 1000";
            return Err(self.number(joint, "origin xyz", Value::Three(xyz), fix));
        }
        if !rpy.iter().all(|x| x.is_finite()) {
            return Err(self.number(
                joint,
                "origin rpy",
                Value::Three(rpy),
                "write three finite angles in radians",
            ));
        }
        let rotation = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        Ok(Isometry3::from_parts(Translation3::new(xyz[0], xyz[1], xyz[2]), rotation))
    }

    /// The joint's axis, of unit length, in its own system.
    pub(super) fn axis(&self, joint: &Joint) -> Result<Vector3<f64>, ModelError> {
        let axis = Vector3::from(joint.axis.xyz.0);
        let length = axis.norm();
        // Unit length is asked for by the format; rounded axes are common, tiny ones are damage.
        if !(length.is_finite() && length > 1e-3) {
            let fix = "write a direction of length one, as in \"0 0 1\"";
            return Err(self.number(joint, "axis xyz", Value::Three(joint.axis.xyz.0), fix));
        }
        Ok(axis / length)
    }

    /// The limits of a joint that moves by itself.
    pub(super) fn limit(&self, joint: &Joint) -> Result<JointLimit, ModelError> {
        let limit = &joint.limit;
        if !(limit.velocity.is_finite() && limit.velocity > 0.0) {
            let fix = "write the highest speed of the data sheet (rad/s or m/s) as <limit velocity=...>";
            return Err(self.number(joint, "limit velocity", Value::One(limit.velocity), fix));
        }
        if limit.effort.is_nan() || limit.effort < 0.0 {
            let fix = "write the highest torque (N m) or force (N), zero or above";
            return Err(self.number(joint, "limit effort", Value::One(limit.effort), fix));
        }
        let (lower, upper) = self.range(joint)?;
        Ok(JointLimit { lower, upper, velocity: limit.velocity, effort: limit.effort })
    }

    fn range(&self, joint: &Joint) -> Result<(f64, f64), ModelError> {
        if joint.joint_type == JointType::Continuous {
            return Ok((f64::NEG_INFINITY, f64::INFINITY));
        }
        let (lower, upper) = (joint.limit.lower, joint.limit.upper);
        let range = Value::Range(lower, upper);
        if !(lower.is_finite() && upper.is_finite()) {
            return Err(self.number(
                joint,
                "limit lower to upper",
                range,
                "write two finite numbers (rad or m)",
            ));
        }
        if lower > upper {
            return Err(self.number(
                joint,
                "limit lower to upper",
                range,
                "lower must not be above upper: swap them",
            ));
        }
        if upper <= lower {
            let fix = "write both limits (a missing one reads as 0), or make the joint fixed";
            return Err(self.number(joint, "limit lower to upper", range, fix));
        }
        Ok((lower, upper))
    }
}

fn unique<'a>(
    file: &str,
    what: &'static str,
    names: impl Iterator<Item = &'a str>,
) -> Result<(), ModelError> {
    let mut seen = std::collections::HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(ModelError::Duplicate { file: file.into(), what, name: name.into() });
        }
    }
    Ok(())
}

pub(super) fn refuse_unsupported(tree: &Tree<'_>, joint: &Joint) -> Result<(), ModelError> {
    match unsupported(&joint.joint_type) {
        None => Ok(()),
        Some(kind) => {
            Err(ModelError::NotSupported { file: tree.file.into(), joint: joint.name.clone(), kind })
        }
    }
}
