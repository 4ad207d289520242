//! [`UrError`]: why there is no connection to a controller, in words.

use std::time::Duration;

use probepath_frames::Span;
use thiserror::Error;

use super::lines::LineError;
use super::rtde::{ControllerVersion, Reply, RtdeError};
use crate::ArmFault;

/// Why a controller cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum UrError {
    /// A setting that cannot be.
    #[error("{name} is {value}: {why}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Nobody answers there.
    #[error(
        "no {what} answers at {host}, port {port}: {source}; is the controller on, its cable in, its address right?"
    )]
    Unreachable {
        /// Where.
        host: String,
        /// At which port.
        port: u16,
        /// What should.
        what: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// Somebody took the connection, and says nothing.
    #[error("the {what} said nothing for {:.1} s while {doing}; is it a UR controller?", .waited.as_secs_f64())]
    Silent {
        /// Who.
        what: &'static str,
        /// Meanwhile.
        doing: &'static str,
        /// How long.
        waited: Duration,
    },
    /// The connection was closed.
    #[error("the {what} closed the connection while {doing}")]
    Closed {
        /// Who.
        what: &'static str,
        /// Meanwhile.
        doing: &'static str,
    },
    /// Reading or writing failed.
    #[error("the connection to the {what} failed while {doing}: {source}")]
    Io {
        /// Who.
        what: &'static str,
        /// Meanwhile.
        doing: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// What came is no RTDE, or not what was agreed.
    #[error("the RTDE server, while {doing}: {source}")]
    Rtde {
        /// Meanwhile.
        doing: &'static str,
        /// Why.
        source: RtdeError,
    },
    /// It said something else than what was asked.
    #[error("the RTDE server answered with a packet of kind {kind} while {doing}")]
    Unexpected {
        /// Meanwhile.
        doing: &'static str,
        /// The packet.
        kind: &'static str,
    },
    /// It does not speak version 2.
    #[error("the controller does not speak RTDE version 2; it needs PolyScope 5.10 or later")]
    OldProtocol,
    /// A controller that this software was not made for.
    #[error("the controller has version {found}: {why}")]
    Version {
        /// Its version.
        found: ControllerVersion,
        /// What is wrong with it.
        why: &'static str,
    },
    /// What came from the dashboard's port is no dashboard.
    #[error("port 29999 is no UR dashboard: it begins with {banner:?}")]
    NoDashboard {
        /// How it begins.
        banner: String,
    },
    /// What came from the dashboard is no text.
    #[error("the dashboard server: {0}")]
    Lines(#[from] LineError),
    /// The dashboard did not do it.
    #[error("the dashboard was asked to {asked:?} and answered {answered:?}")]
    Dashboard {
        /// What was asked.
        asked: String,
        /// What it said.
        answered: String,
    },
    /// Nobody but the pendant may command the arm.
    #[error(
        "the controller is in local control; switch it to remote control at the top right of the pendant"
    )]
    LocalControl,
    /// The arm is not ready to move.
    #[error("the arm is not ready: {why}")]
    NotReady {
        /// In words, with what to do.
        why: String,
    },
    /// Somebody else's program runs.
    #[error("a program runs on the controller that is not ours; stop it at the pendant first")]
    OtherProgram,
    /// Our script did not begin.
    #[error("our script does not run: after {:.1} s the program is {runtime} and the script {script}{said}", .waited.as_secs_f64())]
    ScriptDidNotStart {
        /// How long it was waited for.
        waited: Duration,
        /// What the controller says of the program.
        runtime: &'static str,
        /// What the script says of itself.
        script: &'static str,
        /// What else the controller said.
        said: String,
    },
    /// The script on the controller is of another version of this software.
    #[error("the script on the controller speaks protocol {found}, this software speaks {expected}")]
    Protocol {
        /// What it speaks.
        found: i32,
        /// What we speak.
        expected: i32,
    },
    /// The controller does not have the payload that it was told.
    #[error(
        "the controller was told a payload of {told_kg} kg at [{told_mm:.1?}] mm from the flange and has {found_kg} kg \
         at [{found_mm:.1?}] mm; the force sensor would read the tool's weight, and a hand-guided arm would sink"
    )]
    Payload {
        /// What it was told (kg).
        told_kg: f64,
        /// Where (mm).
        told_mm: [f64; 3],
        /// What it has (kg).
        found_kg: f64,
        /// Where (mm).
        found_mm: [f64; 3],
    },
    /// The model of the arm and the controller disagree about where the flange is.
    #[error(
        "the controller says the flange is at [{theirs_mm:.1?}] mm of its base, our model of the arm says \
         [{ours_mm:.1?}] mm, {off_mm:.1} mm and {off_degrees:.1} degrees away (tolerated: {tolerated_mm:.0} mm, \
         {tolerated_degrees:.0} degrees): {hint}"
    )]
    ModelDisagrees {
        /// Where the controller says it is, in its own base (mm).
        theirs_mm: [f64; 3],
        /// Where our model says it is, in the controller's base (mm).
        ours_mm: [f64; 3],
        /// How far apart (mm).
        off_mm: f64,
        /// How far apart (degrees).
        off_degrees: f64,
        /// What is tolerated (mm).
        tolerated_mm: f64,
        /// What is tolerated (degrees).
        tolerated_degrees: f64,
        /// What it looks like.
        hint: &'static str,
    },
    /// The force sensor cannot be zeroed now.
    #[error("the force sensor is not zeroed: {why}")]
    NotZeroed {
        /// In words.
        why: String,
    },
    /// The arm failed meanwhile.
    #[error("{0}")]
    Arm(#[from] ArmFault),
    /// Nothing needs recovering.
    #[error("the arm has no fault to recover from")]
    NothingToRecover,
    /// A length of time that cannot be.
    #[error("{name} is {} s: it has to be above zero", .value.seconds())]
    Time {
        /// Its name.
        name: &'static str,
        /// What it is.
        value: Span,
    },
}

/// Wraps what the codec says.
pub(super) fn rtde(doing: &'static str) -> impl Fn(RtdeError) -> UrError {
    move |source| UrError::Rtde { doing, source }
}

/// A reply's kind in words.
pub(super) const fn kind_of(reply: &Reply<'_>) -> &'static str {
    match reply {
        Reply::ProtocolVersion { .. } => "protocol version",
        Reply::ControllerVersion(_) => "controller version",
        Reply::Text(_) => "text",
        Reply::Data { .. } => "data",
        Reply::Outputs { .. } => "output recipe",
        Reply::Inputs { .. } => "input recipe",
        Reply::Start { .. } => "start",
        Reply::Pause { .. } => "pause",
    }
}
