//! How a lumen is looked for in the images of a scan: what its calibration and its cell say of them.

use probepath_recon::LumenSettings;
use probepath_us_capture::Calibration;
use probepath_us_capture::exam::{Attachment, Exam};

use super::{CellFile, SessionError};

/// How a lumen is looked for in images that were taken with a calibration, in a cell; what neither says is taken to be
/// the usual.
pub(crate) fn lumen_settings(calibration: Option<&Calibration>, cell: Option<&CellFile>) -> LumenSettings {
    let mut settings = calibration.map(LumenSettings::of).unwrap_or_default();
    if let Some(tracking) = cell.and_then(CellFile::tracking) {
        settings.errors = settings.errors.tracked_by(&tracking);
    }
    if let Some(range_db) = cell.and_then(CellFile::dynamic_range_db) {
        settings.dynamic_range_db = range_db;
    }
    settings
}

/// The cell that an exam was recorded in, where the exam says it.
///
/// # Errors
/// When its file is in the exam and cannot be read.
pub(crate) fn cell_of(exam: &Exam) -> Result<Option<CellFile>, SessionError> {
    let Some(text) = exam.attachment(Attachment::CELL) else { return Ok(None) };
    CellFile::parse(text.text()?, "the exam's cell file").map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell whose arm and machine are otherwise than the usual.
    const SIMULATED: &str = "[simulated.arm]\nkinematic_error = \"paper\"\n\
                             [simulated.machine.imaging]\ndynamic_range_db = 50.0\n";

    #[test]
    fn what_a_cell_says_of_its_arm_and_machine_is_what_the_lumen_is_looked_for_with() {
        let usual = lumen_settings(None, None);
        let cell = CellFile::parse(SIMULATED, "cell.toml").unwrap();
        let told = lumen_settings(None, Some(&cell));
        assert!((told.dynamic_range_db - 50.0).abs() < 1e-12 && usual.dynamic_range_db > 55.0);
        // 0.2 mm of repeatability are 0.055 mm along an axis, 0.6 mm of accuracy 0.38 mm, here and where it was calibrated.
        assert!((told.errors.pose_sd_m - 0.0553e-3).abs() < 1e-6, "{:?}", told.errors);
        let grown = (told.errors.calibration[3][3] - usual.errors.calibration[3][3]).sqrt();
        assert!((grown - 0.532e-3).abs() < 1e-5, "{grown}");
        told.check().unwrap();
    }

    #[test]
    fn what_a_cell_does_not_say_is_the_usual() {
        let cell = CellFile::parse(include_str!("../../../cells/ur_sim.toml"), "ur_sim.toml").unwrap();
        assert!(lumen_settings(None, Some(&cell)).errors != LumenSettings::default().errors);
        let mut silent = cell;
        (silent.arm.accuracy_mm, silent.arm.repeatability_mm) = (None, None);
        silent.machine.dynamic_range_db = None;
        assert_eq!(lumen_settings(None, Some(&silent)), LumenSettings::default());
    }
}
