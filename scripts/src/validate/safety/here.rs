//! What stops a scan in this process: the operator's word, lost contact, too much force. The simulated cell, and an arm
//! between it and the loop that spoils what it is told to.

use std::path::Path as FilePath;
use std::sync::Arc;

use probepath_frames::{Span, Stamp, Wrench};
use probepath_robot::motion::timing::PathSpeed;
use probepath_robot::{
    Arm, ArmFault, Command, Face, Guard, GuardLimits, Joints, Observer, Operator, RunError, State, Tick,
    Wish, run,
};
use probepath_sim::SimulatedCell;
use probepath_teach_replay::{
    LiftOff, Path, Plan, PlanSettings, ProbeArm, Replay, ReplayPhase, ReplaySettings, ReplayWatch,
};

use crate::progress::Progress;
use crate::protocol::Protocol;
use crate::session::{CellFile, Opening, Session, SessionError, TeachWish};
use crate::validate::{Goal, ValidateError};

/// How far along the path it happens (m).
const HAPPENS_AT_M: f64 = 0.02;
/// How far the probe is lifted off (m).
const LIFT_M: f64 = 0.04;

/// When, where the joints were commanded to be, and whether the probe was being lifted off.
type Row = (Stamp, Joints, bool);

/// Spoils a state.
pub(super) type Spoil = fn(&mut State, u64);

/// An arm whose states are spoiled from an instant on; ticks are counted from there.
pub(super) struct Spoiled<'a> {
    arm: &'a mut dyn Arm,
    pub(super) spoil: Option<Spoil>,
    ticks: u64,
}

impl Arm for Spoiled<'_> {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let mut state = self.arm.exchange(command)?;
        if let Some(spoil) = self.spoil {
            spoil(&mut state, self.ticks);
            self.ticks += 1;
        }
        Ok(state)
    }

    fn period(&self) -> Span {
        self.arm.period()
    }

    fn joints(&self) -> usize {
        self.arm.joints()
    }
}

/// A scan at 20 mm/s and 5 N, on its way.
pub(super) struct Scene {
    cell: SimulatedCell,
    arm: ProbeArm,
    path: Path,
    operator: Operator,
}

/// How a scan ended, and when.
pub(super) struct Ended {
    /// Why, when it was a fault.
    pub(super) fault: Option<Box<RunError>>,
    /// From what happened to the last change of a command (ms).
    pub(super) rest_ms: f64,
    /// From what happened to the instant from which the probe truly stays within 0.05 mm (ms).
    pub(super) true_rest_ms: f64,
    /// From what happened to the replay's decision to lift off (ms).
    pub(super) retracts_ms: f64,
    /// From what happened to the deepest command: from there on the probe retracts (ms).
    pub(super) turns_ms: f64,
    last: State,
    guard: Guard,
}

impl Scene {
    /// Taught by the cell's hand.
    pub(super) fn new(seed: u64, folder: &FilePath) -> Result<Self, SessionError> {
        let mut file = CellFile::default();
        file.simulated.hand.length_mm = 60.0;
        let mut session = Session::open(Opening {
            cell: file.clone(),
            seed,
            out: folder.join("here"),
            protocol: Protocol { name: "validate".into(), text: String::new() },
            date: None,
            operator: Operator::new(),
            progress: Arc::new(()),
        })?;
        let kept = folder.join(format!("here-{seed}.path.toml"));
        if !kept.exists() {
            let wish = TeachWish { study: "VALIDATE".into(), ..TeachWish::default() };
            session.teach(&wish)?.save(&kept)?;
        }
        let path = Path::load(&kept)?;
        let cell = SimulatedCell::new(&file.simulated, seed)?;
        let arm = ProbeArm {
            model: cell.nominal().model().clone(),
            flange_from_probe: cell.nominal().flange_from_probe,
            limits: *session.motion_limits(),
            period: cell.arm().period(),
        };
        Ok(Self { cell, arm, path, operator: Operator::new() })
    }

