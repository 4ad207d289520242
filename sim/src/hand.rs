//! The virtual hand: guides the probe along the leg as a person would.
//!
//! It holds the probe's holder below the force sensor, sees the leg's surface and, in the picture, the artery; it is
//! a spring and a damper toward a place that wanders along the skin over the artery, with tremor, at an unsteady
//! speed, with pauses, turning back, hurrying, and lifting off. It presses until it feels the force that it wants. How
//! the arm gives way is the control software's business, not the hand's.

mod course;
mod plan;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use probepath_frames::{Pose, Probe, Twist, World, Wrench};
use serde::{Deserialize, Serialize};

use crate::random::{Stream, Wander};
pub(crate) use course::Course;
use plan::{Plan, Stroke};

/// How the hand guides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandConfig {
    /// How far along the artery's course (mm).
    pub length_mm: f64,
    /// Where it begins, from the groin's fold (leg) or the superior end (phantom), along the artery (mm).
    pub start_mm: f64,
    /// Its usual speed on the skin (mm/s); strokes differ by a factor of 0.7 to 1.3, a hurried one by 2.2.
    pub speed_mm_s: f64,
    /// The force it usually presses with (N); it wanders by a quarter.
    pub press_n: f64,
    /// Tremor and wander, as a multiple of a usual person's: 0 is a machine's hand.
    pub unsteadiness: f64,
    /// Whether it pauses, turns back, hurries and lifts on the way.
    pub mishaps: bool,
    /// How far it turns the probe about its beam, off square to the vessel (degrees), and leans it along the vessel.
    pub turn_deg: f64,
    /// See `turn_deg`.
    pub lean_deg: f64,
}

impl Default for HandConfig {
    fn default() -> Self {
        Self {
            length_mm: 220.0,
            start_mm: 5.0,
            speed_mm_s: 15.0,
            press_n: 4.5,
            unsteadiness: 1.0,
            mishaps: true,
            turn_deg: 0.0,
            lean_deg: 0.0,
        }
    }
}

/// The hand's spring along the probe's axes (N/m), about them (N m/rad), its dampers (N s/m, N m s/rad) and its
/// strength (N, N m). A stiffer hand, on software that bounds acceleration and jerk, swings up as a pilot does on a
/// slow aircraft: 400 N/m across did, at 1.5 Hz, on 60 N s/m with at most 0.8 m/s² and 8 m/s³.
const SPRING_N_M: [f64; 3] = [130.0, 130.0, 350.0];
const DAMPER_N_S_M: f64 = 12.0;
const TURN_SPRING_N_M: f64 = 4.0;
const TURN_DAMPER_N_M_S: f64 = 0.15;
const STRONGEST_N: f64 = 12.0;
const STRONGEST_N_M: f64 = 2.0;
/// Height over the skin from which it comes down, and to which it rises at the end (m).
const HOVER_M: f64 = 0.025;
/// Its speed through the air (m/s), and down to the skin (m/s).
const AIR_M_S: f64 = 0.060;
const DOWN_M_S: f64 = 0.015;
/// A hand feels that it drags and slows down, when the probe is left behind by more than this (m); at three times it
/// waits.
const SLOWS_AT_M: f64 = 0.010;
/// How fast it presses deeper for each newton that it misses (m/(N s)), and at most (m).
const PRESS_M_N_S: f64 = 0.003;
const DEEPEST_M: f64 = 0.045;
/// It has felt the skin from this force on (N).
const TOUCH_N: f64 = 0.7;

/// Where the hand is on its way.
///
/// ```text
/// Approach -> Descend -> Follow -> Rise -> Released
/// ```
#[derive(Clone, Debug, PartialEq)]
enum Phase {
    /// Through the air to the place over the start.
    Approach { from: Pose<World, Probe>, gone_m: f64 },
    /// Down, until it feels the skin.
    Descend,
    /// Along the plan's strokes.
    Follow { stroke: usize, waited_s: f64 },
    /// Up again.
    Rise,
    /// The switch is let go.
    Released,
}

/// A hand on the probe.
#[derive(Clone, Debug)]
pub(crate) struct Hand {
    config: HandConfig,
    course: Course,
    plan: Plan,
    habits: Habits,
    phase: Phase,
    clock_s: f64,
    /// Where along the course (m), and how fast (m/s).
    at_m: f64,
    speed_m_s: f64,
    /// How far under the skin it holds the spring's end (m); negative is above.
    depth_m: f64,
    last: Option<Pose<World, Probe>>,
    moving: Vector3<f64>,
}

