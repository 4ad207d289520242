//! The kinematic error: how the true chain differs from the model that the software knows.

use nalgebra::Vector3;
use probepath_frames::{Flange, Pose, Probe};
use probepath_robot::{Joints, Model, ModelError};
use serde::{Deserialize, Serialize};
use urdf_rs::JointType;

use crate::cell::CellError;
use crate::random::Stream;

/// Postures on which a chain's error is measured before it is scaled to the figure asked for.
const POSTURES: usize = 200;
/// How far the joints go from the start posture in them (rad).
const WORKSPACE_RAD: f64 = 0.6;
/// Before scaling: errors of a joint's place (m) and of its orientation (rad), one standard deviation.
const PLACE_M: f64 = 0.3e-3;
const TURN_RAD: f64 = 0.3e-3;

/// How well the arm is where its model says.
///
/// Accuracy is the mean distance between the probe's true place and the one the model gives, over the workspace;
/// repeatability the mean plus three standard deviations of the distance to the mean place, when a posture is reached
/// from any side (ISO 9283 reaches it from one side only).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KinematicError {
    /// None: the true chain is the model.
    Off,
    /// A UR e-series with its factory calibration: repeatability 0.03 mm (FIELD.md section 8); an accuracy of
    /// 0.10 mm, which is our assumption.
    #[default]
    UrESeries,
    /// The CRS F3 of [P1]: accuracy drawn from 0.50-0.70 mm, repeatability 0.20 mm (FIELD.md section 1).
    Paper,
    /// Other figures.
    Figures {
        /// Accuracy (mm).
        accuracy_mm: f64,
        /// Repeatability (mm).
        repeatability_mm: f64,
    },
}

impl KinematicError {
    /// Accuracy and repeatability (mm) as a data sheet of this kind of arm has them; one arm's own accuracy is drawn.
    pub fn sheet_mm(self) -> (f64, f64) {
        match self {
            Self::Off => (0.0, 0.0),
            Self::UrESeries => (0.10, 0.03),
            Self::Paper => (0.60, 0.20),
            Self::Figures { accuracy_mm, repeatability_mm } => (accuracy_mm, repeatability_mm),
        }
    }

    /// Accuracy and repeatability (m) of one arm of this kind.
    fn figures(self, stream: &mut Stream) -> (f64, f64) {
        let drawn_mm = stream.uniform(0.50, 0.70);
        let (accuracy_mm, repeatability_mm) = self.sheet_mm();
        let accuracy_mm = if self == Self::Paper { drawn_mm } else { accuracy_mm };
        (accuracy_mm * 1e-3, repeatability_mm * 1e-3)
    }
}

/// The chain as it was truly built, and the play in its gears.
#[derive(Clone, Debug)]
pub(crate) struct TrueChain {
    pub(crate) model: Model,
    half_play: f64,
    output: Joints,
}

/// What the chain is built from: the text everybody knows, and where on it probe and workspace are.
pub(crate) struct Blueprint<'a> {
    pub(crate) urdf: &'a str,
    pub(crate) base_link: &'a str,
    pub(crate) tip_link: &'a str,
    pub(crate) flange_from_probe: Pose<Flange, Probe>,
    pub(crate) start: Joints,
}

impl TrueChain {
    pub(crate) fn new(
        blueprint: &Blueprint<'_>,
        error: KinematicError,
        seed: u64,
    ) -> Result<Self, CellError> {
        let mut stream = Stream::new(seed, "kinematic error");
        let (accuracy, repeatability) = error.figures(&mut stream);
        let nominal = blueprint.model()?;
        let deviations = Deviations::draw(nominal.joints(), &mut stream);
        let unit = error_over_workspace(blueprint, &nominal, &deviations.built(blueprint, 1.0)?, &mut stream);
        let model = if accuracy > 0.0 { deviations.built(blueprint, accuracy / unit)? } else { nominal };
        let half_play = repeatability / spread_per_play(blueprint, &model, &mut stream);
        let output = each(&blueprint.start, |q| q + half_play * stream.uniform(-1.0, 1.0));
        Ok(Self { model, half_play, output })
    }

