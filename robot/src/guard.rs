//! The guard: the supervisor of every motion.
//!
//! ```text
//!             begin(): the arm is at rest, its state fit           trip
//!   ┌───────┐ ──────────────────────────────────▶ ┌─────────┐ ───────────▶ ┌──────────┐
//!   │ Armed │                                     │ Running │              │ Stopping │
//!   └───────┘ ◀────────────────────────────────── └─────────┘              └──────────┘
//!       ▲       end(): the motion ended in peace                                │ end(): at rest, or lost
//!       │                                                                       ▼
//!       │  confirm(fresh state): fit, the force below the soft limit       ┌─────────┐
//!       └───────────────────────────────────────────────────────────────── │ Stopped │
//!          confirm_to_lift(fresh state): fit but for the force, which      └─────────┘
//!          may then only fall
//! ```
//!
//! Every tick [`Guard::judge`] looks at the command and the state that came back, without side effects, then steps.

mod judge;
mod limits;
mod trip;
mod workspace;

use probepath_frames::{Base, Flange, Point, Pose, Probe};

use crate::{Asked, BlackBox, Joints, Limited, LimitsError, Model, MotionLimits, Operator, State, Tick};
pub use limits::GuardLimits;
pub use trip::Trip;
pub use workspace::{Plane, Workspace};

/// Where the probe's origin is, given the joints: the model's forward kinematics with the tool on.
pub type ProbePlace = Box<dyn Fn(&Joints) -> Point<Base> + Send>;

/// Where a model's forward kinematics puts the probe's origin.
pub fn probe_place(model: Model, flange_from_probe: Pose<Flange, Probe>) -> ProbePlace {
    Box::new(move |joints| model.forward(joints) * flange_from_probe.origin())
}

/// What the guard makes of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// All is well.
    Fine,
    /// The skin presses harder (N) than the soft limit: whoever holds a contact force should lower it now.
    Yield(f64),
    /// Stop.
    Stop(Trip),
}

/// Where the guard is in its diagram.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, in the guard; a box would touch the heap at every tick"
)]
pub enum Phase {
    /// A motion may begin.
    Armed(Ceiling),
    /// A motion runs.
    Running(Watch),
    /// The arm brakes.
    Stopping(Trip),
    /// The arm is at rest, and stays so until a fresh confirmation.
    Stopped(Trip),
}

/// The largest force (N) that is tolerated now: the hard limit, or more while the probe is lifted out of too much
/// force; it follows the force down and never rises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceiling(f64);

/// What the guard remembers of a running motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watch {
    ceiling: Ceiling,
    last: State,
    probe: Option<Point<Base>>,
    /// Nanoseconds since the state was last new.
    stale_ns: i64,
}

/// How much more force (N) than now is tolerated while lifting out of too much of it: noise and the skin's rebound.
const WHILE_LIFTING: f64 = 1.0;

/// The supervisor. See the [module](self) for its diagram.
pub struct Guard {
    limits: GuardLimits,
    motion: MotionLimits,
    workspace: Workspace,
    probe: Option<ProbePlace>,
    operator: Operator,
    phase: Phase,
    black_box: BlackBox,
}

impl Guard {
    /// A guard over joints only; see [`within`](Self::within) for the workspace.
    ///
    /// # Errors
    /// When the limits cannot be kept.
    pub fn new(limits: GuardLimits, motion: MotionLimits) -> Result<Self, LimitsError> {
        motion.check()?;
        let phase = Phase::Armed(Ceiling(limits.force_hard_n));
        let workspace = Workspace::default();
        let (operator, black_box) = (Operator::new(), BlackBox::default());
        Ok(Self { limits, motion, workspace, probe: None, operator, phase, black_box })
    }

    /// Also watches where the probe is and how fast it moves.
    #[must_use]
    pub fn within(mut self, workspace: Workspace, probe: ProbePlace) -> Self {
        self.workspace = workspace;
        self.probe = Some(probe);
        self
    }

    /// Also listens to the operator's stop.
    #[must_use]
    pub fn listening_to(mut self, operator: Operator) -> Self {
        self.operator = operator;
        self
    }

    /// The limits of every command.
    pub const fn motion_limits(&self) -> &MotionLimits {
        &self.motion
    }

    /// What it watches for.
    pub const fn limits(&self) -> &GuardLimits {
        &self.limits
    }

    /// Other limits from the next motion on: hand guiding and scanning differ. A confirmation to lift stays one.
    pub fn set_limits(&mut self, limits: GuardLimits) {
        if let Phase::Armed(ceiling) = &mut self.phase
            && ceiling.0 <= self.limits.force_hard_n
        {
            *ceiling = Ceiling(limits.force_hard_n);
        }
        self.limits = limits;
    }

    /// The operator it listens to.
    pub const fn operator(&self) -> &Operator {
        &self.operator
    }

    /// Where it is in its diagram.
    pub const fn phase(&self) -> &Phase {
        &self.phase
    }

