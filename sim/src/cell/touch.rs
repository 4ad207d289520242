//! A ball pointer on the arm: what a person who guides it by hand into the phantom's landmarks records.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Base, Flange, Frame, Point, Pose, World};
use probepath_robot::{InverseOptions, Joints};

use super::nominal::Nominal;
use super::scene::Scene;
use super::{CellError, SimulatedCell};
use crate::random::Stream;
use crate::subject::Subject;
use crate::tank::{WirePhantomConfig, WireTank};

/// How far the pointer is tilted off the vertical, and turned about it, at most (degrees).
const TILT_DEG: f64 = 25.0;
const TURN_DEG: f64 = 60.0;
/// How often another posture is tried where the arm does not reach.
const TRIES: u32 = 50;

/// One record of the pointer in a landmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    /// The landmark's place in the phantom's list.
    pub landmark: usize,
    /// The joints as the encoders gave them.
    pub joints: Joints,
    /// Where the arm's model says the flange was.
    pub base_from_flange: Pose<Base, Flange>,
    /// The same in the World.
    pub world_from_flange: Pose<World, Flange>,
}

impl SimulatedCell {
    /// The ball pointer in every landmark of the phantom, in `postures` postures of the arm each ([P1] II.B.2.b: ten),
    /// recorded with the arm's own error. The records of one landmark are also a pivot calibration of the pointer.
    /// The arm of the cell does not move for it. Nothing where there are no landmarks.
    ///
    /// # Errors
    /// When the arm does not reach a landmark.
    pub fn touches(&self, postures: usize) -> Result<Vec<Touch>, CellError> {
        let (Subject::WirePhantom(tank), super::SubjectConfig::WirePhantom(config)) =
            (&*self.subject, &self.config.subject)
        else {
            return Ok(Vec::new());
        };
        let scene = self.scene.lock();
        let stream = Stream::new(self.seed, "touches");
        let mut toucher = Toucher { nominal: &self.nominal, scene: &scene, tank, config, stream };
        let landmarks = 0..tank.phantom().landmarks.len();
        landmarks
            .flat_map(|landmark| (0..postures).map(move |_| landmark))
            .map(|l| toucher.touch(l))
            .collect()
    }
}

/// The tip of the pointer. Origin: the ball's centre; axes: the flange's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tip;

impl Frame for Tip {
    const NAME: &'static str = "Tip";
}

/// What places the pointer.
struct Toucher<'a> {
    nominal: &'a Nominal,
    scene: &'a Scene,
    tank: &'a WireTank,
    config: &'a WirePhantomConfig,
    stream: Stream,
}

impl Toucher<'_> {
    /// One record: in another posture each time.
    fn touch(&mut self, landmark: usize) -> Result<Touch, CellError> {
        let rest = self.rest(landmark);
        let mut tried = self.reach(&rest);
        for _ in 1..TRIES {
            if tried.is_ok() {
                break;
            }
            tried = self.reach(&rest);
        }
        let motors = self.scene.motors_that_reach(&tried?, &mut self.stream);
        let noise = self.scene.encoder_noise_rad();
        let mut joints = motors;
        joints.as_mut_slice().iter_mut().for_each(|q| *q += noise * self.stream.normal());
        let base_from_flange = self.nominal.model().forward(&joints);
        let world_from_flange = self.nominal.world_from_base * base_from_flange;
        Ok(Touch { landmark, joints, base_from_flange, world_from_flange })
    }

    /// Where the tip comes to rest this time.
    fn rest(&mut self, landmark: usize) -> Point<World> {
        let at = self.tank.phantom().landmarks.get(landmark).map(|landmark| landmark.at);
        let middle = *self.tank.world_from_phantom() * at.unwrap_or(Point::new(0.0, 0.0, 0.0));
        let off = self.stream.normal3() * self.config.touch_error_mm * 1e-3;
        Point::from_vector(middle.vector() + off)
    }

    /// The joints, beyond the gears, that truly bring the tip to `rest` in a posture of chance.
    fn reach(&mut self, rest: &Point<World>) -> Result<Joints, CellError> {
        let mut angle = |most: f64| self.stream.uniform(-most, most).to_radians();
        let tilt = UnitQuaternion::from_euler_angles(angle(TILT_DEG), 0.0, angle(TILT_DEG));
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle(TURN_DEG));
        let down = Matrix3::from_columns(&[Vector3::x(), -Vector3::z(), Vector3::y()]);
        let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down));
        let placed = Isometry3::from_parts(Translation3::from(rest.vector()), tilt * turn * down);
        let tip = Isometry3::from(self.tank.pointer_tip().vector());
        // FRAMES: a system at the pointer's tip with the flange's axes; `placed` turns its z down and sets it in the
        // landmark.
        let (world_from_tip, flange_from_tip) =
            (Pose::<World, Tip>::assume(placed), Pose::<Flange, Tip>::assume(tip));
        let base_from_tip = self.nominal.world_from_base.inverse() * world_from_tip;
        let options = InverseOptions::default();
        let model = self.scene.true_model();
        Ok(model.inverse(&base_from_tip, &flange_from_tip, &self.nominal.start, &options)?)
    }
}
