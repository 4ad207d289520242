//! `simulate`: serves until Ctrl-C.

use std::sync::mpsc;

use probepath_scripts::offline::{SimulateRequest, simulate};

use super::Outcome;
use crate::cli::{Clock, Simulate};
use crate::screen::{Document, Screen};

/// Says what is served where, and serves it.
///
/// # Errors
/// When nothing can be served, or what happened cannot be written.
pub fn perform(args: Simulate, screen: &Screen) -> Outcome {
    let (stop, stopped) = mpsc::channel();
    if args.until_input_ends {
        let stop = stop.clone();
        std::thread::spawn(move || {
            // What is typed means nothing; when nobody can type any more it is over.
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            stop.send(()).unwrap_or(())
        });
    }
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
    let served = Document::of(&serving.so_far())?;
    if let Some(path) = args.report {
        std::fs::write(&path, format!("{:#}\n", served.json))
            .map_err(|why| format!("cannot write {}: {why}", path.display()))?;
    }
    // Standard output had its document already.
    Ok(Document { json: serde_json::Value::Null, ..served })
}
