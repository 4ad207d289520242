//! The guard: the supervisor of every motion, after every source of commands.
//!
//! ```text
//!             begin(): the arm is at rest, its state fit           trip, the operator's stop, a fault
//!   ┌───────┐ ──────────────────────────────────▶ ┌─────────┐ ───────────▶ ┌──────────┐
//!   │ Armed │                                     │ Running │              │ Stopping │
//!   └───────┘ ◀────────────────────────────────── └─────────┘              └──────────┘
//!       ▲       end(): the motion was done                                      │ end(): at rest, or lost
//!       │                                                                       ▼
//!       │  confirm(fresh state): at rest, fit, the force below the        ┌─────────┐
//!       └──────────────────────────────────────────────────────────────── │ Stopped │
//!          soft limit; the probe is slow at first: 10 mm/s, and e times   └─────────┘
//!          more every second of motion
//!          confirm_to_lift(fresh state): at rest, fit but for the force,
//!          which may then only fall
//! ```
//!
//! Every tick [`Guard::judge_command`] looks at the command, after the limits and before it is sent, and
//! [`Guard::judge`] at the state that came back; both look first, without side effects, and then step.
//!
//! | of the command | of the state |
//! |---|---|
//! | changed by the limits: joints' position, velocity, acceleration, jerk | late tick, old data, back in time, frozen sensor |
//! | the probe's speed: in the air, on the skin, after a confirmation, in reduced mode | the arm's own safety system |
//! | the workspace and the probe's tilt, where a brake would end | joints' range, velocity, lag, jumps |
//! |  | implausible wrench, force, sideways force, pressure |
//!
//! While the arm gives way to the hand by its own means ([`Command::Freedrive`](crate::Command::Freedrive)) there is no
//! command to judge: the probe's measured place and speed are judged instead, by the limits of the motion alone: what a
//! confirmation slows down is what is commanded, and it waits for that.

mod confirm;
mod judge;
mod limits;
mod remember;
mod tilt;
mod trip;
mod workspace;

use probepath_frames::{Base, Flange, Pose, Probe, Span, Stamp};

use crate::{
    Asked, BlackBox, ContactWatch, Face, Joints, Limited, LimitsError, Model, MotionLimits, Operator, State,
    Tick,
};
pub use limits::GuardLimits;
pub use remember::{Allowance, Watch};
pub use tilt::Tilt;
pub use trip::Trip;
pub use workspace::{Plane, Workspace};

/// Where the probe is, given the joints: the model's forward kinematics with the tool on.
pub type ProbePlace = Box<dyn Fn(&Joints) -> Pose<Base, Probe> + Send>;

/// Where a model's forward kinematics puts the probe.
pub fn probe_place(model: Model, flange_from_probe: Pose<Flange, Probe>) -> ProbePlace {
    Box::new(move |joints| model.forward(joints) * flange_from_probe)
}

/// A pressure counts when it lasts: a single tick's torque is too noisy to say where the force acts.
const PRESSED_FOR: Span = Span::from_milliseconds(50);

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
    Armed(Allowance),
    /// A motion runs.
    Running(Watch),
    /// The arm brakes.
    Stopping(Trip),
    /// The arm is at rest, and stays so until a fresh confirmation.
    Stopped(Trip),
}

/// The supervisor. See the [module](self) for its diagram.
pub struct Guard {
    limits: GuardLimits,
    motion: MotionLimits,
    workspace: Workspace,
    tilt: Option<Tilt>,
    face: Option<Face>,
    probe: Option<ProbePlace>,
    operator: Operator,
    phase: Phase,
    /// The last state of a motion that was stopped: a confirmation needs a newer one.
    stopped_at: Option<Stamp>,
    black_box: BlackBox,
}

impl Guard {
    /// A guard over joints only; see [`within`](Self::within) for the workspace.
    ///
    /// # Errors
    /// When the limits cannot be kept.
    pub fn new(limits: GuardLimits, motion: MotionLimits) -> Result<Self, LimitsError> {
        motion.check()?;
        Ok(Self {
            limits,
            motion,
            workspace: Workspace::default(),
            tilt: None,
            face: None,
            probe: None,
            operator: Operator::new(),
            phase: Phase::Armed(Allowance::usual(&limits)),
            stopped_at: None,
            black_box: BlackBox::default(),
        })
    }

