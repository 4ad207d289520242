//! Protocols: a scan as a Rhai script.
//!
//! ```text
//! let path = teach(#{ study: "LEG-007", side: "left" });
//! let images = scan(path, #{ speed: mm_s(10), force: newton(5), every: mm(0.5) });
//! let lumen = reconstruct(images);
//! report(lumen);
//! ```
//!
//! A script decides what is done and in which order; every step is the session's, with the session's limits and guard
//! below it. A stop works at any instant: inside a step the loop brakes the arm, between two steps the script ends. A
//! script that never ends is ended by its budget. Errors give line and column. A step that was stopped may be caught, and
//! after a person's confirmation (`confirm()`) the scan goes on (`resume()`).

mod calibration;
mod steps;
mod stops;

use std::sync::atomic::AtomicU32;
use std::sync::{Arc, Mutex};

use probepath_robot::{Asked, Operator};
use rhai::{Engine, EvalAltResult, Position};
use thiserror::Error;

use crate::session::{Session, SessionError};

/// What a protocol may spend between two steps before it is taken for endless: far more than any protocol needs, a
/// second or so of computing.
const MOST_OPERATIONS: u64 = 20_000_000;

/// The protocol that is run when none is named: the femoral artery.
pub const FEMORAL: &str = include_str!("../library/femoral.rhai");

/// The calibration of the probe on a phantom of wires.
pub const CALIBRATE: &str = include_str!("../library/calibrate.rhai");

/// The protocols that come along, by name.
const LIBRARY: [(&str, &str); 2] = [("femoral", FEMORAL), ("calibrate", CALIBRATE)];

/// A protocol's text and the name it goes by.
#[derive(Clone, Debug, PartialEq)]
pub struct Protocol {
    /// File name, for messages and the report.
    pub name: String,
    /// The script.
    pub text: String,
}

impl Protocol {
    /// The default protocol.
    pub fn femoral() -> Self {
        Self { name: "femoral.rhai".into(), text: FEMORAL.into() }
    }

    /// The protocol of this name (`calibrate` or `calibrate.rhai`) that comes along, when there is one.
    pub fn of_library(name: &str) -> Option<Self> {
        let bare = name.strip_suffix(".rhai").unwrap_or(name);
        let (name, text) = LIBRARY.into_iter().find(|(known, _)| *known == bare)?;
        Some(Self { name: format!("{name}.rhai"), text: text.into() })
    }

    /// Whether it is the library's calibration, whose simulated cell is the one with the phantom of wires.
    pub fn is_calibration(&self) -> bool {
        self.text == CALIBRATE
    }
}

/// Why a protocol did not run to its end. The arm is at rest, and what was recorded is kept.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ProtocolError {
    /// The script cannot be read.
    #[error("{file}:{place}: {message}")]
    Syntax {
        /// The protocol.
        file: String,
        /// Line and column.
        place: Place,
        /// What is wrong.
        message: String,
    },
    /// The script did something that is no step of a scan.
    #[error("{file}:{place}: {message}")]
    Script {
        /// The protocol.
        file: String,
        /// Line and column.
        place: Place,
        /// What is wrong.
        message: String,
    },
    /// A step failed.
    #[error("{file}:{place}: {source}")]
    Step {
        /// The protocol.
        file: String,
        /// Line and column.
        place: Place,
        /// Why.
        source: Box<SessionError>,
    },
    /// The script computes without end.
    #[error(
        "{file}:{place}: the protocol ran {MOST_OPERATIONS} operations, far more than a scan needs; is there a loop that never ends?"
    )]
    Endless {
        /// The protocol.
        file: String,
        /// Line and column.
        place: Place,
    },
    /// The operator stopped it.
    #[error("{file}: stopped by the operator; what was recorded until then is kept")]
    Stopped {
        /// The protocol.
        file: String,
    },
}

/// Line and column of a script, counted from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line, when known.
    pub line: Option<usize>,
    /// Column, when known.
    pub column: Option<usize>,
}

impl From<Position> for Place {
    fn from(position: Position) -> Self {
        Self { line: position.line(), column: position.position() }
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.line, self.column) {
            (Some(line), Some(column)) => write!(f, "{line}:{column}"),
            (Some(line), None) => write!(f, "{line}"),
            _ => write!(f, "?"),
        }
    }
}

/// What the script's functions share: the session, and the session's own error when a step failed.
#[derive(Clone)]
struct Stage {
    session: Arc<Mutex<Session>>,
    failed: Arc<Mutex<Option<SessionError>>>,
    /// How many of the operator's stops the steps have told the script of.
    heard: Arc<AtomicU32>,
}