    /// Scans until something happens 20 mm along the path: the operator's word, or a spoiled state.
    pub(super) fn until(&self, spoil: Option<Spoil>) -> Result<Ended, SessionError> {
        let mut arm = self.cell.arm();
        let state = arm.exchange(&Command::Stay).map_err(|fault| ended(fault.to_string()))?;
        let speed = PathSpeed::gentle(0.020);
        let settings = PlanSettings { speed, ..PlanSettings::default() };
        let plan = Plan::new(&self.path, &self.arm, &state.commanded, &settings)?;
        let mut replay = Replay::new(plan, ReplaySettings::default(), self.operator.clone())?;
        let watch = replay.watch();
        let mut guard = self.guard()?;
        let happening = std::cell::Cell::new(None);
        let mut spoiled = Happens {
            arm: Spoiled { arm: &mut arm, spoil: None, ticks: 0 },
            watch: &watch,
            spoil,
            happening: &happening,
        };
        let mut rows: Vec<Row> = Vec::new();
        let mut observer = |tick: &Tick| {
            if spoil.is_none() && happening.get().is_none() && is_there(&watch) {
                happening.set(Some(tick.state.stamp));
                self.operator.stop();
            }
            let lifts = watch.status().phase == ReplayPhase::Lift;
            rows.push((tick.state.stamp, tick.state.commanded, lifts));
            Wish::GoOn
        };
        let done = run(&mut spoiled, &mut replay, &mut guard, &mut observer as &mut dyn Observer);
        self.operator.allow();
        let happened = happening.get().ok_or_else(|| ended("nothing happened".into()))?;
        let last = match &done {
            Ok(finished) => finished.last,
            Err(error) => error.last.ok_or_else(|| ended(error.to_string()))?,
        };
        Ok(self.ended(done.err(), happened, &rows, last, guard))
    }

    fn guard(&self) -> Result<Guard, SessionError> {
        let guard = Guard::new(GuardLimits::default(), self.arm.limits).map_err(|e| ended(e.to_string()))?;
        Ok(guard.pressing_with(Face::default()).listening_to(self.operator.clone()))
    }

    fn ended(
        &self,
        fault: Option<Box<RunError>>,
        happened: Stamp,
        rows: &[Row],
        last: State,
        guard: Guard,
    ) -> Ended {
        let ms = |stamp: Stamp| (stamp - happened).seconds() * 1e3;
        let changed = rows.windows(2).rfind(|pair| pair[0].1 != pair[1].1);
        let rest_ms = changed.map_or(f64::NAN, |pair| ms(pair[1].0).max(0.0));
        let moments = self.cell.truth().moments();
        let stays = moments.last().map(|moment| moment.world_from_probe.origin());
        let moving = moments.iter().rev().find(|moment| {
            stays.is_some_and(|stays| moment.world_from_probe.origin().distance(&stays) > 5e-5)
        });
        let true_rest_ms = moving.map_or(f64::NAN, |moment| ms(moment.stamp).max(0.0));
        let height = |joints: &Joints| self.arm.probe(joints);
        let at = rows.iter().rev().find(|row| row.0 <= happened).map(|row| height(&row.1));
        let lifts = rows.iter().find(|row| row.0 > happened && row.2);
        let retracts_ms = lifts.map_or(f64::NAN, |row| ms(row.0));
        let depth = |row: &Row| {
            at.map_or(f64::NAN, |at| (at.inverse() * height(&row.1)).isometry().translation.vector.z)
        };
        let after = rows.iter().filter(|row| row.0 > happened);
        let deepest = after.max_by(|a, b| depth(a).total_cmp(&depth(b)));
        let turns_ms = deepest.map_or(f64::NAN, |row| ms(row.0));
        Ended { fault, rest_ms, true_rest_ms, retracts_ms, turns_ms, last, guard }
    }

