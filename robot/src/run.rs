//! The one loop that runs a controller on an arm.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use thiserror::Error;

use crate::{
    Arm, ArmFault, BlackBox, Command, Controller, Guard, Limiter, LimitsError, Observer, State, Tick, Trip,
    Verdict, Wish,
};

/// A motion that ended in peace, the arm at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// Who ended it.
    pub ending: Ending,
    /// How many ticks it took, from the first exchange to the last.
    pub ticks: u64,
    /// The last state, at rest.
    pub last: State,
}

/// Who ended a motion in peace.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// The controller: it was done.
    Done,
    /// The operator's stop.
    Operator,
    /// The observer, with its reason.
    Observer(String),
}

/// A motion that was stopped by a fault.
#[derive(Clone, Debug, Error)]
#[error("the motion was stopped after {} ticks: {reason}", black_box.seen())]
pub struct RunError {
    /// Why.
    #[source]
    pub reason: StopReason,
    /// The last state that came, if any.
    pub last: Option<State>,
    /// Whether the loop saw the arm's commanded positions come to rest; if not, the arm braked by its own means.
    pub at_rest: bool,
    /// The last ticks, newest last.
    pub black_box: BlackBox,
}

/// Why a motion was stopped.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StopReason {
    /// The guard.
    #[error("{0}")]
    Guard(Trip),
    /// The arm.
    #[error("{0}")]
    Arm(ArmFault),
    /// A command that the limits refuse, or limits that do not fit the arm.
    #[error("{0}")]
    Limits(LimitsError),
    /// A bug in the controller or the observer.
    #[error("the {who} panicked: {message}; this is a bug, please report it with the black box")]
    Panicked {
        /// Who.
        who: &'static str,
        /// What it said.
        message: String,
    },
    /// The arm was still moving when the motion was to begin.
    #[error("the arm does not come to rest; nothing was commanded")]
    Restless,
}

impl StopReason {
    /// Whether the probe should be lifted off before anything else.
    pub const fn asks_to_lift(&self) -> bool {
        matches!(self, Self::Guard(trip) if trip.asks_to_lift())
    }

    /// Whether the arm stopped by its own means, or cannot be reached.
    pub const fn is_of_the_arm(&self) -> bool {
        match self {
            Self::Arm(_) => true,
            Self::Guard(trip) => trip.is_of_the_arm(),
            _ => false,
        }
    }
}

/// How many ticks a controller gets to come to rest along its path after the operator's stop.
const TICKS_TO_HALT: u64 = 35;

/// How many ticks an arm gets to come to rest before a motion begins.
const TICKS_TO_REST: u64 = 5000;

/// Runs a controller on an arm until the controller ends, the operator or the observer asks to stop, or a fault.
/// Whatever door the loop is left by, the arm is braked to rest within its limits through the same exchange, and
/// then told to stay; an arm that does not answer is told to stay, and brakes by its own means.
///
/// After the controller come the limits with the last word, then the guard; see [`Limiter`] and [`Guard`].
/// [`Command::Freedrive`] goes to the arm from rest only; when the controller wants something else again, the arm is
/// told to stay until it rests where the hand left it, and the limits start from there.
///
/// # Errors
/// When the guard trips, the arm fails or stops by itself, a command is not finite, or the controller or observer
/// panics; the error carries the last ticks. After any ending but the controller's own the guard wants a fresh
/// confirmation.
pub fn run(
    arm: &mut dyn Arm,
    controller: &mut dyn Controller,
    guard: &mut Guard,
    observer: &mut dyn Observer,
) -> Result<Finished, Box<RunError>> {
    let mut motion = Motion::begin(arm, guard, observer)?;
    let left = motion.go_on(controller);
    motion.end(left)
}

/// How the loop was left.
type Left = Result<Ending, StopReason>;

/// A motion under way.
struct Motion<'a> {
    arm: &'a mut dyn Arm,
    guard: &'a mut Guard,
    observer: &'a mut dyn Observer,
    limiter: Limiter,
    state: State,
    /// What the observer asked for last.
    wish: Wish,
    dt: f64,
    ticks: u64,
    /// Whether the observer may still be asked: after a panic it is left alone.
    observer_well: bool,
    /// Whether the arm gives way to the hand by its own means.
    free: bool,
}

impl<'a> Motion<'a> {
    fn begin(
        arm: &'a mut dyn Arm,
        guard: &'a mut Guard,
        observer: &'a mut dyn Observer,
    ) -> Result<Self, Box<RunError>> {
        let refused = |reason, last| RunError { reason, last, at_rest: true, black_box: BlackBox::new(1) };
        let rested = rest(arm, observer).map_err(|reason| Box::new(refused(reason, None)))?;
        let state = rested.state;
        guard
            .begin(&state, arm.period())
            .map_err(|trip| Box::new(refused(StopReason::Guard(trip), Some(state))))?;
        let (dt, limits) = (arm.period().seconds(), *guard.motion_limits());
        let limiter = Limiter::at_rest(limits, arm.period(), state.commanded).map_err(|error| {
            guard.end(&state);
            Box::new(refused(StopReason::Limits(error), Some(state)))
        })?;
        let Rested { wish, ticks, .. } = rested;
        Ok(Self { arm, guard, observer, limiter, state, wish, dt, ticks, observer_well: true, free: false })
    }

