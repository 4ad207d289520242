//! [`SimulatedArm`]: the arm of the simulated cell.

pub(crate) mod error;
pub(crate) mod give_way;
pub(crate) mod sensor;
pub(crate) mod servo;
pub(crate) mod tool;

use nalgebra::Vector3;
use probepath_frames::{Span, Wrench};
use probepath_robot::{Arm, ArmFault, Command, Joints, Safety, State};

pub use error::KinematicError;
pub use sensor::SensorConfig;
pub use tool::ToolConfig;

use crate::arm::give_way::GiveWay;
use crate::cell::{Scene, Shared, TICK};
use crate::knobs::ArmKnobs;

/// A command may be this much faster than a joint's limit before the arm stops by itself.
const TOO_FAST: f64 = 1.05;

/// One connection to the simulated arm. Every exchange moves the cell's time on by a tick of 2 ms, at once.
///
/// It behaves as a position-controlled industrial arm: joints follow with a servo's lag, a command of another number
/// of joints or with NaN is refused, one that jumps or leaves the joints' limits makes the arm stop by itself. After
/// a fault it brakes, and every further exchange of this connection gives the same fault; connect again to go on.
#[derive(Debug)]
pub struct SimulatedArm {
    scene: Shared,
    knobs: ArmKnobs,
    ticks: u64,
    since_s: f64,
    way: GiveWay,
    fault: Option<ArmFault>,
}

impl SimulatedArm {
    pub(crate) fn new(scene: Shared, knobs: ArmKnobs) -> Self {
        let since_s = scene.lock().now().seconds();
        scene.lock().connect();
        Self { scene, knobs, ticks: 0, since_s, way: GiveWay::default(), fault: None }
    }

    /// The command for the servo, or why the arm does not take it.
    fn taken(&mut self, command: &Command, scene: &Scene) -> Result<Joints, ArmFault> {
        let tick = self.ticks + 1;
        let next = match command {
            Command::Stay => return Ok(scene.braked()),
            Command::Position(next) => next,
            Command::Freedrive => return self.given_way(scene),
        };
        let expected = scene.told().len();
        if next.len() != expected {
            let why = format!("it has {} joints and the arm has {expected}", next.len());
            return Err(ArmFault::Refused { tick, why });
        }
        if let Some(joint) = next.iter().position(|q| !q.is_finite()) {
            let why = format!("joint {joint} is {}; send a finite position", next[joint]);
            return Err(ArmFault::Refused { tick, why });
        }
        self.possible(next, scene)?;
        Ok(*next)
    }

    /// Where skin and hand push it, in freedrive: its motors carry arm and tool.
    fn given_way(&mut self, scene: &Scene) -> Result<Joints, ArmFault> {
        let (outside, told) = (scene.last().skin + scene.last().hand, scene.told());
        let velocity = self.way.step(&scene.in_base(&outside), |velocity| velocity, TICK.seconds());
        let next = scene.moved(told, &velocity, TICK.seconds()).ok_or_else(|| ArmFault::ProtectiveStop {
            tick: self.ticks,
            why: "it was guided into a singular posture".into(),
        })?;
        self.possible(&next, scene)?;
        Ok(next)
    }

    /// What a real arm's controller would not follow.
    fn possible(&self, next: &Joints, scene: &Scene) -> Result<(), ArmFault> {
        for (joint, limit) in scene.limits().iter().enumerate() {
            let (q, told) = (next[joint], scene.told()[joint]);
            let speed = (q - told).abs() / TICK.seconds();
            let why = if speed > TOO_FAST * limit.velocity {
                format!(
                    "joint {joint} was told to move at {speed:.2} rad/s, its limit is {:.2}",
                    limit.velocity
                )
            } else if q < limit.lower - 1e-9 || q > limit.upper + 1e-9 {
                format!(
                    "joint {joint} was told to go to {q:.4} rad, its limits are {:.4} to {:.4}",
                    limit.lower, limit.upper
                )
            } else {
                continue;
            };
            return Err(ArmFault::ProtectiveStop { tick: self.ticks, why });
        }
        Ok(())
    }

    /// A failure that a knob asks for, or a push that is too hard, at the tick that was just done.
    fn failed(&self, scene: &Scene) -> Option<ArmFault> {
        let reached = |tick: Option<u64>| tick.is_some_and(|tick| scene.tick() >= tick);
        let tick = self.ticks;
        if reached(self.knobs.connection_lost_at_tick) && !scene.recovered() {
            return Some(ArmFault::ConnectionLost { tick, why: "no packet came (knob)".into() });
        }
        if reached(self.knobs.protective_stop_at_tick) && !scene.recovered() {
            return Some(ArmFault::ProtectiveStop {
                tick,
                why: "the controller's own supervision (knob)".into(),
            });
        }
        let pushed = scene.pushed_n();
        if pushed > scene.stops_above_n() {
            let why =
                format!("it was pushed with {pushed:.0} N, it stops above {:.0} N", scene.stops_above_n());
            return Some(ArmFault::ProtectiveStop { tick, why });
        }
        None
    }

    /// What is measured at the tick that was just done.
    fn state(&self, scene: &mut Scene) -> State {
        let elapsed = scene.now().seconds() - self.since_s;
        let (position, velocity) = scene.encoders();
        let mut wrench = scene.sensed(elapsed);
        if self.knobs.wrench_not_a_number.is_some_and(|ticks| ticks.has(scene.tick())) {
            wrench = Wrench::new(Vector3::repeat(f64::NAN), Vector3::repeat(f64::NAN));
        }
        State {
            tick: self.ticks,
            stamp: scene.now(),
            position,
            velocity,
            commanded: *scene.told(),
            wrench,
            guiding: scene.guiding(),
            safety: Safety::Normal,
            age: Span::ZERO,
        }
    }
}

impl Arm for SimulatedArm {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let shared = self.scene.clone();
        let mut scene = shared.lock();
        if let Some(fault) = &self.fault {
            let rest = scene.braked();
            scene.advance(&rest);
            return Err(fault.clone());
        }
        if *command != Command::Freedrive {
            self.way = GiveWay::default();
        }
        let next = self.taken(command, &scene);
        let told = next.as_ref().copied().unwrap_or_else(|_| scene.braked());
        scene.advance(&told);
        self.ticks += 1;
        while self.knobs.skipped.is_some_and(|ticks| ticks.has(scene.tick())) {
            scene.advance(&told);
            self.ticks += 1;
        }
        let state = self.state(&mut scene);
        // A refused command is the caller's mistake, and the arm, once braked, takes the next; the others last.
        if let Err(refused @ ArmFault::Refused { .. }) = next {
            return Err(refused);
        }
        self.fault = next.err().or_else(|| self.failed(&scene));
        self.fault.clone().map_or(Ok(state), Err)
    }

    fn period(&self) -> Span {
        TICK
    }

    fn joints(&self) -> usize {
        self.scene.lock().told().len()
    }
}