/// A person's unsteadiness: slow wandering and tremor (3 to 8 Hz) of place and orientation.
#[derive(Clone, Debug)]
struct Habits {
    wander: [Wander; 4],
    tremor: [Wander; 6],
    press: Wander,
}

impl Habits {
    fn new(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "hand");
        let wander = std::array::from_fn(|_| Wander::new(&mut stream, 0.1, 0.4));
        let tremor = std::array::from_fn(|_| Wander::new(&mut stream, 3.0, 8.0));
        let press = Wander::new(&mut stream, 0.08, 0.25);
        Self { wander, tremor, press }
    }

    /// How far it is from where it means to be at `t` seconds: place (m); turn (rad) about x, y, z of the probe.
    fn at(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let place = Vector3::new(1.2e-3 * self.wander[0].at(t), 0.0, 0.0);
        (place, Vector3::from_fn(|i, _| 0.035 * self.wander[1 + i].at(t)))
    }

    /// The tremor at `t` seconds: force (N) and torque (N m).
    fn tremble(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let [force, torque] = [&self.tremor[..3], &self.tremor[3..]];
        let all = |wanders: &[Wander], size: f64| Vector3::from_fn(|i, _| size * wanders[i].at(t));
        (all(force, 0.15), all(torque, 0.01))
    }
}

/// What the hand does in one tick.
pub(crate) struct Grip {
    /// What it does to the probe.
    pub(crate) wrench: Wrench<Probe>,
    /// Whether it holds the switch.
    pub(crate) guiding: bool,
}

impl Hand {
    /// A hand that takes the probe at `from` and follows `course`.
    pub(crate) fn new(config: &HandConfig, course: Course, from: Pose<World, Probe>, seed: u64) -> Self {
        Self {
            config: config.clone(),
            plan: Plan::new(config, course.length_m(), seed),
            course,
            habits: Habits::new(seed),
            phase: Phase::Approach { from, gone_m: 0.0 },
            clock_s: 0.0,
            at_m: 0.0,
            speed_m_s: 0.0,
            depth_m: -HOVER_M,
            last: None,
            moving: Vector3::zeros(),
        }
    }

    /// Whether it still holds the probe.
    pub(crate) fn guides(&self) -> bool {
        self.phase != Phase::Released
    }

    /// Lets go at once.
    pub(crate) fn let_go(&mut self) {
        self.phase = Phase::Released;
    }

    /// One tick of `seconds`: the probe is at `probe`, moves with `twist`, and the skin pushes with `skin_n`.
    pub(crate) fn step(
        &mut self,
        probe: &Pose<World, Probe>,
        twist: &Twist<Probe>,
        skin_n: f64,
        seconds: f64,
    ) -> Grip {
        if !self.guides() {
            return Grip { wrench: Wrench::zero(), guiding: false };
        }
        let target = self.target();
        let pace = self.pace(&target, probe);
        self.clock_s += seconds;
        self.advance(skin_n, pace, seconds);
        let wrench = self.pull(&target, (probe, twist), seconds);
        Grip { wrench, guiding: self.guides() }
    }

    /// How much of its speed it keeps (0 to 1): less where the probe is left behind. What it presses on the skin with
    /// is no dragging.
    fn pace(&self, target: &Pose<World, Probe>, probe: &Pose<World, Probe>) -> f64 {
        let mut behind = (probe.inverse() * target.origin()).vector();
        if matches!(self.phase, Phase::Follow { .. }) {
            behind.z = 0.0;
        }
        (1.5 - behind.norm() / (2.0 * SLOWS_AT_M)).clamp(0.0, 1.0)
    }

    /// Where the spring's end is now.
    fn target(&self) -> Pose<World, Probe> {
        if let Phase::Approach { from, gone_m } = &self.phase {
            let over = self.held(-HOVER_M);
            let way = from.origin().distance(&over.origin()).max(1e-3);
            return from.interpolate(&over, smooth(gone_m / way));
        }
        self.held(self.depth_m)
    }

    /// The place over the artery, `depth` under the skin, with the hand's unsteadiness.
    fn held(&self, depth: f64) -> Pose<World, Probe> {
        let (place, turn) = self.habits.at(self.clock_s);
        let u = self.config.unsteadiness;
        let off = place * u + Vector3::new(0.0, 0.0, depth);
        let meant = UnitQuaternion::from_euler_angles(self.config.lean_deg.to_radians(), 0.0, 0.0);
        let meant = UnitQuaternion::from_euler_angles(0.0, 0.0, self.config.turn_deg.to_radians()) * meant;
        let wobble = Isometry3::from_parts(off.into(), UnitQuaternion::from_scaled_axis(turn * u) * meant);
        // FRAMES: the probe as the hand means to hold it, written in the ideal probe of the course.
        self.course.at(self.at_m) * Pose::assume(wobble)
    }