impl Stage {
    fn of(session: &Arc<Mutex<Session>>) -> Self {
        Self { session: Arc::clone(session), failed: Arc::default(), heard: Arc::default() }
    }
}

/// Runs a protocol on a session.
///
/// # Errors
/// When the script cannot be read, does something that is no step, never ends, is stopped, or a step fails. The arm
/// is at rest then, and the session keeps what was recorded.
pub fn run(protocol: &Protocol, session: &Arc<Mutex<Session>>) -> Result<(), ProtocolError> {
    let operator = lock(session).operator().clone();
    let stage = Stage::of(session);
    perform(protocol, &stage, &operator).map_err(|error| {
        let failed = lock(&stage.failed).take();
        explain(protocol, &error, failed, &operator)
    })
}

/// A lock that outlives a panic: what it guards is still the session whose exam has to be closed.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn perform(protocol: &Protocol, stage: &Stage, operator: &Operator) -> Result<(), Box<EvalAltResult>> {
    let engine = engine(stage, operator);
    let ast = engine.compile(&protocol.text).map_err(|e| Box::new(EvalAltResult::ErrorParsing(*e.0, e.1)))?;
    engine.run_ast(&ast)
}

fn engine(stage: &Stage, operator: &Operator) -> Engine {
    let mut engine = Engine::new();
    // The defaults of a debug build are tighter than those of a release; a protocol means the same in both.
    engine.set_max_expr_depths(64, 64);
    engine.set_max_call_levels(64);
    engine.set_max_operations(MOST_OPERATIONS);
    engine.set_max_string_size(1 << 20);
    engine.set_max_array_size(100_000);
    engine.set_max_map_size(10_000);
    let (watched, watching) = (operator.clone(), stage.clone());
    engine.on_progress(move |_| stops::ends(&watching, &watched).then(|| "stopped".into()));
    let session = Arc::clone(&stage.session);
    engine.on_print(move |text| lock(&session).say(text));
    let session = Arc::clone(&stage.session);
    engine.on_debug(move |text, _, position| lock(&session).say(&format!("{position:?}: {text}")));
    crate::quantity::register(&mut engine);
    steps::register(&mut engine, stage);
    stops::register(&mut engine, stage);
    calibration::register(&mut engine, stage);
    engine
}

/// The engine's error in the protocol's words.
fn explain(
    protocol: &Protocol,
    error: &EvalAltResult,
    failed: Option<SessionError>,
    operator: &Operator,
) -> ProtocolError {
    let file = protocol.name.clone();
    let place = Place::from(innermost(error).position());
    if let Some(source) = failed {
        return if operator.wish() == Asked::Stop && source.is_stop() {
            ProtocolError::Stopped { file }
        } else {
            ProtocolError::Step { file, place, source: Box::new(source) }
        };
    }
    match innermost(error) {
        EvalAltResult::ErrorTerminated(..) => ProtocolError::Stopped { file },
        EvalAltResult::ErrorTooManyOperations(_) => ProtocolError::Endless { file, place },
        EvalAltResult::ErrorParsing(kind, _) => {
            ProtocolError::Syntax { file, place, message: kind.to_string() }
        }
        EvalAltResult::ErrorFunctionNotFound(signature, _) => {
            ProtocolError::Script { file, place, message: not_found(signature) }
        }
        EvalAltResult::ErrorStackOverflow(_) => {
            let message = "functions call each other too deep; does one call itself without end?".into();
            ProtocolError::Script { file, place, message }
        }
        EvalAltResult::ErrorRuntime(value, _) => {
            ProtocolError::Script { file, place, message: value.to_string() }
        }
        other => {
            let mut bare = format!("{other}");
            if let Some(at) = bare.rfind(" (line ") {
                bare.truncate(at);
            }
            ProtocolError::Script { file, place, message: bare }
        }
    }
}

/// Where an error began: inside the functions that a script defines itself.
fn innermost(mut error: &EvalAltResult) -> &EvalAltResult {
    while let EvalAltResult::ErrorInFunctionCall(_, _, inner, _) = error {
        error = inner;
    }
    error
}

fn not_found(signature: &str) -> String {
    let name = signature.split([' ', '(']).next().unwrap_or(signature);
    let usage = steps::usage().find(|(step, _)| *step == name);
    usage.map_or_else(
        || format!("nothing is called `{signature}`; the steps are {}", steps::names()),
        |(_, how)| format!("`{signature}` does not fit; write {how}"),
    )
}

#[cfg(test)]
mod tests;
