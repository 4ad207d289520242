//! Going on after a stop, in a script: the step that was stopped says why, the script may catch it, and `confirm()` asks a
//! person.
//!
//! ```text
//! let images = ();
//! try { images = scan(path); } catch (why) { print(why); confirm(); images = resume(); }
//! ```

use std::sync::Arc;

use probepath_robot::{Asked, Operator};
use rhai::{Engine, NativeCallContext};

use super::Stage;
use super::steps::Outcome;
use crate::session::{Scan, Session};

/// How each step is written, for messages.
pub(super) const USAGE: &[(&str, &str)] = &[
    (
        "confirm",
        "confirm(), after a stop: asks the operator whether the arm may move again, and lifts the probe off",
    ),
    ("resume", "resume(), after a stop and confirm(): goes on with the scan from where it was"),
];

/// Registers the steps.
pub(super) fn register(engine: &mut Engine, stage: &Stage) {
    let s = stage.clone();
    engine.register_fn("confirm", move |context: NativeCallContext| -> Outcome<()> {
        s.step(&context, Session::confirm)
    });
    let s = stage.clone();
    engine.register_fn("resume", move |context: NativeCallContext| -> Outcome<Arc<Scan>> {
        s.step(&context, Session::resume).map(Arc::new)
    });
}

/// Whether a script ends between two steps: the operator asked to stop, and no step has told the script of it. One that
/// a step has told may be caught, and answered with a confirmation; a second stop ends the script.
pub(super) fn ends(stage: &Stage, operator: &Operator) -> bool {
    let heard = stage.heard.load(std::sync::atomic::Ordering::SeqCst);
    operator.wish() == Asked::Stop && operator.stops() != heard
}
