//! Going on after a stop: a person confirms, the probe comes off the skin, and the scan goes on from where it was.
//!
//! ```text
//!  scan() ──▶ done
//!    │ stopped: by the guard, the arm itself, the operator, or whoever watches
//!    ▼
//!  the arm rests where the brake left it, the force on the skin no more than it was;
//!  after too much force it was lifted off at once, and rests there
//!    │ confirm(): a person said yes; the arm is made ready, and lifted off slowly where it may touch
//!    ▼
//!  resume() ──▶ over the path to where it was, slow at first, down to the skin, and on; or the end
//! ```

use probepath_robot::{Phase, State, Trip};
use probepath_teach_replay::{LiftOff, Path, ReplayError, ReplayPhase, ReplayStatus};
use probepath_us_capture::{Capture, PlacedBScan};

use super::figures::Figures;
use super::live::Live;
use super::motion::Motion;
use super::recorder::Stand;
use super::scan::{Scan, ScanWish};
use super::{Session, SessionError, motion};

/// How far the probe is lifted off (m).
const LIFT_M: f64 = 0.04;
/// How fast after too much force: as fast as it may go on the skin with room to spare (m/s).
const LIFT_M_S: f64 = 0.02;
/// How fast after a confirmation, and as slowly as the guard wants it then (m/s).
const SLOW_LIFT_M_S: f64 = 0.008;
/// How many ticks the motors get to follow the brake's last command.
const TICKS_TO_SETTLE: usize = 500;
/// Half the joint speed (rad/s, m/s) at which the guard takes an arm for one at rest.
const SETTLED: f64 = 0.01;
/// Above this force (N) the probe may touch something.
const TOUCHES_N: f64 = 0.8;

/// A scan under way, and what it has brought until now.
pub(super) struct Underway {
    pub(super) path: Path,
    pub(super) wish: ScanWish,
    pub(super) capture: Option<Capture>,
    pub(super) figures: Figures,
    pub(super) images: Vec<PlacedBScan>,
    /// The vessel so far, where somebody watches.
    pub(super) live: Option<Live>,
    /// How far along the path the skin was followed (m).
    pub(super) at_m: f64,
    /// Whether the probe may be on the skin.
    pub(super) touches: bool,
}

impl Underway {
    /// Nothing was followed yet.
    pub(super) const fn new(path: Path, wish: ScanWish, capture: Option<Capture>, figures: Figures) -> Self {
        Self { path, wish, capture, figures, images: Vec::new(), live: None, at_m: 0.0, touches: false }
    }

    /// How far a replay of its rest went, which began `begins_at` metres along the path.
    pub(super) fn was(&mut self, status: &ReplayStatus, begins_at: f64) {
        self.at_m = begins_at + status.at_m;
        self.touches = !matches!(status.phase, ReplayPhase::Approach | ReplayPhase::Done);
    }
}

impl Session {
    /// The scan that was stopped, from where it was: over the path, slow at first, down to the skin, and on along it.
    /// What was captured until the stop stays.
    ///
    /// # Errors
    /// When no scan was stopped, nobody has confirmed since, and as [`scan`](Self::scan).
    pub fn resume(&mut self) -> Result<Scan, SessionError> {
        let mut underway = self
            .stopped
            .take()
            .ok_or(SessionError::Order("no scan was stopped: there is nothing to go on with"))?;
        if let Phase::Stopped(_) = self.guard.phase() {
            self.stopped = Some(underway);
            return Err(SessionError::NotConfirmed { why: Trip::NotConfirmed.to_string() });
        }
        // From the last point that was reached: what was seen there is seen twice, nothing is left out.
        let (spacing, whole) = (underway.path.spacing(), underway.path.length());
        underway.at_m = (underway.at_m / spacing).floor() * spacing;
        let Ok(rest) = underway.path.trimmed(underway.at_m, whole) else {
            self.say("The path was followed to its last points before the stop.");
            return self.finished(underway);
        };
        self.say(&format!("Going on at {:.0} of {:.0} mm.", underway.at_m * 1e3, whole * 1e3));
        let begun = self.plan(&rest, &underway.wish).and_then(|plan| self.replay_of(plan, &underway.wish));
        match begun {
            Ok(replay) => self.go_along(underway, replay),
            Err(error) => {
                self.stopped = Some(underway);
                Err(error)
            }
        }
    }

