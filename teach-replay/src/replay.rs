//! [`Replay`]: through the air, down, along the path at constant force, and up.

mod contact;
mod joints;
mod settings;
mod status;

use probepath_robot::motion::timing::PathClock;
use probepath_robot::{
    Asked, Command, ContactLaw, ContactSettings, Controller, Joints, Operator, Patience, Safety, State,
};

use crate::Plan;
use crate::plan::Leg;
use contact::Touch;
use joints::OnPath;
pub use settings::{ReplayError, ReplaySettings};
use status::Board;
pub use status::{ReplayEnding, ReplayPhase, ReplayStatus, ReplayWatch};

/// Time constant with which the ramp of the force ends (s).
const EASED_OVER_S: f64 = 0.4;

/// Where a replay is.
#[derive(Clone, Copy, Debug)]
enum Stage {
    Approach { leg: usize },
    Descend,
    Settle { set_n: f64, ticks: u32, steady: u32 },
    Follow { cap: f64, yielding: bool },
    Lift { ending: ReplayEnding },
    Done,
}

/// Replays a plan. What it commands lies on the path but for the offset along the probe's axis.
///
/// ```text
///  Approach ──▶ Descend ──▶ Settle ──▶ Follow ──▶ Lift ──▶ Done
///  up, over,    until the   the force  along the  along the
///  down to the  skin is     is raised  path, the  probe's axis
///  standoff     felt        to the     force is   to the standoff
///               │           set one    held
///               │           │          │
///               └───────────┴──────────┴──▶ Lift, with the reason: no skin, the force does not settle, contact lost
/// ```
///
/// A pause slows the motion of any stage down to rest, in contact with the force held; a resume is slow at first.
/// A stop on the path slows down along it as a pause does, and the loop brakes what is left; then
/// [`LiftOff`](crate::LiftOff) takes the probe off the skin.
#[derive(Clone, Debug)]
pub struct Replay {
    plan: Plan,
    settings: ReplaySettings,
    operator: Operator,
    stage: Stage,
    legs: Vec<Leg>,
    clock: PathClock,
    law: ContactLaw,
    patience: Patience,
    touch: Touch,
    on_path: OnPath,
    begun: bool,
    /// Whether the operator's stop was heard: it comes to rest along the path.
    halting: bool,
    board: Board,
    /// The most that the probe moves off the path (m/s): little after a pause, then e times as much each second.
    pace: f64,
    dt: f64,
}

impl Replay {
    /// The replay of `plan`, listening to `operator`.
    ///
    /// # Errors
    /// When a setting cannot be.
    pub fn new(plan: Plan, settings: ReplaySettings, operator: Operator) -> Result<Self, ReplayError> {
        settings.check()?;
        let (standoff, offset) = (plan.settings.standoff, plan.settings.offset);
        // The law's offset counts from the standoff, where it begins at rest.
        let law =
            plan.slowed(ContactSettings { lowest_m: -0.002, highest_m: standoff + offset, ..settings.law });
        let law = ContactLaw::new(law, plan.arm.period)?;
        let (legs, clock) = (plan.legs.clone(), PathClock::new(plan.timing.clone()));
        let (on_path, dt) = (OnPath::new(&plan)?, plan.arm.period.seconds());
        let (stage, touch) = (Stage::Approach { leg: 0 }, Touch::new(settings.lost_after, dt));
        let board = Board::default();
        let (begun, halting, pace) = (false, false, f64::INFINITY);
        Ok(Self {
            plan,
            settings,
            operator,
            stage,
            legs,
            clock,
            law,
            patience: Patience::new(dt),
            touch,
            on_path,
            begun,
            halting,
            board,
            pace,
            dt,
        })
    }

    /// The same, slow at first: at the speed of a resume, then e times faster every second. After a stop.
    #[must_use]
    pub const fn slowly(mut self) -> Self {
        self.pace = self.settings.resume_speed;
        self
    }

    /// Where it is now.
    pub fn status(&self) -> ReplayStatus {
        self.board.read()
    }

    /// A handle that says where it is, while the loop holds the replay itself.
    pub fn watch(&self) -> ReplayWatch {
        self.board.watch()
    }

    fn pressing(&self, state: &State) -> f64 {
        -state.wrench.force.z - self.touch.zero()
    }

