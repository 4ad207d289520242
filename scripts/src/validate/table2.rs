//! Table II of [P1]: the error of the reconstructed phantom, setting by setting, with the calibration that probepath
//! finds for that setting; the same with the paper's arm; what was otherwise; and the leg.

mod figures;
mod run;
mod settings;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::bench::{Folder, tell};
use super::{Goals, ValidateError};
use crate::progress::Progress;
use run::Outcome;
use settings::Row;

/// What of the table is to be measured, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table2Wish {
    /// How many seeds.
    pub seeds: u64,
    /// Only the line of this name.
    pub setting: Option<String>,
    /// How many seeds at a time.
    pub jobs: usize,
    /// Folder that keeps what every seed gave: a seed that is there already is not run again.
    pub keep: Option<PathBuf>,
}

/// Reconstructs with each setting, once for each seed: speckle, noise, the hand, the arm's error, the machine's unknown
/// plane and lateness all differ.
///
/// # Errors
/// When there is no such setting or no seed, or the disk refuses. A seed that fails is part of the table.
pub fn table2(wish: &Table2Wish, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if wish.seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let chosen = chosen(wish.setting.as_deref())?;
    let folder = Folder::new("table2")?;
    if let Some(keep) = &wish.keep {
        std::fs::create_dir_all(keep)?;
    }
    let outcomes = all(&chosen, wish, folder.path(), progress);
    let mut rows = Vec::new();
    for (row, outcomes) in chosen.iter().zip(&outcomes) {
        for (seed, outcome) in (1..).zip(outcomes) {
            if let Some(why) = &outcome.failed {
                progress.say(&format!("{}, seed {seed}: {why}", row.name));
            }
        }
        rows.extend(figures::rows(row, outcomes));
    }
    let title =
        "table2: each setting calibrated on the wires, then the vessel reconstructed with that calibration";
    Ok(Goals::new(title, wish.seeds, rows))
}

fn chosen(only: Option<&str>) -> Result<Vec<Row>, ValidateError> {
    let all = Row::all();
    let Some(asked) = only else { return Ok(all) };
    let names: Vec<String> = all.iter().map(|row| row.name.clone()).collect();
    let chosen: Vec<Row> = all.into_iter().filter(|row| row.name == asked).collect();
    if chosen.is_empty() {
        return Err(ValidateError::NoSetting { asked: asked.into(), names: names.join("; ") });
    }
    Ok(chosen)
}

/// What every seed of every line gave, some at a time.
fn all(rows: &[Row], wish: &Table2Wish, folder: &Path, progress: &dyn Progress) -> Vec<Vec<Outcome>> {
    let seeds = wish.seeds as usize;
    let count = rows.len() * seeds;
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let given: Mutex<Vec<(usize, Outcome)>> = Mutex::new(Vec::with_capacity(count));
    let work = || {
        loop {
            let nth = next.fetch_add(1, Ordering::Relaxed);
            let Some(row) = rows.get(nth / seeds).filter(|_| nth < count) else { return };
            tell(progress, &row.name, done.load(Ordering::Relaxed) as u64, count as u64);
            let outcome = one(row, (nth % seeds) as u64 + 1, wish.keep.as_deref(), folder);
            given.lock().unwrap_or_else(PoisonError::into_inner).push((nth, outcome));
            done.fetch_add(1, Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..wish.jobs.clamp(1, count)).map(|_| scope.spawn(work)).collect();
        work();
        drop(others);
    });
    let mut given = given.into_inner().unwrap_or_else(PoisonError::into_inner);
    given.sort_by_key(|(nth, _)| *nth);
    let mut each = given.into_iter().map(|(_, outcome)| outcome);
    rows.iter().map(|_| each.by_ref().take(seeds).collect()).collect()
}

/// What one seed gave: as it was kept, or now.
fn one(row: &Row, seed: u64, keep: Option<&Path>, folder: &Path) -> Outcome {
    let name = format!("{}-{seed}", row.name.replace([' ', ',', ':', '\''], "-"));
    let kept = keep.map(|keep| keep.join(format!("{name}.json")));
    let before = kept.as_ref().and_then(|path| std::fs::read(path).ok());
    if let Some(outcome) = before.and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
        return outcome;
    }
    let out = folder.join(&name);
    let outcome = Outcome::of(row, seed, &out);
    if let (Some(path), Ok(text)) = (kept, serde_json::to_vec(&outcome)) {
        // What cannot be kept is run again the next time.
        let _ = std::fs::write(path, text);
    }
    // Its exams are large, and nobody asked for them.
    let _ = std::fs::remove_dir_all(out);
    outcome
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_setting_is_named_beside_those_there_are() {
        let wish = Table2Wish { seeds: 1, setting: Some("depth 9 cm".into()), ..Table2Wish::default() };
        let error = table2(&wish, &()).unwrap_err().to_string();
        assert!(error.contains("depth 9 cm") && error.contains("zoom 2:7, the paper's arm"), "{error}");
    }

    #[test]
    fn a_seed_that_was_kept_is_not_run_again() {
        let keep = Folder::new("table2-kept").unwrap();
        let outcome = Outcome { surface_mm: Some((0.123, 0.4)), ..Outcome::default() };
        let text = serde_json::to_vec(&outcome).unwrap();
        std::fs::write(keep.path().join("zoom-3-7-1.json"), text).unwrap();
        let wish = Table2Wish {
            seeds: 1,
            setting: Some("zoom 3:7".into()),
            jobs: 2,
            keep: Some(keep.path().to_owned()),
        };
        let goals = table2(&wish, &()).unwrap();
        assert!((goals.rows[0].mean - 0.123).abs() < 1e-12 && !goals.reached, "{goals}");
    }
}
