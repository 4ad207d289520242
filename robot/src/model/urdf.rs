//! Reading a URDF: XML to joints that have been checked one by one.
//!
//! `urdf-rs` accepts NaN axes, gives missing limits as 0 to 0, and does not look at the tree, so everything is
//! checked here.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use urdf_rs::{Joint, JointType, Robot};

use super::{JointLimit, Model, ModelError, ModelWarning, Value, chain, mesh, text};

/// The longest file that is read: the longest URDFs of whole humanoids are a hundred times shorter.
const MAX_BYTES: u64 = 32 << 20;

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
        let text = read(path)?;
        Self::from_urdf(&text, &path.display().to_string(), base_link, tip_link)
    }

    /// The root link of a URDF and, of its tree, the links that nothing hangs from: what to offer a person as base and
    /// tip. The tip with the most moving joints below the root comes first.
    ///
    /// # Errors
    /// When the text is no URDF, its names do not fit, or its joints are a ring.
    pub fn ends_of_urdf(text: &str, source: &str) -> Result<(String, Vec<String>), ModelError> {
        let robot = parse(text, source)?;
        let tree = Tree::of(&robot, source)?;
        let holds = |link: &str| robot.joints.iter().any(|joint| joint.parent.link == link);
        let mut tips = Vec::new();
        if let Some(ring) = robot.links.iter().find_map(|link| tree.way_up(&link.name).err()) {
            return Err(ring);
        }
        for link in robot.links.iter().filter(|link| !holds(&link.name)) {
            let way = tree.way_up(&link.name)?;
            let moving =
                way.iter().filter(|joint| joint.joint_type != JointType::Fixed && joint.mimic.is_none());
            let root = way.last().map_or(&link.name, |top| &top.parent.link);
            tips.push((moving.count(), root, &link.name));
        }
        // Stable, so that of equals the first in the file stays first.
        tips.sort_by_key(|(moving, _, _)| std::cmp::Reverse(*moving));
        let root = tips.first().map(|(_, root, _)| (*root).clone()).unwrap_or_default();
        let tips =
            tips.iter().filter(|(_, top, _)| **top == root).map(|(_, _, tip)| (*tip).clone()).collect();
        Ok((root, tips))
    }
}

fn read(path: &Path) -> Result<String, ModelError> {
    let unreadable = |why: String| ModelError::Unreadable { file: path.display().to_string(), why };
    let file = std::fs::File::open(path).map_err(|cause| unreadable(cause.to_string()))?;
    let mut text = String::new();
    let length =
        file.take(MAX_BYTES + 1).read_to_string(&mut text).map_err(|cause| unreadable(cause.to_string()))?;
    if length as u64 > MAX_BYTES {
        return Err(unreadable("it is longer than 32 MiB, which no URDF is".into()));
    }
    Ok(text)
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
                return Err(self.looped(joint));
            }
        }
        Ok(way)
    }

    fn looped(&self, joint: &Joint) -> ModelError {
        let (file, link) = (self.file.into(), joint.parent.link.clone());
        ModelError::Loop { file, joint: joint.name.clone(), link }
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
