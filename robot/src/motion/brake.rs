//! [`Brake`]: to rest, as hard as the limits allow.

use crate::{Command, Controller, State};

/// Comes to rest and ends. The loop itself brakes when it is left; this is for whoever wants the rest as a motion of
/// its own. `Command::Stay` inside a motion is turned into the limits' own brake by the loop.
#[derive(Clone, Copy, Debug, Default)]
pub struct Brake {
    last: Option<State>,
    still: u8,
}

/// After this many equal commanded positions the commanded velocity and acceleration are zero.
const STILL: u8 = 3;

impl Controller for Brake {
    fn step(&mut self, state: &State) -> Option<Command> {
        let same = self.last.is_some_and(|last| last.commanded == state.commanded);
        self.still = if same { self.still + 1 } else { 0 };
        self.last = Some(*state);
        (self.still < STILL).then_some(Command::Stay)
    }
}
