//! Where text goes: one JSON document to standard output, people's text and the progress bar to standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{ProgressBar, ProgressStyle};
use probepath_scripts::{Progress, View};
use serde::Serialize;

/// What a command leaves: the same thing for people and for programs.
pub struct Document {
    /// For people.
    pub text: String,
    /// For programs; null when they were told already, and the text goes to people only.
    pub json: serde_json::Value,
}

impl Document {
    /// A document of something that says itself both ways.
    ///
    /// # Errors
    /// When it cannot be written as JSON.
    pub fn of<T: Serialize + Display>(thing: &T) -> Result<Self, serde_json::Error> {
        Ok(Self { text: thing.to_string(), json: serde_json::to_value(thing)? })
    }
}

/// The terminal.
pub struct Screen {
    json: bool,
    bar: ProgressBar,
}

impl Screen {
    /// With `json`, standard output belongs to the document. No bar where nobody looks.
    pub fn new(json: bool) -> Self {
        let bar =
            if std::io::stderr().is_terminal() { ProgressBar::new(1000) } else { ProgressBar::hidden() };
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {wide_msg}");
        Self { json, bar: bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())) }
    }

    /// What long work tells its progress to.
    pub fn progress(&self) -> Arc<dyn Progress> {
        Arc::new(Bar { bar: self.bar.clone(), step: Mutex::default() })
    }

    /// Leaves the document of something that goes on.
    pub fn ready(&self, document: &Document) -> std::io::Result<()> {
        let mut out = std::io::stdout().lock();
        if self.json {
            writeln!(out, "{:#}", document.json)?;
        } else {
            writeln!(out, "{}", document.text.trim_end())?;
        }
        out.flush()
    }

    /// Leaves the document; nothing when all was said already. A reader that went away (a closed pipe) is not a failure.
    pub fn document(&self, document: &Document) -> ExitCode {
        self.bar.finish_and_clear();
        if document.json.is_null() {
            let _ = writeln!(std::io::stderr().lock(), "{}", document.text.trim_end());
            return ExitCode::SUCCESS;
        }
        let mut out = std::io::stdout().lock();
        let written = if self.json {
            writeln!(out, "{:#}", document.json)
        } else {
            writeln!(out, "{}", document.text.trim_end())
        };
        match written {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => ExitCode::from(1),
            _ => ExitCode::SUCCESS,
        }
    }

    /// Says what went wrong, with its causes.
    pub fn failure(&self, error: &dyn Error) -> ExitCode {
        self.bar.finish_and_clear();
        let mut told = error.to_string();
        let mut cause = error.source();
        while let Some(deeper) = cause {
            // Many errors already say their cause; it is not said twice.
            if !told.contains(&deeper.to_string()) {
                told = format!("{told}\n  because: {deeper}");
            }
            cause = deeper.source();
        }
        let _ = writeln!(std::io::stderr().lock(), "probepath: {told}");
        if self.json {
            let document = serde_json::json!({ "error": told });
            let _ = writeln!(std::io::stdout().lock(), "{document:#}");
        }
        ExitCode::from(1)
    }
}

/// A progress bar behind the session's trait.
struct Bar {
    bar: ProgressBar,
    /// What is being done: its words stay until the next step, those of the vessel so far beside them.
    step: Mutex<String>,
}

impl Progress for Bar {
    fn at(&self, step: &str, fraction: f64) {
        let mut shown = self.step.lock().unwrap_or_else(PoisonError::into_inner);
        if *shown != step {
            step.clone_into(&mut shown);
            self.bar.set_message(step.to_owned());
        }
        self.bar.set_position((fraction.clamp(0.0, 1.0) * 1000.0) as u64);
    }

    fn watches_vessel(&self) -> bool {
        !self.bar.is_hidden()
    }

    fn vessel(&self, so_far: &View) {
        self.bar.set_message(format!("scanning: {so_far}"));
    }

    fn say(&self, text: &str) {
        self.bar.suspend(|| {
            let _ = writeln!(std::io::stderr().lock(), "{text}");
        });
    }

    /// One line of standard input: `yes`, and nothing else, is a yes. Where nobody types, it is a no.
    fn confirm(&self, question: &str) -> bool {
        self.say(&format!("{question}\nType yes: "));
        let mut line = String::new();
        let read = std::io::stdin().read_line(&mut line);
        read.is_ok() && line.trim() == "yes"
    }
}
