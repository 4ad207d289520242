//! [`Tick`]: what happened at one tick, and [`Observer`]: who wants to know.

use crate::{Arm, Command, State, Verdict};

/// One tick of the loop: what was wanted, what was sent, and what came back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Ticks since this motion began.
    pub index: u64,
    /// What the controller wanted, before the limits.
    pub wanted: Command,
    /// What was sent.
    pub command: Command,
    /// How far the limits changed the joint they changed most (rad, m).
    pub changed: f64,
    /// The state that came back.
    pub state: State,
    /// What the guard made of it.
    pub verdict: Verdict,
    /// Whether the loop brakes or stays, whatever the controller wants.
    pub braking: bool,
    /// Whether a newer state came together with this one ([`Arm::overtaken`](crate::Arm::overtaken)): then nothing was
    /// commanded upon it, no guard judged it, and command and index are those of the newest.
    pub overtaken: bool,
}

impl Tick {
    /// A tick on which the arm was told to stay.
    pub(crate) const fn staying(index: u64, state: State) -> Self {
        let (wanted, command) = (Command::Stay, Command::Stay);
        Self {
            index,
            wanted,
            command,
            changed: 0.0,
            state,
            verdict: Verdict::Fine,
            braking: true,
            overtaken: false,
        }
    }
}

impl Tick {
    /// The `number`th of the states that came together with this tick's.
    pub(crate) fn older(&self, arm: &dyn Arm, number: usize) -> Option<Self> {
        let state = *arm.overtaken().get(number)?;
        Some(Self { state, verdict: Verdict::Fine, overtaken: true, ..*self })
    }
}

/// What an observer wants.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Go on.
    GoOn,
    /// Stop the arm, and say why.
    Stop(String),
}

impl Wish {
    /// This one, unless it is to go on: then the other.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        if self == Self::GoOn { other } else { self }
    }
}

/// Sees every exchange with the arm, from the first stay through the brake to the last stay: a recorder, a screen, a watch on the images. It must be quick and touch no heap
/// on the way (bounded queues), because the arm waits for it.
pub trait Observer {
    /// One tick.
    fn tick(&mut self, tick: &Tick) -> Wish;
}

/// Nobody watches.
impl Observer for () {
    fn tick(&mut self, _: &Tick) -> Wish {
        Wish::GoOn
    }
}

/// A function watches.
impl<F: FnMut(&Tick) -> Wish> Observer for F {
    fn tick(&mut self, tick: &Tick) -> Wish {
        self(tick)
    }
}
