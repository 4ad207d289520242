//! `probepath validate`: a goal table, ours beside the published figure, measured in simulation over many seeds.
//!
//! The truth of the simulated cell is asked here, after the code under test has given its answer, and nowhere before.

mod bench;
mod force;
mod motion;
mod safety;
mod soak;
mod speed;
mod table1;
mod table2;

use std::fmt;

use serde::Serialize;
use thiserror::Error;

pub use force::force;
pub use motion::{Shares, motion, shares};
pub use safety::safety;
pub use soak::{SoakWish, soak};
pub use speed::speed;
pub use table1::table1;
pub use table2::{Table2Wish, table2};

use crate::session::SessionError;

/// A goal table.
#[derive(Clone, Debug, Serialize)]
pub struct Goals {
    /// What was validated.
    pub goal: String,
    /// How many seeds.
    pub seeds: u64,
    /// Row by row.
    pub rows: Vec<Goal>,
    /// Whether every row with a bound kept it.
    pub reached: bool,
}

/// One row: a figure, its spread over the seeds, and what it is held against.
#[derive(Clone, Debug, Serialize)]
pub struct Goal {
    /// What was measured, with its unit.
    pub figure: String,
    /// Mean over the seeds.
    pub mean: f64,
    /// Standard deviation over the seeds.
    pub sd: f64,
    /// The worst seed.
    pub worst: f64,
    /// The bound: our own, on the row's `judged` number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_most: Option<f64>,
    /// The published figure, when there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub published: Option<String>,
    /// How many seeds gave the figure.
    pub counted: usize,
    /// Whether the figure to reach was met: the worst seed is within the bound; rows without a bound say nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub met: Option<bool>,
}

/// Why a validation could not be carried out.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ValidateError {
    /// A session failed.
    #[error("seed {seed}: {source}")]
    Session {
        /// The seed.
        seed: u64,
        /// Why.
        source: SessionError,
    },
    /// The folder for the exams cannot be made.
    #[error("cannot make a folder for the exams: {0}")]
    Folder(#[from] std::io::Error),
    /// The exam that was recorded cannot be read back.
    #[error("seed {seed}: {source}")]
    Exam {
        /// The seed.
        seed: u64,
        /// Why.
        source: probepath_us_capture::exam::ExamError,
    },
    /// The simulated cell cannot be served on its wire.
    #[error("cannot serve the simulated cell: {why}")]
    Served {
        /// Why.
        why: String,
    },
    /// The B-scans cannot be drawn.
    #[error("the B-scans cannot be drawn: {why}")]
    Drawing {
        /// Why.
        why: String,
    },
    /// The program itself failed.
    #[error("the reconstruction of {images} images failed: {why}")]
    Command {
        /// How many images.
        images: u64,
        /// What it said.
        why: String,
    },
    /// No such setting.
    #[error("no setting is called \"{asked}\"; there are {names}")]
    NoSetting {
        /// What was asked for.
        asked: String,
        /// What there is.
        names: String,
    },
    /// Nothing to do.
    #[error("at least one seed is needed")]
    NoSeeds,
}

impl Goal {
    /// A row of one number per seed, held by its worst seed.
    fn of(figure: impl Into<String>, values: &[f64], at_most: Option<f64>, published: Option<&str>) -> Self {
        let counted = values.len();
        let mean = values.iter().sum::<f64>() / counted.max(1) as f64;
        let spread = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let sd = (spread / counted.saturating_sub(1).max(1) as f64).sqrt();
        // What is no number is worse than any, so that it cannot hide.
        let worse = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
        let worst = values.iter().copied().fold(f64::NEG_INFINITY, worse);
        Self {
            figure: figure.into(),
            mean,
            sd,
            worst,
            at_most,
            published: published.map(str::to_owned),
            counted,
            met: at_most.map(|bound| counted > 0 && worst <= bound),
        }
    }
}

impl Goals {
    fn new(goal: &str, seeds: u64, rows: Vec<Goal>) -> Self {
        let reached = rows.iter().all(|row| row.met != Some(false));
        Self { goal: goal.to_owned(), seeds, rows, reached }
    }
}

impl fmt::Display for Goals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} seeds", self.goal, self.seeds)?;
        writeln!(f, "{:<44} {:>16} {:>8} {:>8}  published", "", "mean ± sd", "worst", "at most")?;
        for row in &self.rows {
            let bound = row.at_most.map_or_else(String::new, |b| format!("{b:.2}"));
            let mark = match row.met {
                Some(true) => "kept",
                Some(false) => "MISSED",
                None => "",
            };
            let published = row.published.as_deref().unwrap_or("");
            let mean = format!("{:.3} ± {:.3}", row.mean, row.sd);
            writeln!(
                f,
                "{:<44} {mean:>16} {:>8.3} {bound:>8}  {published:<16} {mark}",
                row.figure, row.worst
            )?;
        }
        write!(f, "{}", if self.reached { "every bound was kept" } else { "a bound was MISSED" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bad_seed_misses_the_bound() {
        let goals = Goals::new("x", 3, vec![Goal::of("error", &[0.1, 0.2, 0.5], Some(0.4), None)]);
        assert!(!goals.reached);
        assert!(goals.to_string().contains("MISSED"));
    }

    #[test]
    fn what_is_no_number_keeps_no_bound() {
        assert_eq!(Goal::of("error", &[0.1, f64::NAN, 0.2], Some(0.4), None).met, Some(false));
    }

    #[test]
    fn no_seed_keeps_no_bound() {
        assert_eq!(Goal::of("error", &[], Some(0.4), None).met, Some(false));
    }
}
