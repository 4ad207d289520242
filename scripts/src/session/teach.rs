//! Teaching: the arm gives way to the hand while every state is recorded, and the stream becomes a path.

use std::path::PathBuf;

use probepath_frames::{Direction, Point, World};
use probepath_robot::{Controller, GuardLimits};
use probepath_teach_replay::{
    Cleaning, Freedrive, GiveWay, HandGuide, Label, Path, ProbeArm, Recording, Side, Tube,
};
use probepath_us_capture::exam::Attachment;

use super::motion::Motion;
use super::recorder::{Recorder, Stand};
use super::{Session, SessionError, motion};

/// How a path is to be taught.
#[derive(Clone, Debug, PartialEq)]
pub struct TeachWish {
    /// The study's code, never a name.
    pub study: String,
    /// Which leg.
    pub side: Side,
    /// How the arm gives way to the hand.
    pub by: GuideBy,
    /// How far the path may be from what the hand did (m): then it is the one of least jerk that stays so near. None
    /// takes the tremor out and says how far that moved it.
    pub stay_within_m: Option<f64>,
}

/// How the arm gives way to the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GuideBy {
    /// By our own law: a mass and a damper in every direction of the probe, within the cell's limits.
    #[default]
    Compliance,
    /// By the arm's own means.
    Freedrive,
}

impl Default for TeachWish {
    fn default() -> Self {
        Self { study: "STUDY".into(), side: Side::Left, by: GuideBy::default(), stay_within_m: None }
    }
}

/// Room for ten minutes of guiding at 500 ticks a second.
const MOST_SAMPLES: usize = 300_000;

/// What whoever holds the probe is told.
const GUIDE: &str = "Hold the switch, guide the probe along the artery, lift it off, let go.";

/// The same on an arm's pendant, whose switch is the teach button.
const PENDANT: &str = "probepath: hold the teach button and guide the probe along the artery. Lift it off at its end, \
                       then release the button.";

impl GuideBy {
    /// What the guard watches for meanwhile.
    fn guard_limits(self) -> GuardLimits {
        match self {
            Self::Compliance => GuardLimits::hand_guiding(),
            Self::Freedrive => GuardLimits::freedrive(),
        }
    }

    /// What the exam calls its ticks.
    const fn stand(self) -> Stand {
        let phase = match self {
            Self::Compliance => "teach",
            Self::Freedrive => "freedrive",
        };
        Stand { phase, along_m: None, look: false, fraction: 0.0 }
    }
}

impl Session {
    /// The operator guides the probe along the artery; what comes back is the cleaned path.
    ///
    /// # Errors
    /// When the motion was stopped, or what was taught makes no path.
    pub fn teach(&mut self, wish: &TeachWish) -> Result<Path, SessionError> {
        self.begin_exam(&wish.study)?;
        self.say(GUIDE);
        let mut recording = Recording::with_capacity(MOST_SAMPLES);
        self.cell.arm.ask_to_guide(PENDANT)?;
        let guided = self.guide(wish.by, &mut recording);
        self.cell.arm.done_guiding();
        guided?;
        let label = Label {
            study: wish.study.clone(),
            side: wish.side,
            date: self.opening.date.clone().unwrap_or_else(|| "simulated".into()),
        };
        let tube = wish.stay_within_m.map(Tube::of);
        let cleaning = Cleaning { tube, ..Cleaning::default() };
        let (path, report) = Path::clean(recording.samples(), label, &cleaning)?;
        self.smoothed_m = Some(report.moved_most);
        self.say(&format!(
            "Taught {:.0} mm: {} of {} states used, {:.1} s of pauses left out, smoothing moved the path by at most \
             {:.2} mm.",
            path.length() * 1e3,
            report.used,
            report.samples,
            report.pauses_s,
            report.moved_most * 1e3
        ));
        self.attach_path(&path)?;
        Ok(path)
    }

    fn guide(&mut self, by: GuideBy, recording: &mut Recording) -> Result<(), SessionError> {
        const STEP: &str = "teaching";
        let arm = self.cell.probe_arm();
        let usual = *self.guard.limits();
        let stand = || by.stand();
        let start = self.ask_where(STEP, by.stand().phase)?.commanded;
        let mut controller: Box<dyn Controller + Send> = match by {
            GuideBy::Compliance => {
                let guide = HandGuide::new(arm, &start, GiveWay::default())?;
                let guide = guide.within(self.cell.workspace())?;
                Box::new(if self.resuming { guide.slowly() } else { guide })
            }
            GuideBy::Freedrive => Box::new(Freedrive::new(arm.period.seconds())),
        };
        let exam = self.exam.as_ref().ok_or(SessionError::Order("the exam was not begun"))?;
        let facts = &self.cell.facts;
        self.guard.set_limits(self.cell.as_the_file_says(by.guard_limits()));
        let (arm, punctual) = (&mut *self.cell.arm, self.punctual.as_mut());
        let moving = Motion { step: STEP, arm, exam, facts, stand: &stand, punctual };
        let mut recorder = Recorder {
            exam,
            facts,
            progress: &*self.opening.progress,
            step: STEP,
            recording: Some(recording),
            track: None,
            eye: None,
            figures: None,
            zero: Some(&mut self.zero),
            now: self.now,
        };
        let done = motion::perform(moving, &mut *controller, &mut self.guard, &mut recorder);
        self.now = recorder.now;
        // A hand that led the arm was no commanded motion: the next one that is begins slowly.
        self.resuming &= done.is_err() || by == GuideBy::Freedrive;
        self.guard.set_limits(usual);
        done
    }

    /// Keeps a path in the exam.
    pub(super) fn attach_path(&mut self, path: &Path) -> Result<(), SessionError> {
        let text = path.to_text()?;
        if let Some(exam) = &self.exam {
            exam.attach(Attachment::path(text));
        }
        Ok(())
    }

    /// A path of an earlier session.
    ///
    /// # Errors
    /// When the file is none.
    pub fn load_path(&mut self, name: &str) -> Result<Path, SessionError> {
        Ok(Path::load(&PathBuf::from(name))?)
    }

    /// Saves a path into the session's folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save_path(&mut self, path: &Path, name: &str) -> Result<(), SessionError> {
        Ok(path.save(&self.file(name))?)
    }

    /// The part of a path between two distances along it (m).
    ///
    /// # Errors
    /// When they lie outside it.
    pub fn trim(&mut self, path: &Path, from_m: f64, until_m: f64) -> Result<Path, SessionError> {
        Ok(path.trimmed(from_m, until_m)?)
    }

    /// The path for the other leg: mirrored in the table's midline, the World's plane x = 0.
    ///
    /// # Errors
    /// When the mirrored poses make no path.
    pub fn mirrored(&mut self, path: &Path) -> Result<Path, SessionError> {
        let base_from_world = self.cell.facts.world_from_base.inverse();
        let (point, normal) = (Point::<World>::new(0.0, 0.0, 0.0), Direction::<World>::x());
        Ok(path.mirrored(base_from_world * point, base_from_world * normal)?)
    }
}

impl super::cell::Cell {
    /// The arm as planning and moving see it.
    pub(super) fn probe_arm(&self) -> ProbeArm {
        ProbeArm {
            model: self.facts.model.clone(),
            flange_from_probe: self.facts.flange_from_probe,
            limits: self.limits,
            period: self.arm.period(),
        }
    }
}