    /// Lifts off after too much force; how much of the way is missing (mm).
    fn lifted(&self, mut ended_by: Ended) -> Result<f64, SessionError> {
        let mut arm = self.cell.arm();
        let state = arm.exchange(&Command::Stay).map_err(|fault| ended(fault.to_string()))?;
        ended_by.guard.confirm_to_lift(&state).map_err(|trip| ended(trip.to_string()))?;
        let mut lift = LiftOff::new(self.arm.clone(), LIFT_M, 0.02)
            .map_err(probepath_teach_replay::ReplayError::from)?;
        let done =
            run(&mut arm, &mut lift, &mut ended_by.guard, &mut ()).map_err(|e| ended(e.to_string()))?;
        let (from, to) = (self.arm.probe(&ended_by.last.commanded), self.arm.probe(&done.last.commanded));
        let way = (from.inverse() * to).isometry().translation.vector;
        Ok((LIFT_M + way.z) * 1e3)
    }
}

/// Spoils the states from the instant on at which the replay is there.
struct Happens<'a> {
    arm: Spoiled<'a>,
    watch: &'a ReplayWatch,
    spoil: Option<Spoil>,
    happening: &'a std::cell::Cell<Option<Stamp>>,
}

impl Arm for Happens<'_> {
    fn exchange(&mut self, command: &Command) -> Result<State, ArmFault> {
        let begins = self.arm.spoil.is_none() && self.spoil.is_some() && is_there(self.watch);
        if begins {
            self.arm.spoil = self.spoil;
        }
        let state = self.arm.exchange(command)?;
        if begins {
            self.happening.set(Some(state.stamp));
        }
        Ok(state)
    }

    fn period(&self) -> Span {
        self.arm.period()
    }

    fn joints(&self) -> usize {
        self.arm.joints()
    }
}

fn is_there(watch: &ReplayWatch) -> bool {
    let status = watch.status();
    status.phase == ReplayPhase::Follow && status.at_m > HAPPENS_AT_M
}

fn ended(why: String) -> SessionError {
    SessionError::Ended { step: "validating safety", why }
}

/// The rows of a scan that is stopped in this process.
pub(super) fn rows(
    seeds: u64,
    folder: &FilePath,
    progress: &dyn Progress,
) -> Result<Vec<Goal>, ValidateError> {
    let mut columns: [Vec<f64>; 6] = Default::default();
    for seed in 1..=seeds {
        super::tell(progress, "safety", 0, seeds);
        let wrong = |source| ValidateError::Session { seed, source };
        let scene = || Scene::new(seed, folder).map_err(wrong);
        let word = scene()?.until(None).map_err(wrong)?;
        let lost = scene()?.until(Some(|state, _| state.wrench = noise(state))).map_err(wrong)?;
        let pressed = scene()?;
        let hard = pressed.until(Some(|state, _| state.wrench.force.z -= 20.0)).map_err(wrong)?;
        let (stopped, hard_ms) = (hard.fault.is_some(), hard.rest_ms);
        let missing_mm = pressed.lifted(hard).map_err(wrong)?;
        let hard_ms = if stopped { hard_ms } else { f64::NAN };
        let found = [word.rest_ms, word.true_rest_ms, lost.retracts_ms, lost.turns_ms, hard_ms, missing_mm];
        for (column, value) in columns.iter_mut().zip(found) {
            column.push(value);
        }
    }
    let [word, true_word, retract, turns, hard, missing] = &columns;
    Ok(vec![
        Goal::of("operator's word at 20 mm/s: commands at rest, ms", word, Some(100.0), None),
        Goal::of("operator's word at 20 mm/s: probe at rest, ms", true_word, Some(100.0), None),
        Goal::of("contact lost: lifting off begins, ms", retract, Some(50.0), None),
        Goal::of("contact lost: the probe has turned back, ms", turns, None, None),
        Goal::of("force above the hard limit: at rest, ms", hard, Some(100.0), None),
        Goal::of("force above the hard limit: short of lifted, mm", missing, Some(1.0), None),
    ])
}

/// The sensor's noise alone, as in the air.
fn noise(state: &State) -> Wrench<probepath_frames::Probe> {
    let small = state.wrench.force * 0.01;
    Wrench::new(small, state.wrench.torque * 0.01)
}
