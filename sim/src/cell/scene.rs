//! The one world that arm, machine and hand share.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nalgebra::{Vector3, Vector6};
use probepath_frames::{Pose, Probe, Stamp, Twist, World, Wrench};
use probepath_robot::{JointLimit, Joints, Model};

use super::config::{ArmConfig, CellConfig};
use super::nominal::Nominal;
use super::{CellError, TICK};
use crate::arm::error::{Blueprint, TrueChain};
use crate::arm::give_way;
use crate::arm::sensor::Sensor;
use crate::arm::servo::Servo;
use crate::disturbance::{Disturbance, DisturbanceConfig};
use crate::hand::{Course, Hand, HandConfig};
use crate::random::Stream;
use crate::skin::Skin;
use crate::subject::Subject;

/// What truly was at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// When.
    pub stamp: Stamp,
    /// The joints as they truly were, beyond the gears' play (rad, m).
    pub joints: Joints,
    /// Where the probe truly was.
    pub world_from_probe: Pose<World, Probe>,
    /// What the skin did to it.
    pub skin: Wrench<Probe>,
    /// What the hand did to it.
    pub hand: Wrench<Probe>,
    /// Whether the hand held the switch.
    pub guiding: bool,
}

/// A handle on the world.
#[derive(Clone, Debug)]
pub(crate) struct Shared(Arc<Mutex<Scene>>);

impl Shared {
    pub(crate) fn new(scene: Scene) -> Self {
        Self(Arc::new(Mutex::new(scene)))
    }

    /// The world, for one caller at a time. A caller that panicked left it between two ticks, which is harmless.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Scene> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the world has moved on past `before`, or for as long as `patience`; gives its time.
    pub(crate) fn wait_beyond(&self, before: Stamp, patience: Duration) -> Stamp {
        let scene = self.lock();
        let moved = Arc::clone(&scene.moved);
        let waited = moved.wait_timeout_while(scene, patience, |scene| scene.now() <= before);
        waited.unwrap_or_else(PoisonError::into_inner).0.now()
    }
}

/// What may touch the probe: asked while the world goes on, so that no tick waits for a picture.
#[derive(Clone, Debug)]
pub(crate) struct Surroundings {
    subject: Arc<Subject>,
    skin: Arc<Skin>,
    disturbance: Disturbance,
}

impl Surroundings {
    /// Where gel joins the face to the skin, or water to all that is under it, along the probe's x (m).
    pub(crate) fn touched(&self, world_from_probe: &Pose<World, Probe>) -> Option<(f64, f64)> {
        if let Some(tank) = self.subject.tank() {
            return tank.wet(world_from_probe);
        }
        self.skin.touched(&*self.subject, world_from_probe, &self.disturbance)
    }
}

/// The world: what lies there, how the arm stands, and everything that was.
#[derive(Debug)]
pub(crate) struct Scene {
    subject: Arc<Subject>,
    skin: Arc<Skin>,
    nominal: Nominal,
    config: ArmConfig,
    chain: TrueChain,
    servo: Servo,
    sensor: Sensor,
    encoder: Stream,
    hand: Option<Hand>,
    disturbance: Disturbance,
    seed: u64,
    guided: u64,
    connections: u64,
    moments: VecDeque<Moment>,
    /// How many moments were forgotten before the first that is kept.
    forgotten: u64,
    /// Told at every tick.
    moved: Arc<Condvar>,
}

impl Scene {
    pub(crate) fn new(
        config: &CellConfig,
        nominal: Nominal,
        subject: Arc<Subject>,
        seed: u64,
    ) -> Result<Self, CellError> {
        let blueprint = Blueprint {
            urdf: nominal.urdf,
            base_link: nominal.base_link,
            tip_link: nominal.tip_link,
            flange_from_probe: nominal.flange_from_probe,
            start: nominal.start,
        };
        let mut scene = Self {
            subject,
            skin: Arc::new(Skin::new(&config.skin, seed)),
            config: config.arm.clone(),
            chain: TrueChain::new(&blueprint, config.arm.kinematic_error, seed)?,
            servo: Servo::new(nominal.start, config.arm.servo_lag_ms * 1e-3),
            sensor: Sensor::new(&config.sensor, TICK.seconds(), seed),
            encoder: Stream::new(seed, "encoder"),
            hand: None,
            disturbance: Disturbance::new(config.disturbance.clone(), Stamp::ZERO),
            seed,
            guided: 0,
            connections: 0,
            moments: VecDeque::new(),
            forgotten: 0,
            moved: Arc::default(),
            nominal,
        };
        let (joints, world_from_probe) = scene.reached();
        let (skin, hand) = (Wrench::zero(), Wrench::zero());
        let stamp = Stamp::ZERO;
        scene.moments.push_back(Moment { stamp, joints, world_from_probe, skin, hand, guiding: false });
        Ok(scene)
    }

