//! Table II of [P1]: the error of the reconstructed phantom, setting by setting, and the stenoses' areas.

use probepath_sim::{CellConfig, Window};

use super::bench::{Folder, taught_and_scanned, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use crate::session::{CellFile, ScanWish, SessionError};

/// One setting of Table II.
struct Row {
    name: &'static str,
    depth_mm: f64,
    focus_mm: f64,
    window: Window,
    published: &'static str,
}

const fn row(name: &'static str, depth_mm: f64, focus_mm: f64, published: &'static str) -> Row {
    Row { name, depth_mm, focus_mm, window: Window::Whole, published }
}

const fn zoomed(name: &'static str, top_mm: f64, height_mm: f64, published: &'static str) -> Row {
    let window = Window::Zoom { top_mm, height_mm };
    Row { name, depth_mm: 70.0, focus_mm: 45.0, window, published }
}

/// The settings, in the order of the paper; windows are centred on the vessel, 34 mm deep.
const ROWS: [Row; 9] = [
    row("depth 5 cm", 50.0, 45.0, "0.87 ± 0.08"),
    row("depth 6 cm", 60.0, 45.0, "1.20 ± 0.02"),
    row("depth 7 cm", 70.0, 45.0, "1.74 ± 0.08"),
    row("depth 8 cm", 80.0, 45.0, "1.45 ± 0.12"),
    row("focus 2-4 cm", 70.0, 30.0, "1.71 ± 0.03"),
    row("focus 4-5 cm", 70.0, 45.0, "1.11 ± 0.003"),
    zoomed("zoom 2:7", 24.0, 20.0, "0.93 ± 0.04"),
    zoomed("zoom 3:7", 19.0, 30.0, "0.40 ± 0.03"),
    zoomed("zoom 4:7", 14.0, 40.0, "0.46 ± 0.03"),
];

/// The phantom's stenoses, percent of area ([P1] II.C.1).
const TRUE_PERCENT: [f64; 2] = [80.0, 75.0];
/// The hand goes this far, so that both stenoses lie whole inside what is scanned (mm).
const HAND_MM: f64 = 118.0;

/// The setting whose figures are goals.
const GOAL: &str = "zoom 3:7";

/// Reconstructs the straight phantom with each setting, once for each seed. `only` restricts it to one setting.
///
/// # Errors
/// When a session fails.
pub fn table2(seeds: u64, only: Option<&str>, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let chosen: Vec<&Row> = ROWS.iter().filter(|row| only.is_none_or(|name| name == row.name)).collect();
    if chosen.is_empty() {
        let names = ROWS.map(|row| row.name).join(", ");
        return Err(ValidateError::NoSetting { asked: only.unwrap_or_default().into(), names });
    }
    let folder = Folder::new("table2")?;
    let mut rows = Vec::new();
    for (i, setting) in chosen.iter().enumerate() {
        let mut found = Figures::default();
        for seed in 1..=seeds {
            tell(progress, setting.name, i as u64 * seeds + seed - 1, chosen.len() as u64 * seeds);
            found.add(setting, seed, folder.path())?;
        }
        found.report(setting, &mut rows);
    }
    Ok(Goals::new("table2: the straight phantom, surface error in mm, percent area in points", seeds, rows))
}

/// The figures of one setting over the seeds.
#[derive(Default)]
struct Figures {
    mean: Vec<f64>,
    p95: Vec<f64>,
    /// Distance of the found percent area from the true one, stenosis by stenosis.
    areas: [Vec<f64>; 2],
}

impl Figures {
    fn add(&mut self, setting: &Row, seed: u64, out: &std::path::Path) -> Result<(), ValidateError> {
        let mut simulated = CellConfig::phantom();
        simulated.hand.length_mm = HAND_MM;
        let machine = &mut simulated.machine;
        (machine.depth_mm, machine.focus_mm) = (setting.depth_mm, setting.focus_mm);
        machine.window = setting.window;
        let cell = CellFile { name: setting.name.into(), simulated, ..CellFile::default() };
        let mut bench = taught_and_scanned(&cell, seed, &ScanWish::default(), out)?;
        let lumen = match bench.session.reconstruct(&bench.scan, None) {
            Ok(lumen) => lumen,
            // A setting in which no lumen can be followed counts as not reconstructed, as in the paper.
            Err(SessionError::Reconstruction(_)) => return Ok(()),
            Err(source) => return Err(ValidateError::Session { seed, source }),
        };
        if let Some(error) = bench.session.surface_error(&lumen) {
            self.mean.push(error.mean);
            self.p95.push(error.p95);
        }
        let errors = bench.session.stenosis_errors(&lumen);
        for (values, truth) in self.areas.iter_mut().zip(TRUE_PERCENT) {
            let near = errors.iter().find(|error| (error.true_percent_area - truth).abs() < 0.1);
            // A stenosis that was not scanned whole, or not found, is wrong by all of it.
            let found = near.and_then(|error| error.found_percent_area).unwrap_or(0.0);
            values.push((found - truth).abs());
        }
        Ok(())
    }

    fn report(&self, setting: &Row, rows: &mut Vec<Goal>) {
        let goal = setting.name == GOAL;
        let name = setting.name;
        rows.push(Goal::of(
            format!("{name}: mean"),
            &self.mean,
            goal.then_some(0.40),
            Some(setting.published),
        ));
        rows.push(Goal::of(format!("{name}: 95th percentile"), &self.p95, None, None));
        for (values, truth) in self.areas.iter().zip(TRUE_PERCENT) {
            let figure = format!("{name}: {truth:.1} % area, off by");
            rows.push(Goal::of(figure, values, goal.then_some(3.0), None));
        }
    }
}
