//! `probepath arm`: what the model of an arm says.

use std::fmt;
use std::path::Path;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Pose};
use probepath_robot::{InverseOptions, Joints, Model, ModelError, NoInverse, WrongJoints};
use serde::Serialize;
use thiserror::Error;

/// What is asked of a model.
#[derive(Clone, Debug, Default)]
pub struct ArmQuestion {
    /// A URDF file, or `ur5e` or `seven_joint`.
    pub urdf: String,
    /// The chain's first link; the file's root when absent.
    pub base: Option<String>,
    /// The chain's last link; the end of the longest chain when absent.
    pub tip: Option<String>,
    /// Joint positions (degrees, mm).
    pub joints_deg: Option<Vec<f64>>,
    /// Position (mm) and rotation vector (degrees) of the flange.
    pub flange_mm_deg: Option<Vec<f64>>,
}

/// What the model says.
#[derive(Clone, Debug, Serialize)]
pub struct ArmAnswer {
    /// The arm's name.
    pub name: String,
    /// First link.
    pub base: String,
    /// Last link.
    pub tip: String,
    /// Joint by joint.
    pub joints: Vec<JointRow>,
    /// What the file says that is not used.
    pub warnings: Vec<String>,
    /// Where the flange is, when joints were given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forward: Option<Forward>,
    /// Which joints put the flange there, when a pose was given (degrees, mm).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inverse_deg: Option<Vec<f64>>,
}

/// One joint.
#[derive(Clone, Debug, Serialize)]
pub struct JointRow {
    /// Its name.
    pub name: String,
    /// The unit of its numbers: `degrees`, or `mm` for a joint that slides.
    pub unit: &'static str,
    /// Lower limit.
    pub lower: f64,
    /// Upper limit.
    pub upper: f64,
    /// Speed limit, a second.
    pub velocity_per_s: f64,
}

/// Forward kinematics.
#[derive(Clone, Debug, Serialize)]
pub struct Forward {
    /// Flange in Base (mm).
    pub position_mm: [f64; 3],
    /// Rotation vector of the flange in Base (degrees).
    pub rotation_deg: [f64; 3],
    /// Smallest singular value of the Jacobian: distance to a singular posture.
    pub smallest_singular_value: f64,
    /// Yoshikawa's manipulability.
    pub manipulability: f64,
}

/// Why a question has no answer.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ArmError {
    /// The URDF.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The number of joints.
    #[error("{0}")]
    Joints(#[from] WrongJoints),
    /// Another number of joints than the arm has.
    #[error("{given} joint positions were given, the arm has {needed}: {names}")]
    Count {
        /// Given.
        given: usize,
        /// Needed.
        needed: usize,
        /// The joints' names.
        names: String,
    },
    /// A pose that is not six finite numbers.
    #[error(
        "a flange pose is six finite numbers (x, y, z in mm, rotation vector in degrees); {given} were given"
    )]
    Pose {
        /// Given.
        given: usize,
    },
    /// Inverse kinematics found nothing.
    #[error("no joints put the flange there: {0}")]
    Inverse(#[from] NoInverse),
}

/// Asks a model.
///
/// # Errors
/// When the URDF is none, has no such links, or the question does not fit the arm.
pub fn arm(question: &ArmQuestion) -> Result<ArmAnswer, ArmError> {
    let (model, warnings) = load(question)?;
    Ok(ArmAnswer {
        name: model.name().to_owned(),
        base: model.base_link().to_owned(),
        tip: model.tip_link().to_owned(),
        joints: model
            .joint_names()
            .iter()
            .zip(model.limits())
            .enumerate()
            .map(|(joint, (name, limit))| JointRow {
                name: name.clone(),
                unit: if model.slides(joint) { "mm" } else { "degrees" },
                lower: shown(&model, joint, limit.lower),
                upper: shown(&model, joint, limit.upper),
                velocity_per_s: shown(&model, joint, limit.velocity),
            })
            .collect(),
        warnings,
        forward: question.joints_deg.as_deref().map(|q| forward(&model, q)).transpose()?,
        inverse_deg: question.flange_mm_deg.as_deref().map(|p| inverse(&model, p)).transpose()?,
    })
}

fn load(question: &ArmQuestion) -> Result<(Model, Vec<String>), ArmError> {
    match (question.urdf.as_str(), &question.base, &question.tip) {
        ("ur5e", None, None) => return Ok((Model::ur5e(), Vec::new())),
        ("seven_joint", None, None) => return Ok((Model::seven_joint(), Vec::new())),
        _ => {}
    }
    let file = Path::new(&question.urdf);
    let (base, tip) = match (&question.base, &question.tip) {
        (Some(base), Some(tip)) => (base.clone(), tip.clone()),
        (base, tip) => {
            let unreadable = |why: std::io::Error| ModelError::Unreadable {
                file: question.urdf.clone(),
                why: why.to_string(),
            };
            let text = std::fs::read_to_string(file).map_err(unreadable)?;
            let (root, ends) = Model::ends_of_urdf(&text, &question.urdf)?;
            let end = ends.into_iter().next().unwrap_or_else(|| root.clone());
            (base.clone().unwrap_or(root), tip.clone().unwrap_or(end))
        }
    };
    let (model, warnings) = Model::from_urdf_file(file, &base, &tip)?;
    Ok((model, warnings.iter().map(ToString::to_string).collect()))
}

/// A position or a rate of a joint as people read it: degrees, or mm where it slides.
fn shown(model: &Model, joint: usize, value: f64) -> f64 {
    if model.slides(joint) { value * 1e3 } else { value.to_degrees() }
}

