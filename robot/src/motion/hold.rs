//! [`Hold`]: stay where the arm was commanded last.

use crate::{Command, Controller, Joints, State};

/// Holds the last commanded position for a number of ticks, or until the loop is stopped.
#[derive(Clone, Copy, Debug)]
pub struct Hold {
    left: Option<u64>,
    at: Option<Joints>,
}

impl Hold {
    /// For `ticks` ticks.
    pub const fn ticks(ticks: u64) -> Self {
        Self { left: Some(ticks), at: None }
    }

    /// Until the operator or the observer stops the loop.
    pub const fn until_stopped() -> Self {
        Self { left: None, at: None }
    }
}

impl Controller for Hold {
    fn step(&mut self, state: &State) -> Option<Command> {
        if let Some(left) = &mut self.left {
            *left = left.checked_sub(1)?;
        }
        Some(Command::Position(*self.at.get_or_insert(state.commanded)))
    }
}
