//! Scanning: the taught path replayed at constant force, a B-scan kept at every step along it.

use std::sync::Arc;

use probepath_frames::Stamp;
use probepath_recon::{LumenReconstruction, LumenSettings, SeedPoint, reconstruct_lumen};
use probepath_robot::motion::timing::PathSpeed;
use probepath_robot::{Operator, Phase};
use probepath_teach_replay::{
    Path, Plan, PlanSettings, Replay, ReplayEnding, ReplayPhase, ReplaySettings, ReplayStatus,
};
use probepath_us_capture::exam::Attachment;
use probepath_us_capture::{Capture, Counts, Keeping, PlacedBScan};

use super::figures::Figures;
use super::live::Live;
use super::looking::lumen_settings;
use super::motion::Motion;
use super::recorder::{Eye, LATEST, Recorder, Stand};
use super::resume::Underway;
use super::{Session, SessionError, motion};
use crate::report::PathFigures;
use crate::report::build::{ReportError, ScanFigures};

/// Name of the attachment that keeps what a scan has to say, so that a report can be made again from the exam.
pub(crate) const SCAN_FIGURES: &str = "scan.json";

/// How a path is to be scanned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanWish {
    /// Speed along the path (m/s).
    pub speed_m_s: f64,
    /// Contact force (N).
    pub force_n: f64,
    /// A B-scan is kept this far along the path from the last (m); none keeps every one.
    pub every_m: Option<f64>,
    /// Whether B-scans are taken at all.
    pub look: bool,
}

impl Default for ScanWish {
    fn default() -> Self {
        Self { speed_m_s: 0.010, force_n: 5.0, every_m: Some(0.0005), look: true }
    }
}

/// What a scan brought.
#[derive(Clone, Debug)]
pub struct Scan {
    /// The B-scans that were kept, in the order they were formed.
    pub images: Vec<PlacedBScan>,
    /// What became of all that came.
    pub counts: Counts,
    /// What the scan has to say.
    pub figures: ScanFigures,
    /// The wish it answers.
    pub wish: ScanWish,
    /// Left or right, and the study.
    pub label: probepath_teach_replay::Label,
    /// When the path was followed, first and last tick.
    pub followed: Option<(Stamp, Stamp)>,
}

/// A reconstructed lumen and the scan it came from.
#[derive(Clone, Debug)]
pub struct Lumen {
    /// The lumen.
    pub recon: LumenReconstruction,
    /// The scan it came from.
    pub scan: Scan,
}

impl ScanWish {
    /// Whether this cell may do it.
    fn check(&self, soft_n: f64) -> Result<(), SessionError> {
        let most_n = 8f64.min(soft_n - 1.0);
        let mm = |m: f64| m * 1e3;
        let limits = [
            ("speed", mm(self.speed_m_s), 1.0, 20.0, "mm/s"),
            ("force", self.force_n, 1.0, most_n, "N"),
            ("every", mm(self.every_m.unwrap_or(0.001)), 0.1, 10.0, "mm"),
        ];
        for (what, value, least, most, unit) in limits {
            // Written so that NaN is refused as well.
            if !(value >= least && value <= most) {
                let wanted = format!("it has to be between {least} and {most} {unit}");
                return Err(SessionError::Wish { what, value: format!("{value} {unit}"), wanted });
            }
        }
        Ok(())
    }
}

impl Session {
    /// Replays a path at constant force and keeps B-scans along it.
    ///
    /// # Errors
    /// When the path cannot be replayed (nothing moves then), the motion was stopped, or contact was lost.
    pub fn scan(&mut self, path: &Path, wish: &ScanWish) -> Result<Scan, SessionError> {
        wish.check(self.cell.file.force.soft_n)?;
        self.begin_exam(&path.label().study)?;
        let plan = self.plan(path, wish)?;
        let report = *plan.report();
        self.say(&format!(
            "Planned {:.0} mm: {:.0} s along the path, nearest to a singularity {:.3} at {:.0} mm.",
            path.length() * 1e3,
            report.path_s,
            report.least_singular.0,
            report.least_singular.1 * 1e3
        ));
        let keeping = wish.every_m.map_or(Keeping::All, |every_m| Keeping::Spaced { every_m });
        let capture = wish.look.then(|| self.capture(keeping)).transpose()?;
        let figures = Figures::new(path.curve().clone(), wish.force_n);
        self.stopped = None;
        let mut underway = Underway::new(path.clone(), *wish, capture, figures);
        underway.live = self.live(wish)?;
        let replay = self.replay_of(plan, wish)?;
        self.go_along(underway, replay)
    }