    /// Through the air; at the end the descent begins at once.
    fn approach(&mut self, state: &State, leg: usize, pause: bool) -> Option<Joints> {
        let share = if pause { 0.0 } else { self.pace / self.plan.settings.air_speed };
        match self.legs.get_mut(leg).map(|leg| leg.step(share, self.dt)) {
            Some(Some(joints)) => {
                self.on_path.sent(&joints);
                Some(joints)
            }
            Some(None) => {
                self.stage = Stage::Approach { leg: leg + 1 };
                self.approach(state, leg + 1, pause)
            }
            None => {
                self.stage = Stage::Descend;
                self.descend(state, pause)
            }
        }
    }

    /// Down to the skin, slowly where it may be; on the way through the air the force's zero is taken.
    fn descend(&mut self, state: &State, pause: bool) -> Option<Joints> {
        let offset = self.law.offset_m();
        let air = offset < self.plan.settings.standoff - self.settings.skin_within;
        if air {
            self.touch.weigh(-state.wrench.force.z, self.settings.touch_n);
        }
        let speed = match (pause, air) {
            (true, _) => 0.0,
            (_, true) => self.settings.air_speed.min(self.pace),
            (_, false) => self.settings.touch_speed.min(self.pace),
        };
        self.law.step_at(speed, self.pressing(state));
        let force = self.law.force_n();
        if self.touch.is_heavy() {
            self.stage = Stage::Lift { ending: ReplayEnding::ForceInAir { force_n: self.touch.zero() } };
        } else if self.touch.is_felt(force, self.settings.touch_n) {
            self.stage = Stage::Settle { set_n: force, ticks: 0, steady: 0 };
        } else if offset > self.plan.settings.standoff + self.plan.settings.offset - 1e-3 {
            self.stage = Stage::Lift { ending: ReplayEnding::NoSkin };
        }
        self.on_path()
    }

    /// The force is raised until it holds.
    fn settle(&mut self, state: &State, set_n: f64, ticks: u32, steady: u32, pause: bool) -> Option<Joints> {
        let pressing = self.pressing(state);
        let set_n = if pause { set_n } else { self.raised(set_n) };
        self.law.step(pressing, set_n);
        let missing = (self.settings.force_n - self.law.force_n()).abs();
        let steady = if missing < 0.1 * self.settings.force_n { steady + 1 } else { 0 };
        let seconds = |ticks: u32| f64::from(ticks) * self.dt;
        self.stage = if self.touch.is_lost(self.law.force_n(), self.settings.lost_below_n) {
            Stage::Lift { ending: ReplayEnding::ContactLost { at_m: 0.0 } }
        } else if seconds(steady) > 0.3 {
            Stage::Follow { cap: f64::INFINITY, yielding: false }
        } else if seconds(ticks) > self.settings.settle_within {
            Stage::Lift { ending: ReplayEnding::NotSettled { force_n: self.law.force_n() } }
        } else {
            Stage::Settle { set_n, ticks: if pause { ticks } else { ticks + 1 }, steady }
        };
        self.on_path()
    }

    /// The force to hold a tick later: it rises at the ramp's rate, and ever slower toward the end, so that the speed
    /// which the law built up on soft skin is gone when the force is there.
    fn raised(&self, set_n: f64) -> f64 {
        let left = self.settings.force_n - set_n;
        let rate = self.settings.ramp_n_s.min(left / EASED_OVER_S);
        set_n + rate * self.dt
    }

    /// Along the path, the force held.
    fn follow(&mut self, state: &State, cap: f64, yielding: bool, pause: bool) -> Option<Joints> {
        let set_n = if yielding { self.settings.yielding_n() } else { self.settings.force_n };
        self.law.beside(self.clock.speed());
        self.law.step(self.pressing(state), set_n);
        let force = self.law.force_n();
        let soft = self.settings.soft_limit_n;
        let yielding = force > soft || (yielding && force > 0.5 * (soft + self.settings.force_n));
        let waits = pause || yielding;
        let cap = if waits { self.settings.resume_speed } else { self.risen(cap) };
        let most = self.plan.settings.speed.speed.min(cap).min(self.pace);
        let most = self.patience.step(&self.law, set_n, most);
        let s = self.clock.step(if waits { 0.0 } else { most }, self.dt);
        self.stage = if self.touch.is_lost(force, self.settings.lost_below_n) {
            Stage::Lift { ending: ReplayEnding::ContactLost { at_m: s } }
        } else if self.clock.has_arrived() && self.on_path.keeps_up() {
            Stage::Lift { ending: ReplayEnding::Completed }
        } else {
            Stage::Follow { cap, yielding }
        };
        self.on_path()
    }

