//! The host's clock, as far as the wire needs it: ends of waits, ages of data. No command hangs on it.

use std::time::{Duration, Instant};

/// Now.
#[expect(clippy::disallowed_methods, reason = "a wait on a socket needs an end, and a datum from one an age")]
pub(super) fn now() -> Instant {
    Instant::now()
}

/// Waits, while a person's controller does not yet let a stop be unlocked.
#[expect(
    clippy::disallowed_methods,
    reason = "the dashboard refuses for five seconds, and is asked now and then"
)]
pub(super) fn wait(span: Duration) {
    std::thread::sleep(span);
}
