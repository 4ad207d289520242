//! `simulate`: serves until Ctrl-C.

use std::sync::mpsc;

use probepath_scripts::offline::{SimulateRequest, simulate};

use super::Outcome;
use crate::cli::{Clock, Simulate};
use crate::screen::{Document, Screen};

/// Says what is served where, and serves it.
///
/// # Errors
/// When nothing can be served.
pub fn perform(args: Simulate, screen: &Screen) -> Outcome {
    let (stop, stopped) = mpsc::channel();
    // Nobody listens any more once it stops by itself.
    ctrlc::set_handler(move || stop.send(()).unwrap_or(()))?;
    let serving = simulate(&SimulateRequest {
        cell: args.cell,
        seed: args.seed,
        host: args.host,
        simulated_time: args.time == Clock::Simulated,
        write_cell: args.write_cell,
    })?;
    screen.ready(&Document::of(&serving)?)?;
    // The handler keeps its end for as long as the program runs.
    stopped.recv()?;
    Ok(Document { text: serving.farewell(), json: serde_json::Value::Null })
}