    /// Also watches where the probe is and how fast it moves.
    #[must_use]
    pub fn within(mut self, workspace: Workspace, probe: ProbePlace) -> Self {
        self.workspace = workspace;
        self.probe = Some(probe);
        self
    }

    /// Also watches how far the probe leans over; needs the probe's place, given by [`within`](Self::within).
    #[must_use]
    pub const fn leaning_at_most(mut self, tilt: Tilt) -> Self {
        self.tilt = Some(tilt);
        self
    }

    /// Also watches how the force spreads over the probe's face, and how much of it drags along the skin.
    #[must_use]
    pub const fn pressing_with(mut self, face: Face) -> Self {
        self.face = Some(face);
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

    /// Other limits from the next motion on: hand guiding and scanning differ. What a confirmation allowed stays.
    pub const fn set_limits(&mut self, limits: GuardLimits) {
        if let Phase::Armed(allowance) = &mut self.phase {
            allowance.change(&self.limits, &limits);
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

    /// A motion begins, from rest and a fit state.
    pub(crate) fn begin(&mut self, state: &State, period: Span) -> Result<(), Trip> {
        let Phase::Armed(allowance) = self.phase else {
            return Err(Trip::NotConfirmed);
        };
        self.fit(state)?;
        self.black_box.clear();
        let probe = self.probe.as_ref().map(|place| place(&state.commanded));
        let contact = self.face.map(|face| ContactWatch::new(face, PRESSED_FOR, period));
        self.phase = Phase::Running(Watch::new(allowance, state, probe, contact));
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
        let Phase::Running(mut watch) = self.phase else {
            return Verdict::Stop(Trip::NotConfirmed);
        };
        let found = if changed > self.limits.correction {
            Some(Trip::Corrected { joint, by: changed })
        } else {
            self.judge_place(&mut watch, &position, brakes_at, dt)
        };
        self.phase = Phase::Running(watch);
        self.settle(found, None)
    }

    /// The probe was told to be there without a question: on the way to rest, or by the hand.
    pub(crate) fn moved_to(&mut self, position: &Joints) {
        if let (Phase::Running(watch), Some(place)) = (&mut self.phase, &self.probe) {
            watch.probe = Some(place(position));
        }
    }

    /// One tick: what to make of the state that came back; `free` when the arm gives way to the hand by its own means.
    pub(crate) fn judge(&mut self, state: &State, dt: f64, free: bool) -> Verdict {
        let Phase::Running(mut watch) = self.phase else {
            return Verdict::Stop(Trip::NotConfirmed);
        };
        let last = watch.last;
        watch.see(state, dt, &self.limits, free);
        let found = self
            .late(&last, state, watch.stale_ns)
            .or_else(|| self.frozen(&watch, dt))
            .or_else(|| self.unfit(state))
            .or_else(|| self.jumped(&last, state, dt))
            .or_else(|| self.too_much(&watch, state))
            .or_else(|| if free { self.judge_free(&mut watch, state, dt) } else { None });
        self.phase = Phase::Running(watch);
        self.settle(found, Some(state.wrench.force.norm()))
    }

    /// The motion ended: at rest, or the arm is lost.
    pub(crate) fn end(&mut self, last: &State) {
        self.phase = match self.phase {
            Phase::Running(watch) => Phase::Armed(watch.allowance),
            Phase::Stopping(trip) => {
                self.stopped_at = Some(last.stamp);
                Phase::Stopped(trip)
            }
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

    /// Whatever it allows now: from here on it wants a confirmation on a state newer than `last`.
    pub const fn disarm(&mut self, trip: Trip, last: Stamp) {
        self.phase = Phase::Stopped(trip);
        self.stopped_at = Some(last);
    }

    /// Something outside the guard ended the motion (the operator, the arm's fault, a panic): a fresh confirmation is
    /// needed too.
    pub(crate) const fn stop(&mut self, trip: Trip) {
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

#[cfg(test)]
mod tests;