    /// Where the joints truly are when the motors are at `motors`: the gears follow with their play, so the way that
    /// a posture was reached stays in it.
    pub(crate) fn follow(&mut self, motors: &Joints) -> Joints {
        let play = self.half_play;
        self.output = self.output.zip(motors, |output, motor| output.clamp(motor - play, motor + play));
        self.output
    }

    /// Motors that are anywhere in their play when the joints have come to `reached`.
    pub(crate) fn motors(&self, reached: &Joints, stream: &mut Stream) -> Joints {
        each(reached, |q| q + self.half_play * stream.uniform(-1.0, 1.0))
    }
}

impl Blueprint<'_> {
    fn model(&self) -> Result<Model, ModelError> {
        self.model_of(self.urdf)
    }

    fn model_of(&self, text: &str) -> Result<Model, ModelError> {
        Ok(Model::from_urdf(text, "the simulated arm", self.base_link, self.tip_link)?.0)
    }
}

/// Small errors of every moving joint's place and orientation, in units of [`PLACE_M`] and [`TURN_RAD`].
struct Deviations(Vec<(Vector3<f64>, Vector3<f64>)>);

impl Deviations {
    fn draw(joints: usize, stream: &mut Stream) -> Self {
        Self((0..joints).map(|_| (stream.normal3(), stream.normal3())).collect())
    }

    /// The chain with these errors, `scale` times as large.
    fn built(&self, blueprint: &Blueprint<'_>, scale: f64) -> Result<Model, CellError> {
        let mut robot = urdf_rs::read_from_string(blueprint.urdf).map_err(|e| CellError::urdf(&e))?;
        let moving = robot.joints.iter_mut().filter(|joint| joint.joint_type != JointType::Fixed);
        for (joint, (place, turn)) in moving.zip(&self.0) {
            for axis in 0..3 {
                joint.origin.xyz[axis] += scale * PLACE_M * place[axis];
                joint.origin.rpy[axis] += scale * TURN_RAD * turn[axis];
            }
        }
        let text = urdf_rs::write_to_string(&robot).map_err(|e| CellError::urdf(&e))?;
        Ok(blueprint.model_of(&text)?)
    }
}

/// Mean distance of the probe in two models over the workspace (m).
fn error_over_workspace(blueprint: &Blueprint<'_>, a: &Model, b: &Model, stream: &mut Stream) -> f64 {
    let sum: f64 = (0..POSTURES)
        .map(|_| {
            let q = each(&blueprint.start, |q| q + stream.uniform(-WORKSPACE_RAD, WORKSPACE_RAD));
            let probe = |model: &Model| model.forward(&q) * blueprint.flange_from_probe;
            probe(a).origin().distance(&probe(b).origin())
        })
        .sum();
    sum / POSTURES as f64
}

/// Repeatability (m) for one radian of half play: the joints at either end of their play, at random.
fn spread_per_play(blueprint: &Blueprint<'_>, model: &Model, stream: &mut Stream) -> f64 {
    let small = 1e-5;
    let probe = |q: &Joints| (model.forward(q) * blueprint.flange_from_probe).origin();
    let middle = probe(&blueprint.start);
    let distances: Vec<f64> = (0..POSTURES)
        .map(|_| {
            let mut reached = |q: f64| if stream.uniform(-1.0, 1.0) < 0.0 { q - small } else { q + small };
            probe(&each(&blueprint.start, &mut reached)).distance(&middle) / small
        })
        .collect();
    let (mean, deviation) = mean_and_deviation(&distances);
    mean + 3.0 * deviation
}

/// Each joint through `f`, which may draw.
fn each(joints: &Joints, mut f: impl FnMut(f64) -> f64) -> Joints {
    let mut all = *joints;
    all.as_mut_slice().iter_mut().for_each(|q| *q = f(*q));
    all
}

pub(crate) fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    (mean, square.sqrt())
}