    /// The loop.
    fn go_on(&mut self, controller: &mut dyn Controller) -> Left {
        loop {
            if let Wish::Stop(why) = std::mem::replace(&mut self.wish, Wish::GoOn) {
                return Ok(Ending::Observer(why));
            }
            if self.guard.is_stop_asked() {
                return self.halt(controller);
            }
            let Some(wanted) = caught("controller", || controller.step(&self.state))? else {
                return Ok(Ending::Done);
            };
            self.wish = match (self.free, wanted) {
                (_, Command::Freedrive) => self.give_way()?,
                // What was wanted comes from before the arm was at rest: the controller is asked again.
                (true, _) => self.take_hold()?,
                _ => {
                    let (command, changed) = self.limited(&wanted)?;
                    self.exchange(wanted, command, changed, false)?
                }
            };
        }
    }

    /// The operator stops: a controller that knows its path comes to rest along it, what is left is braked.
    fn halt(&mut self, controller: &mut dyn Controller) -> Left {
        for _ in 0..TICKS_TO_HALT {
            let halting = !self.free;
            let next = if halting { caught("controller", || controller.halt(&self.state))? } else { None };
            let Some(wanted) = next else { break };
            let (command, changed) = self.limited(&wanted)?;
            self.exchange(wanted, command, changed, false)?;
        }
        Ok(Ending::Operator)
    }

    /// One tick of giving way to the hand by the arm's own means; from rest only.
    fn give_way(&mut self) -> Result<Wish, StopReason> {
        if !self.free && !self.limiter.is_at_rest() {
            let command = self.slowing();
            return self.exchange(Command::Freedrive, command, 0.0, false);
        }
        if !self.free {
            self.guard.moved_to(&self.state.position);
            self.free = true;
        }
        self.exchange(Command::Freedrive, Command::Freedrive, 0.0, false)
    }

    /// The arm stops giving way: it stays until it is at rest where the hand left it, and the limits start from there.
    fn take_hold(&mut self) -> Result<Wish, StopReason> {
        let wish = self.stay_until_rest(false)?;
        let (limits, rests_at) = (*self.limiter.limits(), self.state.commanded);
        self.limiter = Limiter::at_rest(limits, self.arm.period(), rests_at).map_err(StopReason::Limits)?;
        self.guard.moved_to(&rests_at);
        self.free = false;
        Ok(wish)
    }

    fn stay_until_rest(&mut self, braking: bool) -> Result<Wish, StopReason> {
        let (mut before, mut same, mut asked) = (self.state.commanded, 0, Wish::GoOn);
        for _ in 0..TICKS_TO_REST {
            if let stop @ Wish::Stop(_) = self.exchange(Command::Stay, Command::Stay, 0.0, braking)? {
                asked = stop;
            }
            same = if before == self.state.commanded { same + 1 } else { 0 };
            before = self.state.commanded;
            if same == 2 {
                return Ok(asked);
            }
        }
        Err(StopReason::Restless)
    }

    /// One tick of the limits' own brake, in the middle of a motion.
    fn slowing(&mut self) -> Command {
        let next = self.limiter.brake();
        self.guard.moved_to(&next);
        Command::Position(next)
    }

    /// The command after the limits and the guard.
    fn limited(&mut self, wanted: &Command) -> Result<(Command, f64), StopReason> {
        let Command::Position(position) = wanted else {
            return Ok((self.slowing(), 0.0));
        };
        let before = self.limiter;
        let limited = self.limiter.limit(position).map_err(StopReason::Limits)?;
        let limiter = &self.limiter;
        match self.guard.judge_command(&limited, || limiter.brakes_at(), self.dt) {
            Verdict::Stop(trip) => {
                // It is not sent, so the brake starts from what was sent last.
                self.limiter = before;
                Err(StopReason::Guard(trip))
            }
            _ => Ok((Command::Position(limited.position), limited.changed)),
        }
    }

    /// One tick: out goes the command, back comes the state, and everybody who watches is told.
    fn exchange(
        &mut self,
        wanted: Command,
        command: Command,
        changed: f64,
        braking: bool,
    ) -> Result<Wish, StopReason> {
        self.state = self.arm.exchange(&command).map_err(StopReason::Arm)?;
        let free = self.free;
        let verdict = if braking { Verdict::Fine } else { self.guard.judge(&self.state, self.dt, free) };
        let state = self.state;
        let tick =
            Tick { index: self.ticks, wanted, command, changed, state, verdict, braking, overtaken: false };
        self.ticks += 1;
        self.guard.remember(&tick);
        let late = self.tell_overtaken(&tick)?;
        let wish = late.or(self.tell(&tick)?);
        match verdict {
            Verdict::Stop(trip) => Err(StopReason::Guard(trip)),
            _ => Ok(wish),
        }
    }

