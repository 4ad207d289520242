//! No way of losing the process, the link, the operator or a sensor leaves the arm moving.
//!
//! Over the wire the judge is the simulated controller: its clock, its last received package, and where its arm truly
//! was. In this process it is the exam's clock, and the commands.

mod faults;
mod here;
mod wire;

use std::path::Path;

use super::bench::{Folder, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use wire::Loss;

/// At rest within this after the last package, the word or the hang (ms).
const AT_REST_MS: f64 = 100.0;
/// Nothing moves again by itself (mm).
const STILL_MM: f64 = 0.1;

/// Loses process and link of a scan that `probepath` (the program's own file) makes over the wire, and whatever else a
/// motion can lose in this process.
///
/// # Errors
/// When a cell cannot be served, or the scan does not come to move.
pub fn safety(seeds: u64, probepath: &Path, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let folder = Folder::new("safety")?;
    let mut rows = here::rows(seeds, folder.path(), progress)?;
    rows.extend(faults::rows(seeds)?);
    let losses = Loss::ALL.len() as u64;
    for (number, loss) in (0..).zip(Loss::ALL) {
        let (mut rest, mut after) = (Vec::new(), Vec::new());
        for seed in 1..=seeds {
            tell(progress, "safety", number * seeds + seed - 1, losses * seeds);
            let bench = wire::Bench { seed, probepath, folder: folder.path() };
            let lost = wire::lose(loss, &bench)?;
            rest.push(lost.rest_ms);
            after.push(lost.moved_after_mm);
        }
        rows.push(Goal::of(format!("{}: to rest, ms", loss.words()), &rest, Some(AT_REST_MS), None));
        rows.push(Goal::of(format!("{}: moved after, mm", loss.words()), &after, Some(STILL_MM), None));
    }
    Ok(Goals::new("safety: every way out ends at rest", seeds, rows))
}
