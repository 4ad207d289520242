//! [`control_thread`]: work that must be punctual on a thread of its own, while the caller does what may wait.

use std::thread;

use thiserror::Error;

use super::grant::{RealtimeReport, be_realtime};
use super::message;

/// Why a control thread gave no answer.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ControlThreadError {
    /// The system started none.
    #[error("no thread could be started for {name}: {why}; nothing was commanded")]
    NotStarted {
        /// The thread's name.
        name: String,
        /// Why.
        why: String,
    },
    /// It ended by a bug.
    #[error("{name} panicked: {message}; this is a bug, please report it")]
    Panicked {
        /// The thread's name.
        name: String,
        /// What it said.
        message: String,
    },
}

/// Runs `work` on a thread of its own that asks to be real time, while `meanwhile` runs on the caller's; gives what
/// both gave once both have ended.
///
/// A panic of `work` comes back as an error. If `meanwhile` panics, its panic goes on after `work` has ended: whatever
/// `work` waits for has to end it then, as the tape does ([`super::tape`]).
///
/// # Errors
/// When no thread can be started (`meanwhile` is not run then), or `work` panicked.
pub fn control_thread<T: Send, M>(
    name: &str,
    work: impl FnOnce(RealtimeReport) -> T + Send,
    meanwhile: impl FnOnce() -> M,
) -> Result<(T, M), ControlThreadError> {
    thread::scope(|scope| {
        let thread = thread::Builder::new()
            .name(name.to_owned())
            .spawn_scoped(scope, move || work(be_realtime()))
            .map_err(|e| ControlThreadError::NotStarted { name: name.to_owned(), why: e.to_string() })?;
        let seen = meanwhile();
        let done = thread.join().map_err(|panic| ControlThreadError::Panicked {
            name: name.to_owned(),
            message: message(panic.as_ref()),
        })?;
        Ok((done, seen))
    })
}