    /// Asks a person whether the arm may move again after a stop; on a yes the arm is made ready, the probe comes off
    /// the skin slowly where it may touch it, and the guard is told. Nothing else moves.
    ///
    /// # Errors
    /// When nobody says yes, the arm cannot be made ready, or its state is not fit to move from.
    pub fn confirm(&mut self) -> Result<(), SessionError> {
        const STEP: &str = "confirming";
        let Phase::Stopped(trip) = *self.guard.phase() else {
            return Err(SessionError::Order("nothing was stopped: there is nothing to confirm"));
        };
        self.begin_exam("CONFIRMED")?;
        let question = format!(
            "The arm was stopped: {trip}. Look at it. May it move again, slowly, and first lift the probe off?"
        );
        if !self.opening.progress.confirm(&question) {
            return Err(SessionError::NotConfirmed { why: "nobody said yes".into() });
        }
        self.say("Confirmed by the operator.");
        self.opening.operator.allow();
        if matches!(trip, Trip::Fault | Trip::StoppedItself { .. }) {
            let done = self.cell.arm.recover()?;
            self.say(&done);
        }
        let state = self.ask_at_rest(STEP, "confirm")?;
        let touches = self.stopped.as_ref().is_some_and(|underway| underway.touches);
        if touches || state.wrench.force.norm() > TOUCHES_N {
            self.lift(SLOW_LIFT_M_S)?;
        }
        if let Some(underway) = &mut self.stopped {
            underway.touches = false;
        }
        let state = self.ask_at_rest(STEP, "confirm")?;
        self.guard.confirm(&state).map_err(|trip| SessionError::NotConfirmed { why: trip.to_string() })?;
        self.resuming = true;
        Ok(())
    }

    /// After too much force the probe comes off the skin at once: standing still would go on pressing. Then it rests,
    /// and a confirmation is needed as after every stop.
    pub(super) fn lift_at_once(&mut self) -> Result<(), SessionError> {
        let Phase::Stopped(trip) = *self.guard.phase() else { return Ok(()) };
        let lifted = self.lift(LIFT_M_S);
        self.guard.disarm(trip, self.now);
        lifted
    }

    /// What the arm measures once its motors have followed the brake's last command: a second at most.
    fn ask_at_rest(&mut self, step: &'static str, phase: &'static str) -> Result<State, SessionError> {
        let mut state = self.ask_where(step, phase)?;
        for _ in 0..TICKS_TO_SETTLE {
            if state.velocity.largest() < SETTLED {
                break;
            }
            state = self.ask_where(step, phase)?;
        }
        Ok(state)
    }

    /// The probe comes off the skin along its own axis, and the force may only fall.
    fn lift(&mut self, speed_m_s: f64) -> Result<(), SessionError> {
        const STEP: &str = "lifting off";
        let stand = || Stand { phase: "lift", along_m: None, look: false, fraction: 1.0 };
        let mut lift = LiftOff::new(self.cell.probe_arm(), LIFT_M, speed_m_s).map_err(ReplayError::from)?;
        let state = self.ask_at_rest(STEP, "lift")?;
        self.guard
            .confirm_to_lift(&state)
            .map_err(|trip| SessionError::Ended { step: STEP, why: trip.to_string() })?;
        let exam = self.exam.as_ref().ok_or(SessionError::Order("the exam was not begun"))?;
        let (arm, facts) = (&mut *self.cell.arm, &self.cell.facts);
        let moving = Motion { step: STEP, arm, exam, facts, stand: &stand, punctual: self.punctual.as_mut() };
        motion::perform(moving, &mut lift, &mut self.guard, &mut ())
    }
}