    /// The last ticks of the motion that runs, or of the last one that ended in peace; a fault takes them with it.
    pub const fn black_box(&self) -> &BlackBox {
        &self.black_box
    }

    /// Whether the operator asked to stop.
    pub fn is_stop_asked(&self) -> bool {
        self.operator.wish() == Asked::Stop
    }

    /// A fresh confirmation after a stop, from a state that was just measured.
    ///
    /// # Errors
    /// When the state is not fit to move from, the skin still presses harder than the soft limit (lift first), or it
    /// is no newer than the one that tripped.
    pub fn confirm(&mut self, fresh: &State) -> Result<(), Trip> {
        let force_n = fresh.wrench.force.norm();
        if force_n > self.limits.force_soft_n {
            return Err(Trip::Force { force_n, limit_n: self.limits.force_soft_n });
        }
        self.fit(fresh)?;
        self.phase = Phase::Armed(Ceiling(self.limits.force_hard_n));
        Ok(())
    }

    /// A fresh confirmation to lift the probe out of too much force: as [`confirm`](Self::confirm), but the force may
    /// still be high. It may only fall from here: the tolerance follows it down.
    ///
    /// # Errors
    /// When the state is not fit to move from for another reason.
    pub fn confirm_to_lift(&mut self, fresh: &State) -> Result<(), Trip> {
        self.fit(fresh)?;
        let force = fresh.wrench.force.norm();
        self.phase = Phase::Armed(Ceiling(self.limits.force_hard_n.max(force + WHILE_LIFTING)));
        Ok(())
    }

    /// A motion begins, from rest and a fit state.
    pub(crate) fn begin(&mut self, state: &State) -> Result<(), Trip> {
        let Phase::Armed(ceiling) = self.phase else {
            return Err(Trip::NotConfirmed);
        };
        self.fit(state)?;
        self.black_box.clear();
        let probe = self.probe.as_ref().map(|place| place(&state.commanded));
        self.phase = Phase::Running(Watch { ceiling, last: *state, probe, stale_ns: 0 });
        Ok(())
    }

    /// One tick: what to make of a command (after the limits, before it is sent), and of where the arm would come to
    /// rest if it braked after it.
    pub(crate) fn judge_command(
        &mut self,
        limited: &Limited,
        brakes_at: impl Fn() -> Joints,
        dt: f64,
    ) -> Verdict {
        let Limited { changed, joint, position } = *limited;
        let found = if changed > self.limits.correction {
            Some(Trip::Corrected { joint, by: changed })
        } else {
            self.judge_place(&position, brakes_at, dt)
        };
        self.settle(found, None)
    }

    /// One tick: what to make of the state that came back.
    pub(crate) fn judge(&mut self, state: &State, dt: f64) -> Verdict {
        let Phase::Running(watch) = self.phase else {
            return Verdict::Stop(Trip::NotConfirmed);
        };
        let stale_ns = if state.tick == watch.last.tick || state.stamp <= watch.last.stamp {
            watch.stale_ns + (dt * 1e9) as i64
        } else {
            0
        };
        let force = state.wrench.force.norm();
        let found =
            self.late(&watch.last, state, stale_ns).err().or_else(|| self.unfit(state)).or_else(|| {
                self.jumped(&watch.last, state, dt).or((force > watch.ceiling.0)
                    .then_some(Trip::Force { force_n: force, limit_n: watch.ceiling.0 }))
            });
        let ceiling = Ceiling(self.limits.force_hard_n.max(watch.ceiling.0.min(force + WHILE_LIFTING)));
        self.phase = Phase::Running(Watch { ceiling, last: *state, stale_ns, ..watch });
        self.settle(found, Some(force))
    }

    /// The motion ended: at rest, or the arm is lost.
    pub(crate) fn end(&mut self) {
        self.phase = match self.phase {
            Phase::Running(watch) => Phase::Armed(watch.ceiling),
            Phase::Stopping(trip) => Phase::Stopped(trip),
            other => other,
        };
    }

    pub(crate) fn remember(&mut self, tick: &Tick) {
        self.black_box.push(tick);
    }

    /// Hands the black box over with a fault.
    pub(crate) fn take_black_box(&mut self) -> BlackBox {
        std::mem::take(&mut self.black_box)
    }

    /// Something outside the guard went wrong (the arm's fault, a panic): a fresh confirmation is needed too.
    pub(crate) fn stop(&mut self, trip: Trip) {
        if !matches!(self.phase, Phase::Stopped(_) | Phase::Stopping(_)) {
            self.phase = Phase::Stopping(trip);
        }
    }

    fn settle(&mut self, found: Option<Trip>, force: Option<f64>) -> Verdict {
        if let Some(trip) = found {
            self.phase = Phase::Stopping(trip);
            return Verdict::Stop(trip);
        }
        match force {
            Some(force) if force > self.limits.force_soft_n => Verdict::Yield(force),
            _ => Verdict::Fine,
        }
    }
}
