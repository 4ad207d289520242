//! `probepath compare EARLIER --follow-up LATER`: two exams of one leg, and what changed.

use std::fmt;
use std::path::{Path, PathBuf};

use probepath_recon::measures::table::{TableError, from_csv};
use probepath_recon::{
    AreaChange, ChangedStretch, FALSE_ALARM, FollowUpError, ReconError, Section, StenosisChange, follow_up,
    reconstruct_lumen,
};
use probepath_us_capture::Calibration;
use probepath_us_capture::exam::{Attachment, Exam, ExamError};
use serde::Serialize;
use thiserror::Error;

use crate::session::{SessionError, cell_of, lumen_settings};

/// A later exam beside an earlier one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FollowedUp {
    /// The earlier exam, or its table of sections.
    pub earlier: PathBuf,
    /// The later one.
    pub later: PathBuf,
    /// A place of the later exam is this much farther along the earlier one (mm).
    pub shift_mm: f64,
    /// Its standard deviation (mm).
    pub shift_sd_mm: f64,
    /// Root mean square distance of the centrelines, laid on one another (mm).
    pub centrelines_apart_mm: f64,
    /// Where both measured, in the earlier exam's places (mm).
    pub overlap_mm: [f64; 2],
    /// Mean change of the area (%), with its 95 % interval.
    pub mean_percent: f64,
    /// That interval.
    pub mean_percent_interval: [f64; 2],
    /// A difference of this many standard deviations is a change.
    pub limit_sd: f64,
    /// Exams of an unchanged leg show a change in at most this part of the cases.
    pub false_alarm: f64,
    /// Stretches whose area changed.
    pub changed: Vec<ChangedStretch>,
    /// Stenoses of both.
    pub stenoses: Vec<StenosisChange>,
    /// Every section that both measured.
    pub areas: Vec<AreaChange>,
}

/// Exams that cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FollowedUpError {
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A table that is none.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TableError,
    },
    /// An exam that cannot be read.
    #[error(transparent)]
    Exam(#[from] ExamError),
    /// An exam whose cell cannot be read.
    #[error("{}: {source}", path.display())]
    Cell {
        /// The exam.
        path: PathBuf,
        /// Why.
        source: Box<SessionError>,
    },
    /// An exam without a lumen.
    #[error("{}: {source}", path.display())]
    Lumen {
        /// The exam.
        path: PathBuf,
        /// Why.
        source: ReconError,
    },
    /// Exams that are not of the same vessel, or too short.
    #[error(transparent)]
    FollowUp(#[from] FollowUpError),
}

/// Compares two exams (`.mcap`, reconstructed here with the calibrations they hold) or tables of sections
/// (`sections.csv`, as `probepath reconstruct` leaves them).
///
/// # Errors
/// When one cannot be read, shows no lumen, or they are not of the same vessel.
pub fn followed_up(earlier: &Path, later: &Path) -> Result<FollowedUp, FollowedUpError> {
    let found = follow_up(&sections(earlier)?, &sections(later)?)?;
    Ok(FollowedUp {
        earlier: earlier.into(),
        later: later.into(),
        shift_mm: found.shift_mm,
        shift_sd_mm: found.shift_sd_mm,
        centrelines_apart_mm: found.centrelines_apart_mm,
        overlap_mm: found.overlap_mm,
        mean_percent: found.mean_percent,
        mean_percent_interval: found.mean_percent_interval,
        limit_sd: found.limit,
        false_alarm: FALSE_ALARM,
        changed: found.changed,
        stenoses: found.stenoses,
        areas: found.areas,
    })
}

fn sections(path: &Path) -> Result<Vec<Section>, FollowedUpError> {
    if path.extension().is_some_and(|ending| ending == "mcap") {
        return of_exam(path);
    }
    let text = std::fs::read_to_string(path)
        .map_err(|source| FollowedUpError::File { path: path.into(), source })?;
    from_csv(&text).map_err(|source| FollowedUpError::Table { path: path.into(), source })
}

fn of_exam(path: &Path) -> Result<Vec<Section>, FollowedUpError> {
    let exam = Exam::open(path)?;
    let calibration = exam.attachment(Attachment::CALIBRATION).and_then(|a| a.text().ok());
    let calibration = calibration.and_then(|text| Calibration::from_toml(text).ok());
    let cell = cell_of(&exam)
        .map_err(|source| FollowedUpError::Cell { path: path.into(), source: source.into() })?;
    let found = reconstruct_lumen(&exam.bscans, &lumen_settings(calibration.as_ref(), cell.as_ref()))
        .map_err(|source| FollowedUpError::Lumen { path: path.into(), source })?;
    Ok(found.sections)
}

impl fmt::Display for FollowedUp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([from, to], [low, high]) = (self.overlap_mm, self.mean_percent_interval);
        writeln!(f, "{} after {}", self.later.display(), self.earlier.display())?;
        writeln!(
            f,
            "both measured {from:.0} to {to:.0} mm; the later one is {:+.1} ± {:.1} mm along, centrelines {:.1} mm apart",
            self.shift_mm, self.shift_sd_mm, self.centrelines_apart_mm
        )?;
        writeln!(f, "area {:+.1} % on average (95 % interval {low:+.1} to {high:+.1})", self.mean_percent)?;
        for stretch in &self.changed {
            let most = &stretch.most;
            writeln!(
                f,
                "changed {:.0} to {:.0} mm: {:.1} mm² became {:.1} mm² at {:.0} mm ({:+.0} %, {:.1} standard deviations)",
                stretch.from_mm,
                stretch.to_mm,
                most.earlier_mm2,
                most.later_mm2,
                most.at_mm,
                most.percent(),
                most.score().abs()
            )?;
        }
        if self.changed.is_empty() {
            writeln!(f, "no area changed by more than both exams' errors explain")?;
        }
        for change in &self.stenoses {
            stenosis(f, change)?;
        }
        write!(f, "an unchanged leg shows a change in at most {:.0} % of the cases", 100.0 * self.false_alarm)
    }
}

fn stenosis(f: &mut fmt::Formatter<'_>, change: &StenosisChange) -> fmt::Result {
    match (&change.earlier, &change.later, change.points_interval) {
        (Some(then), Some(now), Some([low, high])) => writeln!(
            f,
            "stenosis at {:.0} mm: {:.1} % of the area then, {:.1} % now ({low:+.1} to {high:+.1} points)",
            then.at_mm, then.percent_area, now.percent_area
        ),
        (Some(then), ..) => {
            writeln!(f, "stenosis at {:.0} mm ({:.1} %): not found now", then.at_mm, then.percent_area)
        }
        (None, Some(now), _) => {
            writeln!(f, "new stenosis at {:.0} mm of the later exam: {:.1} %", now.at_mm, now.percent_area)
        }
        (None, None, _) => Ok(()),
    }
}