    /// After a pause the speed stays at the resume speed until it is reached, then rises by as much each second.
    fn risen(&self, cap: f64) -> f64 {
        let slow = self.settings.resume_speed;
        let reached = self.clock.speed() >= 0.95 * slow.min(self.plan.settings.speed.speed);
        if reached { cap + slow * self.dt } else { cap }
    }

    /// Up along the probe's axis to the standoff; what still moves along the path comes to rest.
    fn lift(&mut self, state: &State, ending: ReplayEnding, pause: bool) -> Option<Joints> {
        self.clock.step(0.0, self.dt);
        self.law.beside(self.clock.speed());
        let up = self.law.offset_m() <= 0.5e-3;
        let rests = self.law.speed_m_s().abs() < 1e-6 && self.clock.is_at_rest();
        if up && rests {
            self.finish(ending);
            return None;
        }
        let speed = if up || pause { 0.0 } else { -self.settings.air_speed.min(self.pace) };
        self.law.step_at(speed, self.pressing(state));
        self.on_path()
    }

    fn finish(&mut self, ending: ReplayEnding) {
        self.stage = Stage::Done;
        self.board.end(ending);
    }

    /// The joints for the place along the path and the offset.
    fn on_path(&mut self) -> Option<Joints> {
        let offset = self.law.offset_m() - self.plan.settings.standoff;
        let found = self.on_path.step(&self.plan, &mut self.clock, offset, self.dt);
        if found.is_none() {
            self.finish(ReplayEnding::OutOfReach { at_m: self.on_path.place() });
        }
        found
    }

    fn tick(&mut self, state: &State) -> Option<Joints> {
        let pause = self.halting || self.operator.wish() != Asked::Go;
        // In reduced mode the arm's controller stops whoever is fast.
        let slow = pause || state.safety == Safety::Reduced;
        self.pace = if slow { self.settings.resume_speed } else { self.pace * (1.0 + self.dt) };
        match self.stage {
            Stage::Approach { leg } => self.approach(state, leg, pause),
            Stage::Descend => self.descend(state, pause),
            Stage::Settle { set_n, ticks, steady } => self.settle(state, set_n, ticks, steady, pause),
            Stage::Follow { cap, yielding } => self.follow(state, cap, yielding, pause),
            Stage::Lift { ending } => self.lift(state, ending, pause),
            Stage::Done => None,
        }
    }

    fn report(&self) {
        let (phase, set_n) = match self.stage {
            Stage::Approach { .. } => (ReplayPhase::Approach, 0.0),
            Stage::Descend => (ReplayPhase::Descend, 0.0),
            Stage::Settle { set_n, .. } => (ReplayPhase::Settle, set_n),
            Stage::Follow { .. } => (ReplayPhase::Follow, self.settings.force_n),
            Stage::Lift { .. } => (ReplayPhase::Lift, 0.0),
            Stage::Done => (ReplayPhase::Done, 0.0),
        };
        let offset = self.law.offset_m() - self.plan.settings.standoff;
        self.board.hold(self.on_path.held_by());
        self.board
            .write(phase, [self.on_path.place(), self.clock.speed(), offset, self.law.force_n(), set_n]);
    }
}

impl Controller for Replay {
    fn step(&mut self, state: &State) -> Option<Command> {
        if !self.begun {
            self.begun = true;
            let away = state.commanded.zip(&self.plan.start, |a, b| a - b).largest();
            // A plan from elsewhere would begin with a jump. NaN compares as nothing.
            if state.commanded.len() != self.plan.start.len() || away.is_nan() || away > 1e-6 {
                self.finish(ReplayEnding::StartMoved { away });
            }
        }
        let joints = self.tick(state);
        self.report();
        joints.map(Command::Position)
    }

    /// On the skin it comes to rest along the path, the force held; in the air the limits are quicker.
    fn halt(&mut self, state: &State) -> Option<Command> {
        self.halting = true;
        let moves = matches!(self.stage, Stage::Follow { .. }) && !self.clock.is_at_rest();
        moves.then(|| self.tick(state)).flatten().map(|joints| {
            self.report();
            Command::Position(joints)
        })
    }
}

#[cfg(test)]
pub(crate) mod plant;
#[cfg(test)]
mod tests;
