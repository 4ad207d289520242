//! [`Robot`]: the arm as its controller sees it, one tick at a time: motion, force, safety, power.

pub(super) mod force;
pub(super) mod motion;
mod profile;
pub(super) mod reading;
pub(super) mod safety;

use std::collections::VecDeque;

use nalgebra::{Isometry3, UnitQuaternion, Vector6};
use probepath_frames::{Base, Flange, Pose, Probe};
use probepath_robot::{InverseOptions, Joints, Model};

use self::force::{ForceMode, Freedrive, Overlay};
use self::motion::{Motion, Target, servo_lag_s};
use self::reading::{ForceReading, Payload};
use self::safety::{Power, Safety};
use crate::arm::give_way::{GiveWay, difference, moved, reached};
use crate::cell::{Nominal, Shared, TICK};

/// A target may be this much faster than a joint's limit before the controller stops the arm.
const TOO_FAST: f64 = 1.05;
/// Joint positions that are remembered, newest first.
const HISTORY: usize = 512;
/// The UR5e's upper arm, and how high its shoulder is (m).
const UPPER_ARM_M: f64 = 0.425;
const SHOULDER_M: f64 = 0.1625;
/// Joints that turn slower than this (rad/s) are steady.
const STEADY_RAD_S: f64 = 0.01;

/// Where things are by the controller's own model.
#[derive(Clone, Debug)]
pub(super) struct Kinematics {
    pub(super) model: Model,
    /// Where the tool is on the flange, as it was told.
    pub(super) tcp: Isometry3<f64>,
}

impl Kinematics {
    pub(super) fn flange_from_tcp(&self) -> Pose<Flange, Probe> {
        // FRAMES: the controller's tool centre point stands in for the probe; it is where it was told to be.
        Pose::assume(self.tcp)
    }

    /// The tool in Base.
    pub(super) fn tool(&self, joints: &Joints) -> Isometry3<f64> {
        self.flange(joints) * self.tcp
    }

    /// The flange in Base.
    pub(super) fn flange(&self, joints: &Joints) -> Isometry3<f64> {
        *self.model.forward(joints).isometry()
    }

    /// The tool's velocity in Base's axes.
    pub(super) fn tool_velocity(&self, joints: &Joints, rates: &Joints) -> Vector6<f64> {
        self.model.jacobian(joints, &self.flange_from_tcp()).velocity(rates)
    }

    /// Joints near `seed` that bring the tool to `goal`.
    pub(super) fn joints_at(&self, goal: &Isometry3<f64>, seed: &Joints) -> Option<Joints> {
        reached(&self.model, &self.flange_from_tcp(), seed, goal)
    }

    /// The same from anywhere.
    pub(super) fn inverse(&self, goal: &Isometry3<f64>, near: &Joints) -> Option<Joints> {
        // FRAMES: the goal was written for the tool, in Base.
        let goal: Pose<Base, Probe> = Pose::assume(*goal);
        self.model.inverse(&goal, &self.flange_from_tcp(), near, &InverseOptions::default()).ok()
    }
}

/// A move that begins when the arm stands.
#[derive(Clone, Copy, Debug)]
pub(super) enum Wish {
    Joints { to: Joints, speed: f64, acceleration: f64 },
    Line { to: Isometry3<f64>, speed: f64, acceleration: f64 },
}

/// The arm, its controller's side.
#[derive(Debug)]
pub(super) struct Robot {
    pub(super) arm: Kinematics,
    payload: Payload,
    pub(super) safety: Safety,
    pub(super) power: Power,
    /// The pendant's speed slider, 0 to 1.
    pub(super) slider: f64,
    pub(super) force_gain: f64,
    pub(super) force_damping: f64,
    /// Why it stopped last, in words.
    pub(super) why: String,
    scene: Shared,
    target: Target,
    acceleration: Joints,
    motion: Motion,
    queued: Option<Wish>,
    overlay: Option<Overlay>,
    position: Joints,
    velocity: Joints,
    reading: ForceReading,
    history: VecDeque<Joints>,
    steady: u32,
}

impl Robot {
    pub(super) fn new(scene: Shared, nominal: &Nominal) -> Self {
        let told = *scene.lock().told();
        let now = scene.lock().now();
        let rest = Joints::zeros(told.len());
        let mut robot = Self {
            arm: Kinematics { model: nominal.model().clone(), tcp: Isometry3::identity() },
            payload: Payload::default(),
            safety: Safety::Normal,
            power: Power::Running,
            slider: 1.0,
            force_gain: 1.0,
            force_damping: 0.0,
            why: String::new(),
            reading: ForceReading::new(nominal, now),
            scene,
            target: Target { position: told, velocity: rest },
            acceleration: rest,
            motion: Motion::Stop { deceleration: 8.0 },
            queued: None,
            overlay: None,
            position: told,
            velocity: rest,
            history: VecDeque::with_capacity(HISTORY),
            steady: 0,
        };
        robot.measure();
        robot
    }