    /// Moves along the plan.
    fn advance(&mut self, skin_n: f64, pace: f64, seconds: f64) {
        match &mut self.phase {
            Phase::Approach { from, gone_m } => {
                let way = from.origin().distance(&self.course.at(0.0).origin()) + HOVER_M;
                *gone_m += AIR_M_S * pace * seconds;
                if *gone_m > way {
                    self.phase = Phase::Descend;
                }
            }
            Phase::Descend => {
                self.depth_m = (self.depth_m + DOWN_M_S * pace * seconds).min(DEEPEST_M);
                if skin_n > TOUCH_N {
                    self.phase = Phase::Follow { stroke: 0, waited_s: 0.0 };
                }
            }
            Phase::Follow { .. } => self.follow(skin_n, pace, seconds),
            Phase::Rise => {
                self.depth_m -= AIR_M_S * 0.7 * pace * seconds;
                if self.depth_m < -HOVER_M {
                    self.phase = Phase::Released;
                }
            }
            Phase::Released => {}
        }
    }

    /// The stroke that it is in: goes there, waits, or lifts; presses meanwhile.
    fn follow(&mut self, skin_n: f64, pace: f64, seconds: f64) {
        let Phase::Follow { stroke, waited_s } = &mut self.phase else { return };
        let Some(now) = self.plan.strokes.get(*stroke) else {
            self.phase = Phase::Rise;
            return;
        };
        *waited_s += seconds;
        let (wish, lift, done) = match *now {
            Stroke::Go { to_m, speed_m_s } => {
                let left = to_m - self.at_m;
                let slowing = speed_m_s.min(left.abs() / 0.15 + 1e-3);
                (left.signum() * slowing * pace, false, left.abs() < 0.3e-3)
            }
            Stroke::Pause { seconds } => (0.0, false, *waited_s > seconds),
            // It goes on once it feels the skin again, or gives up feeling for it.
            Stroke::Lift { seconds } => {
                let down = *waited_s > seconds && (skin_n > TOUCH_N || *waited_s > seconds + 3.0);
                (0.0, *waited_s < 0.6 * seconds, down)
            }
        };
        if done {
            (*stroke, *waited_s) = (*stroke + 1, 0.0);
        }
        self.speed_m_s += (wish - self.speed_m_s) * (seconds / 0.08);
        self.at_m = (self.at_m + self.speed_m_s * seconds).clamp(0.0, self.course.length_m());
        self.press(skin_n, lift, seconds);
    }

    /// Deeper when it feels too little, higher when too much; off the skin when it lifts.
    fn press(&mut self, skin_n: f64, lift: bool, seconds: f64) {
        if lift {
            self.depth_m = (self.depth_m - 0.05 * seconds).max(-0.012);
            return;
        }
        let unsteady = 0.12 * self.config.unsteadiness * self.habits.press.at(self.clock_s);
        let step = PRESS_M_N_S * (self.config.press_n * (1.0 + unsteady) - skin_n).clamp(-6.0, 6.0);
        self.depth_m = (self.depth_m + step * seconds).clamp(-HOVER_M, DEEPEST_M);
    }

    /// The spring and the damper, no stronger than a person's.
    fn pull(
        &mut self,
        target: &Pose<World, Probe>,
        (probe, twist): (&Pose<World, Probe>, &Twist<Probe>),
        seconds: f64,
    ) -> Wrench<Probe> {
        let went = self
            .last
            .map_or(Vector3::zeros(), |last| (target.origin().vector() - last.origin().vector()) / seconds);
        self.last = Some(*target);
        self.moving += (went - self.moving) * (seconds / 0.03);
        let error = (probe.inverse() * *target).isometry().to_owned();
        let moving = (probe.inverse().isometry().rotation) * self.moving;
        let (mut force, mut torque) = self.habits.tremble(self.clock_s);
        force = force * self.config.unsteadiness
            + error.translation.vector.component_mul(&Vector3::from(SPRING_N_M));
        torque = torque * self.config.unsteadiness + error.rotation.scaled_axis() * TURN_SPRING_N_M;
        force += (moving - twist.linear) * DAMPER_N_S_M;
        torque -= twist.angular * TURN_DAMPER_N_M_S;
        Wrench::new(force.cap_magnitude(STRONGEST_N), torque.cap_magnitude(STRONGEST_N_M))
    }
}

/// From 0 to 1 without a jerk at either end.
fn smooth(fraction: f64) -> f64 {
    let t = fraction.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}
