//! A small plant: a UR5e whose joints follow their commands with a lag, on a skin that is a spring, felt by a noisy
//! sensor that drifts. It knows nothing of paths or plans.

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Span, Stamp, Wrench};
use probepath_robot::{Arm, ArmFault, Command, Joints, Model, MotionLimits, Safety, State};

use crate::{Label, Path, PathPoint, ProbeArm, Side};

pub(crate) const DT: f64 = 0.002;

pub(crate) fn arm() -> ProbeArm {
    let model = Model::ur5e();
    let list = |pick: fn(&probepath_robot::JointLimit) -> f64| {
        Joints::from_slice(&model.limits().iter().map(pick).collect::<Vec<_>>()).unwrap()
    };
    let limits = MotionLimits {
        lower: list(|l| l.lower),
        upper: list(|l| l.upper),
        velocity: list(|l| l.velocity),
        acceleration: Joints::splat(6, 5.0),
        jerk: Joints::splat(6, 50.0),
    };
    // FRAMES: a made-up holder: the probe's face 150 mm in front of the flange.
    let flange_from_probe = Pose::assume(Isometry3::translation(0.0, 0.0, 0.15));
    ProbeArm { model, flange_from_probe, limits, period: Span::from_milliseconds(2) }
}

pub(crate) fn home() -> Joints {
    Joints::from_slice(&[0.0, -1.57, 1.57, -1.57, -1.57, 0.0]).unwrap()
}

/// The skin's height over the base at a place along y (m): hills, and what has changed since it was taught.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skin {
    pub(crate) stiffness: f64,
    pub(crate) bump: f64,
    pub(crate) wave: f64,
    /// Where the skin ends (m along y).
    pub(crate) until: f64,
}

impl Skin {
    pub(crate) fn taught(y: f64) -> f64 {
        0.12 + 0.006 * (25.0 * y).sin()
    }

    fn height(&self, y: f64) -> f64 {
        if y > self.until {
            return -1.0;
        }
        Self::taught(y) + self.bump * (std::f64::consts::TAU * y / self.wave).sin()
    }
}

/// A path as it is taught on the skin, pressed in by 2 mm, 150 mm long.
pub(crate) fn path() -> Path {
    let mut places = vec![Vector3::new(0.49, 0.05, 0.0)];
    for _ in 0..300 {
        let y = places[places.len() - 1].y;
        let slope = (Skin::taught(y + 1e-6) - Skin::taught(y - 1e-6)) / 2e-6;
        let sway: f64 = 0.01 * 20.0 * (20.0 * y).cos();
        places.push(places[places.len() - 1] + Vector3::new(sway, 1.0, slope).normalize() * 0.0005);
    }
    let points = places.iter().map(|p| {
        let z = Skin::taught(p.y) - 0.002;
        let turn = Vector3::new(std::f64::consts::PI, 0.05 * (18.0 * p.y).sin(), 0.1 * (12.0 * p.y).sin());
        // FRAMES: a made-up probe in the base, its face down.
        let base_from_probe = Pose::assume(Isometry3::new(Vector3::new(p.x, p.y, z), turn));
        PathPoint { base_from_probe, moved: Some((0.0, 0.0)) }
    });
    let label = Label { study: "S-002".into(), side: Side::Left, date: "2026-11-22".into() };
    Path::new(label, 0.0005, points.collect(), None).unwrap()
}

/// What truly happened at one tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Truth {
    pub(crate) commanded: Joints,
    /// The force of the skin, without noise (N).
    pub(crate) force_n: f64,
}

pub(crate) struct Plant {
    arm: ProbeArm,
    skin: Skin,
    commanded: Joints,
    position: Joints,
    /// A line of commands on their way: dead time.
    queue: Vec<Joints>,
    tick: u64,
    seed: u64,
    pub(crate) drift_n: f64,
    pub(crate) truth: Vec<Truth>,
}

const LAG_S: f64 = 0.008;
const NOISE_N: f64 = 0.05;

impl Plant {
    pub(crate) fn new(skin: Skin, start: Joints, seed: u64) -> Self {
        let (arm, queue) = (arm(), vec![start; 3]);
        Self {
            arm,
            skin,
            commanded: start,
            position: start,
            queue,
            tick: 0,
            seed,
            drift_n: 0.3,
            truth: Vec::new(),
        }
    }

    /// Between -1 and 1, the same for the same seed and tick (splitmix64).
    fn noise(&self, which: u64) -> f64 {
        let mut z = (self.seed << 40) ^ (self.tick << 8) ^ which;
        z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn state(&mut self) -> State {
        let base_from_probe = self.arm.probe(&self.position);
        let place = base_from_probe.origin().vector();
        let depth = (self.skin.height(place.y) - place.z).max(0.0);
        let force = depth * self.skin.stiffness;
        self.truth.push(Truth { commanded: self.commanded, force_n: force });
        let felt = base_from_probe.isometry().rotation.inverse() * Vector3::new(0.0, 0.0, force);
        let noise = Vector3::new(self.noise(1), self.noise(2), self.noise(3)) * (NOISE_N * 1.73)
            - Vector3::z() * self.drift_n;
        let mut position = self.position;
        for joint in 0..6 {
            position[joint] += 2e-6 * self.noise(10 + joint as u64);
        }
        State {
            tick: self.tick,
            stamp: Stamp::ZERO + Span::from_milliseconds(2 * self.tick as i64),
            position,
            velocity: Joints::zeros(6),
            commanded: self.commanded,
            wrench: Wrench::new(felt + noise, Vector3::zeros()),
            guiding: false,
            safety: Safety::Normal,
            age: Span::ZERO,
        }
    }
}

impl Arm for Plant {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        if let Command::Position(joints) = command {
            self.commanded = *joints;
        }
        self.queue.push(self.commanded);
        let wanted = self.queue.remove(0);
        self.position = self.position.zip(&wanted, |q, w| q + (w - q) * (DT / (LAG_S + DT)));
        self.tick += 1;
        Ok(self.state())
    }

    fn period(&self) -> Span {
        self.arm.period
    }

    fn joints(&self) -> usize {
        6
    }
}