fn forward(model: &Model, degrees: &[f64]) -> Result<Forward, ArmError> {
    if degrees.len() != model.joints() {
        let names = model.joint_names().join(", ");
        return Err(ArmError::Count { given: degrees.len(), needed: model.joints(), names });
    }
    let mut joints = Joints::from_slice(degrees)?;
    for joint in 0..joints.len() {
        joints[joint] *= if model.slides(joint) { 1e-3 } else { 1f64.to_radians() };
    }
    let base_from_flange = model.forward(&joints);
    let jacobian = model.jacobian(&joints, &Pose::<Flange, Flange>::identity());
    let turn = base_from_flange.isometry().rotation.scaled_axis();
    Ok(Forward {
        position_mm: (base_from_flange.origin().vector() * 1e3).into(),
        rotation_deg: turn.map(f64::to_degrees).into(),
        smallest_singular_value: jacobian.smallest_singular_value(),
        manipulability: jacobian.manipulability(),
    })
}

fn inverse(model: &Model, pose: &[f64]) -> Result<Vec<f64>, ArmError> {
    let &[x, y, z, rx, ry, rz] = pose else { return Err(ArmError::Pose { given: pose.len() }) };
    if pose.iter().any(|v| !v.is_finite()) {
        return Err(ArmError::Pose { given: pose.len() });
    }
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz).map(f64::to_radians));
    // FRAMES: the question names the flange's pose in the base, in the units of its name.
    let target = Pose::<Base, Flange>::assume(Isometry3::from_parts(
        Translation3::new(x * 1e-3, y * 1e-3, z * 1e-3),
        turn,
    ));
    let middle = middle(model);
    let joints =
        model.inverse(&target, &Pose::<Flange, Flange>::identity(), &middle, &InverseOptions::default())?;
    Ok(joints.iter().enumerate().map(|(joint, position)| shown(model, joint, position)).collect())
}

/// The posture in the middle of every joint's range: nobody said where the arm is.
fn middle(model: &Model) -> Joints {
    let mut middle = Joints::zeros(model.joints());
    for (i, limit) in model.limits().iter().enumerate() {
        let centre = (limit.lower + limit.upper) / 2.0;
        middle[i] = if centre.is_finite() { centre } else { 0.0 };
    }
    middle
}

impl fmt::Display for ArmAnswer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} joints from {} to {}", self.name, self.joints.len(), self.base, self.tip)?;
        for joint in &self.joints {
            let (low, high, speed, unit) = (joint.lower, joint.upper, joint.velocity_per_s, joint.unit);
            writeln!(
                f,
                "  {:<24} {low:>8.1} to {high:>7.1} {unit}, at most {speed:.0} {unit}/s",
                joint.name
            )?;
        }
        for warning in &self.warnings {
            writeln!(f, "  note: {warning}")?;
        }
        if let Some(forward) = &self.forward {
            let [x, y, z] = forward.position_mm;
            let [rx, ry, rz] = forward.rotation_deg;
            writeln!(
                f,
                "flange at {x:.3}, {y:.3}, {z:.3} mm, rotation vector {rx:.3}, {ry:.3}, {rz:.3} degrees"
            )?;
            writeln!(
                f,
                "smallest singular value {:.4}, manipulability {:.4}",
                forward.smallest_singular_value, forward.manipulability
            )?;
        }
        if let Some(joints) = &self.inverse_deg {
            let shown: Vec<String> = joints.iter().map(|q| format!("{q:.4}")).collect();
            writeln!(f, "joints: {}", shown.join(", "))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_home() {
        let joints = vec![10.0, -90.0, 80.0, -80.0, -90.0, 5.0];
        let there =
            arm(&ArmQuestion { urdf: "ur5e".into(), joints_deg: Some(joints), ..ArmQuestion::default() })
                .unwrap();
        let forward = there.forward.unwrap();
        let flange: Vec<f64> = forward.position_mm.into_iter().chain(forward.rotation_deg).collect();
        let back = arm(&ArmQuestion {
            urdf: "ur5e".into(),
            flange_mm_deg: Some(flange.clone()),
            ..ArmQuestion::default()
        })
        .unwrap();
        let again =
            arm(&ArmQuestion { urdf: "ur5e".into(), joints_deg: back.inverse_deg, ..ArmQuestion::default() })
                .unwrap()
                .forward
                .unwrap();
        for (a, b) in again.position_mm.iter().zip(&flange) {
            assert!((a - b).abs() < 1e-6, "{again:?}");
        }
    }

    #[test]
    fn a_rail_is_in_millimetres_and_the_ends_of_a_chain_are_found() {
        let urdf = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/golden/kinematics/gantry.urdf");
        let gantry = arm(&ArmQuestion { urdf: urdf.into(), ..ArmQuestion::default() }).unwrap();
        let units: Vec<_> = gantry.joints.iter().map(|joint| joint.unit).collect();
        assert!(units.contains(&"mm") && units.contains(&"degrees"), "{gantry}");
        let at = |first: f64| {
            let mut joints = vec![0.0; units.len()];
            joints[units.iter().position(|unit| *unit == "mm").unwrap()] = first;
            let question =
                ArmQuestion { urdf: urdf.into(), joints_deg: Some(joints), ..ArmQuestion::default() };
            nalgebra::Vector3::from(arm(&question).unwrap().forward.unwrap().position_mm)
        };
        // A rail moved by a millimetre moves the flange by as many as ride on it: at least one.
        assert!((at(1.0) - at(0.0)).norm() > 0.999);
    }

    #[test]
    fn five_joints_for_six_are_refused_by_name() {
        let five =
            ArmQuestion { urdf: "ur5e".into(), joints_deg: Some(vec![0.0; 5]), ..ArmQuestion::default() };
        assert!(arm(&five).unwrap_err().to_string().contains("wrist_3_joint"));
    }
}