    /// Replays what is left of a scan under way; a stop keeps what it brought.
    pub(super) fn go_along(&mut self, mut underway: Underway, replay: Replay) -> Result<Scan, SessionError> {
        match self.replay(replay, &mut underway) {
            Ok(()) => {
                let scan = self.finished(underway)?;
                self.look_at_zero()?;
                Ok(scan)
            }
            Err(error) => {
                // Only where the guard wants a confirmation is there something to go on with.
                if let Phase::Stopped(_) = self.guard.phase() {
                    self.stopped = Some(underway);
                }
                Err(error)
            }
        }
    }

    /// What a scan brought.
    pub(super) fn finished(&mut self, underway: Underway) -> Result<Scan, SessionError> {
        let Underway { path, wish, mut capture, figures, mut images, live, .. } = underway;
        let shown = live.map(Live::finish);
        if let Some(capture) = &mut capture {
            capture.finish();
            self.keep_rest(capture, &mut images);
        }
        let counts = capture.map(|capture| capture.counts()).unwrap_or_default();
        let figures_of_scan = self.scan_figures(&path, &wish, counts, &figures)?;
        let (label, followed) = (path.label().clone(), figures.followed());
        let scan = Scan { images, counts, figures: figures_of_scan, wish, label, followed };
        let (kept, force) = (scan.images.len(), &scan.figures.force_n);
        self.say(&format!("Scanned: {kept} B-scans kept, the force {:.2} N RMS off.", force.rms_error));
        if let Some(shown) = shown {
            // Not in the exam: a simulated one holds nothing of the wall's clock.
            self.opening.progress.say(&shown.to_string());
        }
        Ok(scan)
    }

    /// The vessel while it is scanned, where somebody watches it.
    fn live(&self, wish: &ScanWish) -> Result<Option<Live>, SessionError> {
        let progress = &self.opening.progress;
        if !(wish.look && progress.watches_vessel()) {
            return Ok(None);
        }
        let settings = self.lumen_settings();
        Ok(Some(Live::start(settings, Arc::clone(progress))?))
    }

    /// How a lumen is looked for in this cell's images.
    fn lumen_settings(&self) -> LumenSettings {
        lumen_settings(self.cell.calibration.as_ref(), Some(&self.cell.file))
    }

    /// What takes B-scans, where there is a machine.
    fn capture(&self, keeping: Keeping) -> Result<Capture, SessionError> {
        Ok(Capture::new(self.cell.calibrated()?.clone(), keeping)?)
    }

    /// What the scan has to say, kept in the exam.
    fn scan_figures(
        &mut self,
        path: &Path,
        wish: &ScanWish,
        counts: Counts,
        figures: &Figures,
    ) -> Result<ScanFigures, SessionError> {
        let dropped = counts.lost + counts.in_gap + counts.out_of_order;
        let summary = ScanFigures {
            force_n: figures.force(),
            path: PathFigures {
                length_mm: path.length() * 1e3,
                smoothing_max_mm: self.smoothed_m.unwrap_or(0.0) * 1e3,
                rms_error_mm: figures.path_rms_mm(),
            },
            dropped: usize::try_from(dropped).unwrap_or(usize::MAX),
            speed_mm_s: wish.speed_m_s * 1e3,
            duration_s: (self.now - self.began).seconds(),
            warnings: Vec::new(),
        };
        let text = serde_json::to_vec(&summary).map_err(ReportError::from)?;
        if let Some(exam) = &self.exam {
            exam.attach(Attachment::new(SCAN_FIGURES, "application/json", text));
        }
        Ok(summary)
    }

    pub(super) fn plan(&mut self, path: &Path, wish: &ScanWish) -> Result<Plan, SessionError> {
        let settings = PlanSettings {
            speed: PathSpeed::gentle(wish.speed_m_s),
            workspace: self.cell.workspace(),
            ..PlanSettings::default()
        };
        let state = self.ask_where("planning", "plan")?;
        Ok(Plan::new(path, &self.cell.probe_arm(), &state.commanded, &settings)?)
    }

