//! What goes wrong with a program that finds lumens.

use thiserror::Error;

/// Why a program did not find lumens.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FinderFault {
    /// It cannot be started.
    #[error("the lumen finder {name} cannot be started: {source}")]
    Start {
        /// The program.
        name: String,
        /// Why.
        source: std::io::Error,
    },
    /// The time it has for an image is none.
    #[error("the lumen finder's time for one image is {seconds} s; it has to be more than zero")]
    Seconds {
        /// What was asked for (s).
        seconds: f64,
    },
    /// It ended before it had answered.
    #[error("the lumen finder {name} ended before it answered image {number} ({how}){said}")]
    Died {
        /// The program.
        name: String,
        /// The image.
        number: u64,
        /// Its exit.
        how: String,
        /// Its last words.
        said: String,
    },
    /// It took too long.
    #[error(
        "the lumen finder {name} did not answer image {number} within {seconds} s (--lumen-seconds gives it more; a \
         program has to flush its output after every answer){said}"
    )]
    Hung {
        /// The program.
        name: String,
        /// The image.
        number: u64,
        /// How long it had (s).
        seconds: f64,
        /// Its last words.
        said: String,
    },
    /// Its answer cannot be read.
    #[error("the lumen finder {name}, image {number}: {source}")]
    Pipe {
        /// The program.
        name: String,
        /// The image.
        number: u64,
        /// Why.
        source: std::io::Error,
    },
    /// What it answered is no answer.
    #[error(
        "the lumen finder {name} answered image {number} with what is no answer: {why}; it was: {answer}"
    )]
    Nonsense {
        /// The program.
        name: String,
        /// The image.
        number: u64,
        /// What is wrong with it.
        why: String,
        /// Its beginning.
        answer: String,
    },
}