    /// One tick: the servo, the gears, the hand, the skin.
    pub(crate) fn advance(&mut self, told: &Joints) {
        self.servo.step(told, TICK.seconds());
        let (joints, world_from_probe) = self.reached();
        let last = *self.last();
        let step = last.world_from_probe.twist_to(&world_from_probe);
        let per_s = 1.0 / TICK.seconds();
        let twist = Twist::new(step.linear * per_s, step.angular * per_s);
        let now = last.stamp + TICK;
        let skin = self.pressed(&world_from_probe, &twist, now);
        let felt = skin.force.norm();
        let grip = self.hand.as_mut().map(|hand| hand.step(&world_from_probe, &twist, felt, TICK.seconds()));
        let (hand, guiding) = grip.map_or((Wrench::zero(), false), |grip| (grip.wrench, grip.guiding));
        self.moments.push_back(Moment { stamp: now, joints, world_from_probe, skin, hand, guiding });
        self.moved.notify_all();
    }

    /// What the skin does to the probe, wherever the leg has moved.
    fn pressed(
        &self,
        world_from_probe: &Pose<World, Probe>,
        twist: &Twist<Probe>,
        now: Stamp,
    ) -> Wrench<Probe> {
        let moving = world_from_probe.isometry().rotation.inverse() * self.disturbance.velocity(now);
        let twist = Twist::new(twist.linear - moving, twist.angular);
        let on_leg = self.disturbance.on_leg(world_from_probe, now);
        self.skin.press(&*self.subject, &on_leg, &twist, &self.disturbance)
    }

    /// From now on the contact is disturbed like this.
    pub(crate) fn disturb(&mut self, config: &DisturbanceConfig) {
        self.disturbance = Disturbance::new(config.clone(), self.now());
    }

    /// The probe as the leg had it at an instant: what the picture shows, and what gel joins. Where the probe was, but
    /// for the leg's own motion.
    pub(crate) fn leg_from_probe(&self, at: Stamp) -> Option<Pose<World, Probe>> {
        Some(self.disturbance.on_leg(&self.world_from_probe(at)?, at))
    }

    /// Where the motors' positions truly bring the probe.
    fn reached(&mut self) -> (Joints, Pose<World, Probe>) {
        let joints = self.chain.follow(self.servo.position());
        let base_from_probe = self.chain.model.forward(&joints) * self.nominal.flange_from_probe;
        (joints, self.nominal.world_from_base * base_from_probe)
    }

    /// A hand takes the probe, where there is a vessel to guide it along.
    pub(crate) fn guide(&mut self, config: &HandConfig) {
        let Some(vessel) = self.subject.main() else { return };
        let from_m = self.subject.origin_m() + config.start_mm * 1e-3;
        let length_m = (config.length_mm * 1e-3).min(vessel.length_m() - from_m);
        let course = Course::over(&*self.subject, &self.skin, vessel, from_m, length_m);
        let seed = self.seed.wrapping_add(self.guided);
        self.hand = Some(Hand::new(config, course, self.last().world_from_probe, seed));
        self.guided += 1;
    }

    pub(crate) fn let_go(&mut self) {
        if let Some(hand) = &mut self.hand {
            hand.let_go();
        }
    }

    pub(crate) fn hand_guides(&self) -> bool {
        self.hand.as_ref().is_some_and(Hand::guides)
    }

    /// A connection takes the sensor's bias off.
    pub(crate) fn connect(&mut self) {
        self.connections += 1;
    }