    /// Tells of the states that came together with a tick's, older ones first.
    fn tell_overtaken(&mut self, tick: &Tick) -> Result<Wish, StopReason> {
        let mut wish = Wish::GoOn;
        for older in 0..self.arm.overtaken().len() {
            if let Some(tick) = tick.older(&*self.arm, older) {
                wish = wish.or(self.tell(&tick)?);
            }
        }
        Ok(wish)
    }

    fn tell(&mut self, tick: &Tick) -> Result<Wish, StopReason> {
        if !self.observer_well {
            return Ok(Wish::GoOn);
        }
        let told = caught("observer", || self.observer.tick(tick));
        self.observer_well = told.is_ok();
        told
    }

    /// Brakes, tells the arm to stay, and says how it went.
    fn end(mut self, left: Left) -> Result<Finished, Box<RunError>> {
        let itself = left.as_ref().is_err_and(StopReason::is_of_the_arm);
        let braked = if itself { Ok(()) } else { self.brake() };
        let at_rest = braked.is_ok() && !itself;
        // The last word, also to an arm that did not answer: it may hear without being able to speak.
        let stayed = self.stay();
        let reason = match (left, braked, stayed) {
            (Err(reason), _, _) | (Ok(_), Err(reason), _) | (Ok(_), Ok(()), Err(reason)) => reason,
            (Ok(ending), Ok(()), Ok(())) => return Ok(self.in_peace(ending)),
        };
        self.guard.stop(if let StopReason::Guard(trip) = reason { trip } else { Trip::Fault });
        self.guard.end(&self.state);
        Err(Box::new(RunError {
            reason,
            last: Some(self.state),
            at_rest,
            black_box: self.guard.take_black_box(),
        }))
    }

    /// A motion that was done leaves the guard armed; one that somebody stopped wants a fresh confirmation.
    fn in_peace(self, ending: Ending) -> Finished {
        match ending {
            Ending::Done => {}
            Ending::Operator => self.guard.stop(Trip::Operator),
            Ending::Observer(_) => self.guard.stop(Trip::Watcher),
        }
        self.guard.end(&self.state);
        Finished { ending, ticks: self.ticks, last: self.state }
    }

    /// To rest, as hard as the limits allow. The observer is told, and can no longer ask for anything.
    fn brake(&mut self) -> Result<(), StopReason> {
        if self.free {
            return answered(self.stay_until_rest(true));
        }
        while !self.limiter.is_at_rest() {
            let command = Command::Position(self.limiter.brake());
            answered(self.exchange(command, command, 0.0, true))?;
        }
        Ok(())
    }

    fn stay(&mut self) -> Result<(), StopReason> {
        answered(self.exchange(Command::Stay, Command::Stay, 0.0, true))
    }
}

/// On the way to rest only the arm itself can stop the brake: an observer's panic has done its harm.
fn answered(exchanged: Result<Wish, StopReason>) -> Result<(), StopReason> {
    match exchanged {
        Ok(_) | Err(StopReason::Panicked { .. }) => Ok(()),
        Err(reason) => Err(reason),
    }
}

/// An arm found at rest.
struct Rested {
    state: State,
    /// What the observer asked for meanwhile.
    wish: Wish,
    ticks: u64,
}

/// Stays until the arm's commanded positions are the same for three ticks: from there the finite differences start.
/// The observer is told of these ticks too, so that a recording has every exchange.
fn rest(arm: &mut dyn Arm, observer: &mut dyn Observer) -> Result<Rested, StopReason> {
    let (mut before, mut same, mut asked) = (None, 0, Wish::GoOn);
    for index in 0..TICKS_TO_REST {
        let state = arm.exchange(&Command::Stay).map_err(StopReason::Arm)?;
        let tick = Tick::staying(index, state);
        // What waited while nobody asked belongs to no motion.
        let older = if index == 0 { 0 } else { arm.overtaken().len() };
        for tick in (0..older).filter_map(|older| tick.older(arm, older)).chain([tick]) {
            asked = asked.or(caught("observer", || observer.tick(&tick))?);
        }
        same = if before == Some(state.commanded) { same + 1 } else { 0 };
        before = Some(state.commanded);
        if same == 2 {
            return Ok(Rested { state, wish: asked, ticks: index + 1 });
        }
    }
    Err(StopReason::Restless)
}

/// Calls somebody else's code, and turns its panic into a reason.
fn caught<T>(who: &'static str, call: impl FnOnce() -> T) -> Result<T, StopReason> {
    catch_unwind(AssertUnwindSafe(call))
        .map_err(|panic| StopReason::Panicked { who, message: message(panic.as_ref()) })
}

/// What a panic said.
pub(crate) fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("without words").into()
}

#[cfg(test)]
#[cfg(test)]
pub(crate) mod test_arm;
#[cfg(test)]
mod tests;
