//! What hardware, simulation and recording share: [`Arm`], and what drives it: [`Controller`].

use probepath_frames::{Probe, Span, Stamp, Wrench};
use thiserror::Error;

use crate::Joints;

/// What the arm is told for the next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Be at rest: the first exchange of a connection, and the last after any stop. An arm that moves brakes by its
    /// own means.
    Stay,
    /// Be at these joint positions (rad, m) at the next tick.
    Position(Joints),
}

/// What the arm measured at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Ticks since the connection; a skipped number is a missed tick.
    pub tick: u64,
    /// When the joints were measured.
    pub stamp: Stamp,
    /// Measured joint positions (rad, m).
    pub position: Joints,
    /// Measured joint velocities (rad/s, m/s).
    pub velocity: Joints,
    /// The joint positions that the arm was last told to be at; where it was found before the first command.
    /// A motion starts from here, so that the servo's lag never becomes a jump.
    pub commanded: Joints,
    /// What the outside (skin, hand) does to the probe; the tool's weight and the sensor's bias are taken off.
    pub wrench: Wrench<Probe>,
    /// The hold-to-move switch: hand guiding goes on only while the operator holds it.
    pub guiding: bool,
}

/// Why an arm did not give its next state.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ArmFault {
    /// The connection is gone.
    #[error("the arm's connection was lost after tick {tick}: {why}; check the cable, then connect again")]
    ConnectionLost {
        /// The last tick seen.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// The controller stopped the arm by itself.
    #[error("the arm stopped by itself after tick {tick}: {why}; find the cause, then recover it by hand")]
    ProtectiveStop {
        /// The last tick seen.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// The command has another number of joints, or a number that is not finite.
    #[error("the arm refused the command of tick {tick}: {why}")]
    Refused {
        /// The tick.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// A recorded arm was told something else than what was recorded.
    #[error(
        "tick {tick} of the recording: joint {joint} was commanded {recorded} then and {given} now; \
         the same software, protocol and exam give the same commands"
    )]
    Diverged {
        /// The tick.
        tick: u64,
        /// The joint, counted from zero.
        joint: usize,
        /// The position in the recording (rad, m).
        recorded: f64,
        /// The position commanded now (rad, m).
        given: f64,
    },
    /// A recorded arm has no more rows.
    #[error("the recording ends at tick {tick}")]
    RecordingEnds {
        /// The last tick.
        tick: u64,
    },
}

/// An arm: simulated, recorded or real.
///
/// One tick: the command goes out, the next state comes back. Hardware blocks until its own tick, a simulation
/// returns at once, a recording reads its next row.
pub trait Arm {
    /// One tick.
    ///
    /// # Errors
    /// When no next state came, or the command was refused; the arm then brakes by its own means.
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault>;

    /// The time between two ticks.
    fn period(&self) -> Span;

    /// How many joints it has.
    fn joints(&self) -> usize;
}

/// Decides the next command. No clock, no heap, no IO. `None` ends the motion.
///
/// Replay, hand guiding, approach and retreat are all controllers. Times are the state's stamps.
pub trait Controller {
    /// The command for the next tick.
    fn step(&mut self, state: &State) -> Option<Command>;
}
