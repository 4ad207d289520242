//! Real time: a control thread of its own, what the system grants it, and how punctual it was.
//!
//! ```
//! use probepath_frames::Span;
//! use probepath_robot::realtime::Histogram;
//!
//! let mut lateness = Histogram::default();
//! (1..=1000).for_each(|us| lateness.record(Span::from_nanoseconds(1000 * us)));
//! let figures = lateness.figures().expect("something was counted");
//! assert_eq!(figures.max_us, 1000.0);
//! assert!(figures.p99_us >= 990.0 && figures.p99_us < 1.032 * 990.0);
//! ```
//!
//! [`run_apart`] is the road for hardware: the one loop ([`crate::run`]) on a [`control_thread`] that asks the system to
//! [`be_realtime`], every tick carried to whoever watches over a [`tape`] that never makes the loop wait, and every
//! exchange measured into [`Timings`]. It does not make a system real time that is not: it asks, and says what it got.

mod apart;
mod grant;
mod histogram;
pub mod tape;
mod thread;
mod timings;

#[cfg(test)]
mod tests;

pub use apart::{Apart, run_apart};
pub use grant::{Grant, Rank, RealtimeReport, be_realtime, take_rank};
pub use histogram::{Figures, Histogram};
pub use thread::{ControlThreadError, control_thread};
pub use timings::{Clock, Monotonic, Timed, TimingFigures, Timings};

use crate::run::message;
