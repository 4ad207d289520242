//! One motion of the session: a controller, the one loop, and what its end means.

use probepath_robot::{
    Arm, BlackBox, Command, Controller, Ending, Guard, Observer, RunError, State, StopReason, run,
};

use super::SessionError;

/// Runs a motion to its end.
///
/// # Errors
/// When it was stopped, by a fault, by the operator or by whoever watched.
pub(super) fn perform(
    step: &'static str,
    arm: &mut dyn Arm,
    controller: &mut dyn Controller,
    guard: &mut Guard,
    observer: &mut dyn Observer,
) -> Result<(), SessionError> {
    let finished = run(arm, controller, guard, observer)
        .map_err(|source: Box<RunError>| SessionError::Motion { step, source })?;
    match finished.ending {
        Ending::Done => Ok(()),
        Ending::Operator => Err(SessionError::Stopped { step }),
        Ending::Observer(why) => Err(SessionError::Ended { step, why }),
    }
}

/// What the arm measures now; it stays where it is.
///
/// # Errors
/// When it does not answer.
pub(super) fn ask(step: &'static str, arm: &mut dyn Arm) -> Result<State, SessionError> {
    arm.exchange(&Command::Stay).map_err(|fault| {
        let black_box = BlackBox::default();
        let source = RunError { reason: StopReason::Arm(fault), last: None, at_rest: true, black_box };
        SessionError::Motion { step, source: Box::new(source) }
    })
}