    /// The replay of a plan at the wish's force.
    pub(super) fn replay_of(&self, plan: Plan, wish: &ScanWish) -> Result<Replay, SessionError> {
        let settings = ReplaySettings {
            force_n: wish.force_n,
            soft_limit_n: self.cell.file.force.soft_n,
            ..ReplaySettings::default()
        };
        Ok(Replay::new(plan, settings, self.opening.operator.clone())?)
    }

    fn replay(&mut self, mut replay: Replay, underway: &mut Underway) -> Result<(), SessionError> {
        if self.resuming {
            replay = replay.slowly();
        }
        let operator: Operator = self.opening.operator.clone();
        let (watch, begins_at, whole) = (replay.watch(), underway.at_m, underway.path.length());
        let stand = || stand_of(&watch.status(), begins_at, whole);
        let Underway { capture, images, figures, live, .. } = underway;
        let exam = self.exam.as_ref().ok_or(SessionError::Order("the exam was not begun"))?;
        let facts = &self.cell.facts;
        let arm = &mut *self.cell.arm;
        let punctual = self.punctual.as_mut();
        let moving = Motion { step: "scanning", arm, exam, facts, stand: &stand, punctual };
        let (paused, looked, latest) = (false, None, LATEST);
        let eye = match (capture.as_mut(), self.cell.machine.as_mut()) {
            (None, _) => None,
            (Some(_), None) => return Err(SessionError::NoMachine),
            (Some(capture), Some(machine)) => Some(Eye {
                machine: &mut **machine,
                capture,
                images,
                operator: &operator,
                paused,
                looked,
                latest,
                live: live.as_mut(),
            }),
        };
        let mut recorder = Recorder {
            exam,
            facts,
            progress: &*self.opening.progress,
            step: "scanning",
            recording: None,
            track: None,
            eye,
            figures: Some(figures),
            zero: Some(&mut self.zero),
            now: self.now,
        };
        let done = motion::perform(moving, &mut replay, &mut self.guard, &mut recorder);
        self.now = recorder.now;
        self.resuming &= done.is_err();
        let status = watch.status();
        underway.was(&status, begins_at);
        if let Err(SessionError::Motion { source, .. }) = &done
            && source.reason.asks_to_lift()
        {
            self.lift_at_once()?;
            underway.touches = false;
        }
        done?;
        match status.ending {
            None | Some(ReplayEnding::Completed) => Ok(()),
            Some(other) => Err(SessionError::Ended { step: "scanning", why: other.to_string() }),
        }
    }

    /// What the capture still held back at the end.
    pub(super) fn keep_rest(&mut self, capture: &mut Capture, images: &mut Vec<PlacedBScan>) {
        while let Some(placed) = capture.take() {
            if let Some(exam) = &self.exam {
                exam.bscan(placed.clone());
            }
            images.push(placed);
        }
    }

    /// The lumen of a scan. The seed, if any, is a place in the first B-scan: right of its first column and below its
    /// first row (m).
    ///
    /// # Errors
    /// When too few B-scans show a lumen.
    pub fn reconstruct(&mut self, scan: &Scan, seed: Option<(f64, f64)>) -> Result<Lumen, SessionError> {
        self.opening.progress.at("reconstructing", 0.0);
        let seed = seed.map(|(x, y)| SeedPoint::Millimetres { x_mm: x * 1e3, y_mm: y * 1e3 });
        let settings = LumenSettings { seed, ..self.lumen_settings() };
        let recon = reconstruct_lumen(&scan.images, &settings)?;
        self.opening.progress.at("reconstructing", 1.0);
        Ok(Lumen { recon, scan: scan.clone() })
    }
}

/// `begins_at` metres along the path a replay of its rest begins.
fn stand_of(status: &ReplayStatus, begins_at: f64, whole: f64) -> Stand {
    let phase = match status.phase {
        ReplayPhase::Approach => "approach",
        ReplayPhase::Descend => "descend",
        ReplayPhase::Settle => "settle",
        ReplayPhase::Follow => "follow",
        ReplayPhase::Lift => "lift",
        ReplayPhase::Done => "done",
    };
    let at_m = begins_at + status.at_m;
    let along_m = matches!(status.phase, ReplayPhase::Follow).then_some(at_m);
    Stand { phase, along_m, look: along_m.is_some(), fraction: at_m / whole.max(1e-9) }
}