    /// One tick.
    pub(super) fn tick(&mut self) {
        let dt = TICK.seconds();
        self.begin_queued();
        let next = match self.next(dt) {
            Ok(next) => match self.refused(&next, dt) {
                None => next,
                Some(why) => self.stopped_instead(why, dt),
            },
            Err(why) => self.stopped_instead(why.to_owned(), dt),
        };
        let velocity = next.zip(&self.target.position, |now, before| (now - before) / dt);
        self.acceleration = velocity.zip(&self.target.velocity, |now, before| (now - before) / dt);
        self.target = Target { position: next, velocity };
        self.scene.lock().advance(&next);
        self.measure();
        self.check_push();
    }

    /// A move that is over leaves the arm standing, whatever becomes of its tool; the next may begin.
    fn begin_queued(&mut self) {
        if self.motion.is_over(&self.target) {
            self.motion = Motion::Stop { deceleration: self.scene.lock().braking_rad_s2() };
        }
        if self.target.velocity.largest() > 1e-9 {
            return;
        }
        let Some(wish) = self.queued.take() else { return };
        let here = self.target.position;
        self.motion = match wish {
            Wish::Joints { to, speed, acceleration } => Motion::to_joints(here, to, speed, acceleration),
            Wish::Line { to, speed, acceleration } => {
                Motion::to_place(self.arm.tool(&here), to, speed, acceleration)
            }
        };
    }

