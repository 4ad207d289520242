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
    /// Give way to the hand by the arm's own means, until told something else. [`State::commanded`] follows the
    /// measured position meanwhile, so that what comes next starts from where the hand left the arm.
    Freedrive,
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
    /// What the arm's own safety system says.
    pub safety: Safety,
    /// How old the measurement was, by the host's clock, when the exchange returned it: zero in simulation. It is the
    /// host's time and not the arm's, so nothing that must be repeatable may hang on it.
    pub age: Span,
}

/// What the arm's own safety system says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Safety {
    /// All is well.
    #[default]
    Normal,
    /// The arm moves, within its controller's reduced limits.
    Reduced,
    /// The arm stopped by itself: a collision, a limit. It is unlocked by hand.
    ProtectiveStop,
    /// A safeguard (light curtain, gate, enabling switch) holds the arm.
    SafeguardStop,
    /// An emergency stop is pressed.
    EmergencyStop,
    /// The arm was found outside its own limits, and may only be moved back by hand.
    Recovery,
    /// The safety system itself is at fault.
    Fault,
}

impl Safety {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Normal,
        Self::Reduced,
        Self::ProtectiveStop,
        Self::SafeguardStop,
        Self::EmergencyStop,
        Self::Recovery,
        Self::Fault,
    ];

    /// Whether the arm may move.
    pub const fn lets_move(self) -> bool {
        matches!(self, Self::Normal | Self::Reduced)
    }

    /// Its name in files: `normal`, `protective stop`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Reduced => "reduced",
            Self::ProtectiveStop => "protective stop",
            Self::SafeguardStop => "safeguard stop",
            Self::EmergencyStop => "emergency stop",
            Self::Recovery => "recovery",
            Self::Fault => "fault",
        }
    }

    /// The one of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|safety| safety.name() == name)
    }
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
    /// A safeguard holds the arm.
    #[error("a safeguard stopped the arm after tick {tick}: {why}; clear it, then recover the arm by hand")]
    SafeguardStop {
        /// The last tick seen.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// An emergency stop is pressed.
    #[error(
        "an emergency stop was pressed after tick {tick}: {why}; release it when the cause is gone, switch the arm \
         on, then recover it by hand"
    )]
    EmergencyStop {
        /// The last tick seen.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// The arm's safety system is at fault, or wants the arm moved back by hand.
    #[error("the arm's safety system does not let it move after tick {tick}: {why}")]
    SafetyFault {
        /// The last tick seen.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// The arm heard nothing in time, and stopped by its own watchdog.
    #[error("the arm stopped by its own watchdog after tick {tick}: {why}; recover it by hand")]
    WatchdogStop {
        /// The last tick seen.
        tick: u64,
        /// The cause, in words.
        why: String,
    },
    /// The command has another number of joints, or a number that is not finite; or the arm cannot do it.
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

    /// The states that came together with the one that the last exchange gave, and are older; oldest first. This
    /// computer was late: nothing was commanded upon them, but whoever records or looks at B-scans wants them all.
    fn overtaken(&self) -> &[State] {
        &[]
    }

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

    /// After the operator's stop: the command for the next tick on the way to rest along its own path, for some ticks at
    /// most. `None` where there is no path, or no way left to go: the limits brake every joint by itself then.
    fn halt(&mut self, _state: &State) -> Option<Command> {
        None
    }
}
