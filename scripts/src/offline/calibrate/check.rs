//! `probepath calibrate check`: whether a stored calibration still holds.

use std::fmt;
use std::path::PathBuf;

use probepath_us_capture::check::{CheckOptions, CheckReport, Verdict, check_shots};
use probepath_us_capture::fit::PhantomPlace;
use probepath_us_capture::{Calibration, Quality};
use serde::Serialize;

use super::request::CheckRequest;
use super::spatial::watching;
use super::subject::Subject;
use super::{CalibrateError, options};
use crate::progress::Progress;

/// What a check says of a stored calibration.
#[derive(Clone, Debug, Serialize)]
pub struct Checked {
    /// The calibration's file.
    pub calibration: PathBuf,
    /// Its id.
    pub id: String,
    /// The scan.
    pub sequence: PathBuf,
    /// Whether the calibration holds; by how much it does not, and what to do.
    #[serde(flatten)]
    pub report: CheckReport,
    /// What the reader must know.
    pub notes: Vec<String>,
}

/// Checks a stored calibration with a short scan of its phantom.
///
/// # Errors
/// When a file cannot be read, the scan is of another phantom or another setting, or nothing says where the phantom is.
pub fn check(request: &CheckRequest, progress: &dyn Progress) -> Result<Checked, CalibrateError> {
    progress.at("reading", 0.0);
    let calibration = Calibration::read(&request.calibration)?;
    let subject = Subject::read(&request.subject)?;
    let recording = subject.record(&request.sequence, &request.subject)?;
    let (place, whence) = place(request, &subject, &calibration)?;
    let check_options = CheckOptions {
        water_celsius: request.water_celsius,
        mask: options::mask(recording.region, &request.subject)?,
        ..CheckOptions::default()
    };
    let watch = watching(progress, "checking", 0.1, 1.0);
    let found = check_shots(&recording.shots, &calibration, &subject.phantom, place, &check_options, &watch)
        .map_err(|source| CalibrateError::Check { path: request.sequence.clone(), source })?;
    Ok(Checked {
        calibration: request.calibration.clone(),
        id: calibration.id,
        sequence: request.sequence.clone(),
        report: found.report(),
        notes: [subject.notes, recording.notes, whence].concat(),
    })
}

/// The phantom's place with its note: as given by hand, else as the calibration found it, else the configuration's.
fn place(
    request: &CheckRequest,
    subject: &Subject,
    calibration: &Calibration,
) -> Result<(PhantomPlace, Vec<String>), CalibrateError> {
    let stored = calibration.quality.as_ref().map(Quality::place).transpose()?.flatten();
    if let (Some(stored), None) = (stored, &request.phantom_to_reference) {
        let note = "the phantom is taken to stand where the calibration found it: give --phantom-to-reference if it \
                    was put elsewhere";
        return Ok((PhantomPlace::prior(stored), vec![note.into()]));
    }
    let place = subject.place(request.phantom_to_reference.as_ref())?;
    Ok((PhantomPlace::prior(place.ok_or(CalibrateError::NoPlace { wish: "prior" })?), Vec::new()))
}

impl fmt::Display for Checked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.report.verdict {
            Verdict::Holds if self.report.seen_only => "PASS where the phantom was seen",
            Verdict::Holds => "PASS",
            Verdict::Moved => "FAIL",
            Verdict::CannotTell => "CANNOT TELL",
        };
        writeln!(f, "{verdict}: calibration {} by {}", self.id, self.sequence.display())?;
        writeln!(f, "{}", self.report.words)?;
        writeln!(f, "{} of {} images labelled", self.report.labelled, self.report.images)?;
        if let Some(change) = &self.report.change {
            writeln!(
                f,
                "the worst pixel moved {:.2} ± {:.2} mm, the image {:.2} mm on average",
                change.worst_mm, change.worst_error_mm, change.mean_mm
            )?;
        }
        if let Some(misfit) = &self.report.misfit {
            let mid = misfit.mid_rms_mm.map(|mid| format!("middle wires {mid:.2} mm, ")).unwrap_or_default();
            let line = misfit.line_rms_mm.unwrap_or(f64::NAN);
            writeln!(
                f,
                "stored calibration on the scan's dots (rms): {mid}distance from wires {line:.2} mm"
            )?;
        }
        for (code, count) in &self.report.refused {
            writeln!(f, "refused: {count} images ({code})")?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        Ok(())
    }
}