    /// Where the target goes next: the motion, with the axes that a force leads.
    fn next(&mut self, dt: f64) -> Result<Joints, &'static str> {
        let scaling = self.scaling();
        let nominal = self.motion.step(&self.target, &self.arm, dt, scaling)?;
        let Some(mut overlay) = self.overlay.take() else { return Ok(nominal) };
        let here = self.arm.tool(&self.target.position);
        let wanted = difference(&here, &self.arm.tool(&nominal)) / dt;
        let velocity = match &mut overlay {
            Overlay::Force(force) => {
                let felt = self.reading.felt();
                let tool = here.translation.vector;
                force.step(&wanted, &felt, &tool, self.force_gain, self.force_damping, dt)
            }
            Overlay::Freedrive(free) => {
                free.step(&self.reading.pushed(&self.scene.lock(), &self.payload), dt)
            }
        };
        self.overlay = Some(overlay);
        if velocity.amax() < 1e-9 {
            return Ok(self.target.position);
        }
        moved(&self.arm.model, &self.arm.flange_from_tcp(), &self.target.position, &velocity, dt)
            .ok_or("a compliant motion that meets a singularity")
    }

    /// Why the controller would not follow this target.
    fn refused(&self, next: &Joints, dt: f64) -> Option<String> {
        for (joint, limit) in self.arm.model.limits().iter().enumerate() {
            let speed = (next[joint] - self.target.position[joint]).abs() / dt;
            if speed.is_nan() || speed > TOO_FAST * limit.velocity {
                return Some(format!(
                    "joint {joint} would go at {speed:.2} rad/s, at most {:.2}",
                    limit.velocity
                ));
            }
            if !(limit.lower - 1e-9..=limit.upper + 1e-9).contains(&next[joint]) {
                let (low, high) = (limit.lower, limit.upper);
                return Some(format!(
                    "joint {joint} would go to {:.4} rad, {low:.4} to {high:.4}",
                    next[joint]
                ));
            }
        }
        None
    }

    fn stopped_instead(&mut self, why: String, dt: f64) -> Joints {
        self.protective_stop(why);
        let stop = self.motion.step(&self.target, &self.arm, dt, 1.0);
        stop.unwrap_or(self.target.position)
    }

    fn check_push(&mut self) {
        let (pushed, most) = {
            let scene = self.scene.lock();
            (scene.pushed_n(), scene.stops_above_n())
        };
        if pushed > most && self.safety.moves() {
            self.protective_stop(format!("it was pushed with {pushed:.0} N, it stops above {most:.0} N"));
        }
    }

    fn measure(&mut self) {
        let (position, velocity) = self.scene.lock().encoders();
        (self.position, self.velocity) = (position, velocity);
        self.history.truncate(HISTORY - 1);
        self.history.push_front(position);
        self.reading.measure(&mut self.scene.lock(), &self.arm, &position, &self.payload);
        let quick = velocity.largest() > STEADY_RAD_S || self.target.velocity.largest() > 1e-9;
        self.steady = if quick { 0 } else { self.steady.saturating_add(1) };
    }

    /// Speed of moves against what was programmed: the slider, and half in reduced mode.
    pub(super) fn scaling(&self) -> f64 {
        self.slider * if self.safety == Safety::Reduced { 0.5 } else { 1.0 }
    }

    /// The arm stops by itself; the program ends with it.
    pub(super) fn protective_stop(&mut self, why: String) {
        self.why = why;
        self.safety = Safety::ProtectiveStop;
        self.halt();
    }

    /// Brakes, whatever it was doing.
    pub(super) fn halt(&mut self) {
        let deceleration = self.scene.lock().braking_rad_s2();
        self.overlay = None;
        self.go(Motion::Stop { deceleration });
    }

    /// Another motion from now on.
    pub(super) fn go(&mut self, motion: Motion) {
        self.queued = None;
        self.motion = motion;
    }

    /// A move, once the arm stands.
    pub(super) fn wish(&mut self, wish: Wish) {
        if self.target.velocity.largest() > 1e-9 {
            self.motion = Motion::Stop { deceleration: self.scene.lock().braking_rad_s2() };
        }
        self.queued = Some(wish);
    }

    /// Whether a move or a stop is still under way.
    pub(super) fn is_busy(&self) -> bool {
        self.queued.is_some() || !self.motion.is_over(&self.target)
    }

    pub(super) fn force_mode(&mut self, mode: ForceMode) {
        let renewed = mode.renewed(self.overlay.as_ref());
        self.overlay = Some(Overlay::Force(renewed));
    }

    pub(super) fn freedrive(&mut self, axes: UnitQuaternion<f64>, free: [bool; 6]) {
        if !matches!(self.overlay, Some(Overlay::Freedrive(_))) {
            let way = GiveWay::default();
            self.overlay = Some(Overlay::Freedrive(Freedrive { axes, free, way }));
            self.go(Motion::Stop { deceleration: 8.0 });
        }
    }

    /// Ends force mode or freedrive.
    pub(super) fn stiffen(&mut self) {
        if self.overlay.take().is_some() {
            self.go(Motion::Stop { deceleration: 8.0 });
        }
    }

    pub(super) const fn is_free(&self) -> bool {
        matches!(self.overlay, Some(Overlay::Freedrive(_)))
    }

    /// What it carries from now on; readings under another payload are forgotten.
    pub(super) fn carry(&mut self, payload: Payload) {
        if payload != self.payload {
            self.payload = payload;
            self.reading.forget();
        }
    }

    pub(super) const fn payload(&self) -> &Payload {
        &self.payload
    }

    /// `zero_ftsensor`.
    pub(super) fn zero_force(&mut self) {
        self.reading.zero();
    }

    pub(super) const fn reading(&self) -> &ForceReading {
        &self.reading
    }

    pub(super) const fn target(&self) -> (&Joints, &Joints, &Joints) {
        (&self.target.position, &self.target.velocity, &self.acceleration)
    }

    pub(super) const fn measured(&self) -> (&Joints, &Joints) {
        (&self.position, &self.velocity)
    }

    /// Joint torques that what pushes at the tool costs (N m).
    pub(super) fn torques(&self) -> Joints {
        let felt = self.reading.felt();
        let (force, torque) = (felt.fixed_rows::<3>(0).into_owned(), felt.fixed_rows::<3>(3).into_owned());
        self.arm.model.jacobian(&self.position, &self.arm.flange_from_tcp()).torques(&force, &torque)
    }

    /// How hard it is pushed, of what stops it.
    pub(super) fn push_ratio(&self) -> f64 {
        let scene = self.scene.lock();
        (scene.pushed_n() / scene.stops_above_n()).min(1.0)
    }

    /// What an accelerometer in the tool feels (m/s², the flange's axes): gravity; the motion's own is left out.
    pub(super) fn accelerometer(&self) -> [f64; 3] {
        self.reading.gravity().into()
    }

    /// Where the elbow is, in the controller's base (m): it turns with the first two joints only.
    pub(super) fn elbow(&self) -> [f64; 3] {
        // Its DH parameters (d1, a2) are the UR5e's; the controller's base has x at -1 for a stretched arm at zero.
        let (pan, lift) = (self.position[0], self.position[1]);
        let (reach, height) = (-UPPER_ARM_M * lift.cos(), SHOULDER_M - UPPER_ARM_M * lift.sin());
        [reach * pan.cos(), reach * pan.sin(), height]
    }

    /// Where it was so many ticks ago.
    pub(super) fn earlier(&self, ticks: usize) -> Joints {
        self.history.get(ticks).or(self.history.back()).copied().unwrap_or(self.position)
    }

    /// How far behind a steady motion `servoj`'s target is, so that the joints are behind it by what its look-ahead and
    /// gain say: the joints' own lag is part of that.
    pub(super) fn servo_lag_s(&self, lookahead_s: f64, gain: f64) -> f64 {
        (servo_lag_s(lookahead_s, gain) - self.scene.lock().servo_lag_s()).max(TICK.seconds())
    }

    /// `is_steady`: still for half a second.
    pub(super) const fn is_steady(&self) -> bool {
        self.steady > 250
    }

    /// Whether anything still moves: the target, or the arm behind it.
    pub(super) fn is_at_rest(&self) -> bool {
        self.target.velocity.largest() < 1e-9 && self.scene.lock().motors_at_rest()
    }
}