    /// Whether somebody connected again, which recovers from what a knob did.
    pub(crate) const fn recovered(&self) -> bool {
        self.connections > 1
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "there is a first moment from the beginning, and the last is never removed"
    )]
    pub(crate) fn last(&self) -> &Moment {
        &self.moments[self.moments.len() - 1]
    }

    /// Keeps the last `most` moments.
    pub(crate) fn forget_before(&mut self, most: usize) {
        while self.moments.len() > most.max(1) {
            self.moments.pop_front();
            self.forgotten += 1;
        }
    }

    pub(crate) fn moments(&self) -> impl Iterator<Item = &Moment> {
        self.moments.iter()
    }

    /// Ticks since the world's beginning.
    pub(crate) fn tick(&self) -> u64 {
        self.forgotten + self.moments.len() as u64 - 1
    }

    pub(crate) fn now(&self) -> Stamp {
        self.last().stamp
    }

    pub(crate) const fn told(&self) -> &Joints {
        self.servo.told()
    }

    /// How hard the arm brakes by its own means (rad/s²).
    pub(crate) const fn braking_rad_s2(&self) -> f64 {
        self.config.braking_rad_s2
    }

    /// A wrench on the probe in Base's axes, by the model: force, then torque about the probe's origin.
    pub(crate) fn in_base(&self, wrench: &Wrench<Probe>) -> Vector6<f64> {
        let base_from_probe = self.nominal.model().forward(self.told()) * self.nominal.flange_from_probe;
        let turn = base_from_probe.isometry().rotation;
        let (force, torque) = (turn * wrench.force, turn * wrench.torque);
        Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
    }

    /// Joints that move the probe with `velocity` (Base's axes) for `seconds`; `None` near a singularity.
    pub(crate) fn moved(&self, from: &Joints, velocity: &Vector6<f64>, seconds: f64) -> Option<Joints> {
        give_way::moved(self.nominal.model(), &self.nominal.flange_from_probe, from, velocity, seconds)
    }

    /// How far the joints are behind a steady motion (s).
    pub(crate) fn servo_lag_s(&self) -> f64 {
        self.config.servo_lag_ms * 1e-3
    }

    /// Whether the motors stand.
    pub(crate) fn motors_at_rest(&self) -> bool {
        self.servo.velocity().largest() < 1e-6
    }

    /// The tool's true weight on the probe.
    pub(crate) fn tool_weight(&self) -> Wrench<Probe> {
        self.config.tool.weight(&self.last().world_from_probe, &self.nominal.flange_from_probe)
    }

    /// The clock shows at least `least` from now on: what was before is moved along, once, before anything looked at it.
    pub(crate) fn start_clock_at(&mut self, least: Stamp) {
        let late = least - self.now();
        if late.nanoseconds() > 0 {
            self.moments.iter_mut().for_each(|moment| moment.stamp = moment.stamp + late);
        }
    }

    pub(crate) fn braked(&self) -> Joints {
        self.servo.braked(self.config.braking_rad_s2, TICK.seconds())
    }

    pub(crate) fn limits(&self) -> &[JointLimit] {
        self.nominal.model().limits()
    }

    pub(crate) const fn stops_above_n(&self) -> f64 {
        self.config.stops_above_n
    }

    /// How hard skin and hand push together (N).
    pub(crate) fn pushed_n(&self) -> f64 {
        (self.last().skin + self.last().hand).force.norm()
    }

    pub(crate) fn guiding(&self) -> bool {
        self.last().guiding
    }

    /// The motors' encoders: position and velocity.
    pub(crate) fn encoders(&mut self) -> (Joints, Joints) {
        let noisy = |joints: &Joints, deviation: f64, stream: &mut Stream| {
            let mut all = *joints;
            all.as_mut_slice().iter_mut().for_each(|q| *q += deviation * stream.normal());
            all
        };
        let position = noisy(self.servo.position(), self.config.position_noise_rad, &mut self.encoder);
        (position, noisy(self.servo.velocity(), self.config.velocity_noise_rad_s, &mut self.encoder))
    }

    /// What the force sensor reads, `elapsed_s` after its bias was taken off.
    pub(crate) fn sensed(&mut self, elapsed_s: f64) -> Wrench<Probe> {
        let truth = self.last().skin + self.last().hand;
        let drift = Vector3::new(0.0, 0.0, self.disturbance.drift_n(self.now()));
        self.sensor.read(truth + Wrench::new(drift, Vector3::zeros()), elapsed_s)
    }

    /// Where the probe truly was between two ticks; `None` before the beginning and after now.
    pub(crate) fn world_from_probe(&self, at: Stamp) -> Option<Pose<World, Probe>> {
        let since = (at - self.moments.front()?.stamp).nanoseconds();
        let index = usize::try_from(since / TICK.nanoseconds()).ok().filter(|_| since >= 0)?;
        let before = self.moments.get(index)?;
        let fraction = (at - before.stamp).seconds() / TICK.seconds();
        if at == before.stamp {
            return Some(before.world_from_probe);
        }
        Some(before.world_from_probe.interpolate(&self.moments.get(index + 1)?.world_from_probe, fraction))
    }

    /// The chain as it was truly built.
    pub(crate) const fn true_model(&self) -> &Model {
        &self.chain.model
    }

    /// Where the motors may be when the joints have come to `reached` from any side.
    pub(crate) fn motors_that_reach(&self, reached: &Joints, stream: &mut Stream) -> Joints {
        self.chain.motors(reached, stream)
    }

    pub(crate) const fn encoder_noise_rad(&self) -> f64 {
        self.config.position_noise_rad
    }

    /// What may touch the probe, as it is now.
    pub(crate) fn surroundings(&self) -> Surroundings {
        let disturbance = self.disturbance.clone();
        Surroundings { subject: self.subject.clone(), skin: self.skin.clone(), disturbance }
    }
}
