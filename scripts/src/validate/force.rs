//! The contact force along the leg: 5 N at 10 mm/s on skin of 0.3 to 3 N/mm.

use super::bench::{Folder, taught_and_scanned, tell};
use super::{Goal, Goals, ValidateError};
use crate::progress::Progress;
use crate::session::{CellFile, ScanWish};

/// Scans the leg of each seed without looking, and holds the measured force against the one that was set.
///
/// # Errors
/// When a session fails.
pub fn force(seeds: u64, progress: &dyn Progress) -> Result<Goals, ValidateError> {
    if seeds == 0 {
        return Err(ValidateError::NoSeeds);
    }
    let folder = Folder::new("force")?;
    let (mut rms, mut overshoot, mut most) = (Vec::new(), Vec::new(), Vec::new());
    let mut true_rms = Vec::new();
    for seed in 1..=seeds {
        tell(progress, "force", seed - 1, seeds);
        let wish = ScanWish { look: false, ..ScanWish::default() };
        let bench = taught_and_scanned(&CellFile::default(), seed, &wish, folder.path())?;
        rms.push(bench.scan.figures.force_n.rms_error);
        overshoot.push(bench.scan.figures.force_n.overshoot);
        most.push(bench.scan.figures.force_n.max);
        true_rms.extend(bench.session.true_force_rms(&bench.scan));
    }
    let rows = vec![
        Goal::of("measured force, RMS error, N", &rms, Some(0.3), Some("0.098")),
        Goal::of("true force, RMS error, N", &true_rms, Some(0.3), None),
        Goal::of("touch-down overshoot, N", &overshoot, Some(1.0), None),
        Goal::of("largest force, N", &most, None, None),
    ];
    Ok(Goals::new("force: 5 N along the leg at 10 mm/s, skin of 0.3 to 3 N/mm", seeds, rows))
}
