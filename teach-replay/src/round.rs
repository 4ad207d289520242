//! [`Round`]: a round of stops in free air or water, from rest to rest, nothing touched.

mod status;

use probepath_frames::{Base, Pose, Probe};
use probepath_robot::{Asked, Command, Controller, InverseOptions, Joints, Operator, Safety, State};

use crate::plan::{Leg, legs, outside, too_near_to_a_limit};
use crate::{Place, PlanError, PlanSettings, ProbeArm, Refusal};
use status::Board;
pub use status::{RoundPhase, RoundStatus, RoundWatch};

/// The most that a joint may be away from the posture that a round is planned around (rad, m): another way of bending
/// the arm would swing it through whatever stands there.
const OTHER_POSTURE: f64 = 2.0;
/// A start further from the plan's than this (rad, m) is another start.
const START_WITHIN: f64 = 1e-6;
/// After a pause the probe moves at this speed (m/s), then e times faster every second.
const RESUMED_M_S: f64 = 0.010;

/// One stop of a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Where.
    pub base_from_probe: Pose<Base, Probe>,
    /// The fastest that the probe goes on the way there (m/s), to two percent: it is looked at every 20 ms.
    pub speed_m_s: f64,
    /// Whether what is seen on the way there counts.
    pub look_on_the_way: bool,
    /// How long it rests there before what is seen counts (s).
    pub settle_s: f64,
    /// How long it rests there while what is seen counts (s).
    pub look_s: f64,
}

/// One stop with the way there.
#[derive(Clone, Debug)]
struct Planned {
    stop: Stop,
    legs: Vec<Leg>,
    joints: Joints,
}

/// Where a round is.
#[derive(Clone, Copy, Debug)]
enum Stage {
    Going { stop: usize, leg: usize },
    Resting { stop: usize, ticks: u64 },
    Done,
}

/// Goes from stop to stop and rests at each: the probe in free air or in water, nothing pressed.
///
/// ```text
///  Going ──▶ Resting ──▶ Going ──▶ … ──▶ Done
///  to the    as long as
///  next      the stop says
/// ```
///
/// A pause slows the motion down to rest; a resume is slow at first. A stop is the loop's: it brakes.
#[derive(Clone, Debug)]
pub struct Round {
    stops: Vec<Planned>,
    start: Joints,
    stage: Stage,
    begun: bool,
    last: Joints,
    operator: Operator,
    /// The fastest that the probe goes (m/s): little after a pause.
    pace: f64,
    dt: f64,
    board: Board,
}

impl ProbeArm {
    /// The joints that put the probe there, bent as at `near`: inside the workspace, away from the joints' limits and
    /// from singularities.
    ///
    /// # Errors
    /// Why not.
    pub fn posture(
        &self,
        base_from_probe: &Pose<Base, Probe>,
        near: &Joints,
        settings: &PlanSettings,
    ) -> Result<Joints, Refusal> {
        if let Some((plane, beyond)) = outside(&settings.workspace, &base_from_probe.origin()) {
            return Err(Refusal::Workspace { plane, beyond_mm: beyond * 1e3 });
        }
        // No restarts: they find the arm bent otherwise.
        let options = InverseOptions { restarts: 0, ..InverseOptions::default() };
        let joints = self
            .model
            .inverse(base_from_probe, &self.flange_from_probe, near, &options)
            .map_err(Refusal::Unreachable)?;
        let away = near.zip(&joints, |a, b| a - b).largest();
        if away > OTHER_POSTURE {
            return Err(Refusal::OtherPosture { away });
        }
        if let Some((joint, left)) = too_near_to_a_limit(self, &joints, settings.joint_margin) {
            return Err(Refusal::JointLimit { joint, left, least: settings.joint_margin });
        }
        let found = self.distance_to_singularity(&joints);
        if found < settings.least_singular {
            return Err(Refusal::Singular { found, least: settings.least_singular });
        }
        Ok(joints)
    }
}

impl Round {
    /// Plans a round from the commanded joints `start`; every stop is reached with the arm bent as at `near`. The way
    /// to the first leads up, over and down, to the others straight, or up, over and down where that would leave the
    /// workspace. Only what `settings` says of the air, the workspace and the joints' margins counts.
    ///
    /// # Errors
    /// With the stop, counted from 1, and the reason: nothing is moved then.
    pub fn new(
        stops: &[Stop],
        arm: &ProbeArm,
        (start, near): (&Joints, &Joints),
        settings: &PlanSettings,
        operator: Operator,
    ) -> Result<Self, PlanError> {
        let mut planned: Vec<Planned> = Vec::with_capacity(stops.len());
        for (i, stop) in stops.iter().enumerate() {
            let place = Place::Stop { stop: i + 1 };
            let slow = PlanSettings { air_speed: stop.speed_m_s, ..settings.clone() };
            let joints = arm
                .posture(&stop.base_from_probe, near, settings)
                .map_err(|refusal| PlanError { place, refusal })?;
            let from = planned.last().map_or(start, |before| &before.joints);
            let legs = match planned.last() {
                None => legs(arm, &slow, from, &joints),
                Some(_) => straight(arm, &slow, from, &joints, place),
            };
            planned.push(Planned { stop: *stop, legs: legs.map_err(|e| PlanError { place, ..e })?, joints });
        }
        Ok(Self {
            stage: Stage::Going { stop: 0, leg: 0 },
            start: *start,
            last: *start,
            begun: false,
            pace: f64::INFINITY,
            dt: arm.period.seconds(),
            board: Board::new(planned.len()),
            stops: planned,
            operator,
        })
    }

    /// The same, slow at first: at 10 mm/s, then e times faster every second. After a stop.
    #[must_use]
    pub const fn slowly(mut self) -> Self {
        self.pace = RESUMED_M_S;
        self
    }

    /// A handle that says where it is, while the loop holds the round itself.
    pub fn watch(&self) -> RoundWatch {
        self.board.watch()
    }

    /// How long it takes (s), without pauses.
    pub fn duration_s(&self) -> f64 {
        let of = |planned: &Planned| {
            planned.stop.settle_s
                + planned.stop.look_s
                + planned.legs.iter().map(Leg::duration_s).sum::<f64>()
        };
        self.stops.iter().map(of).sum()
    }

    fn advance(&mut self, pause: bool) -> Option<Joints> {
        loop {
            match self.stage {
                Stage::Done => return None,
                Stage::Going { stop, leg } => match self.go(stop, leg, pause) {
                    Some(joints) => return Some(joints),
                    None => self.stage = self.after(stop, leg),
                },
                Stage::Resting { stop, ticks: 0 } => self.stage = self.next(stop),
                Stage::Resting { stop, ticks } => {
                    let ticks = if pause { ticks } else { ticks - 1 };
                    self.stage = Stage::Resting { stop, ticks };
                    return Some(self.last);
                }
            }
        }
    }

    /// The next joints of a leg; none when it is done.
    fn go(&mut self, stop: usize, leg: usize, pause: bool) -> Option<Joints> {
        let (pace, dt) = (self.pace, self.dt);
        let planned = self.stops.get_mut(stop)?;
        let share = if pause { 0.0 } else { pace / planned.stop.speed_m_s };
        planned.legs.get_mut(leg)?.step(share, dt)
    }

    /// What follows a leg: the next one, or the rest, which begins where the leg was to end.
    fn after(&mut self, stop: usize, leg: usize) -> Stage {
        let Some(planned) = self.stops.get(stop) else { return Stage::Done };
        if leg + 1 < planned.legs.len() {
            return Stage::Going { stop, leg: leg + 1 };
        }
        self.last = planned.joints;
        // The limiter wants the target thrice to be at rest.
        let rest_s = planned.stop.settle_s + planned.stop.look_s;
        Stage::Resting { stop, ticks: 3 + (rest_s / self.dt).round() as u64 }
    }

    const fn next(&self, stop: usize) -> Stage {
        if stop + 1 < self.stops.len() { Stage::Going { stop: stop + 1, leg: 0 } } else { Stage::Done }
    }

    fn tell(&self) {
        let stop_of = |stop: usize| self.stops.get(stop).map(|planned| planned.stop);
        let looks = |stop: usize, ticks: u64| {
            stop_of(stop).is_some_and(|s| s.look_s > 0.0 && ticks as f64 * self.dt <= s.look_s)
        };
        let (phase, stop) = match self.stage {
            Stage::Going { stop, .. } if stop_of(stop).is_some_and(|s| s.look_on_the_way) => {
                (RoundPhase::Sweeping, stop)
            }
            Stage::Resting { stop, ticks } if looks(stop, ticks) => (RoundPhase::Looking, stop),
            Stage::Going { stop, .. } | Stage::Resting { stop, .. } => (RoundPhase::Going, stop),
            Stage::Done => (RoundPhase::Done, self.stops.len()),
        };
        self.board.write(phase, stop);
    }
}

impl Controller for Round {
    fn step(&mut self, state: &State) -> Option<Command> {
        if !self.begun {
            self.begun = true;
            if self.start.zip(&state.commanded, |a, b| a - b).largest() > START_WITHIN {
                self.board.write(RoundPhase::StartMoved, 0);
                return None;
            }
        }
        let pause = self.operator.wish() == Asked::Pause;
        let slow = pause || state.safety == Safety::Reduced;
        self.pace = if slow { RESUMED_M_S } else { self.pace * (1.0 + self.dt) };
        let next = self.advance(pause);
        self.tell();
        next.map(|joints| {
            self.last = joints;
            Command::Position(joints)
        })
    }
}

/// Straight in joint space; up, over and down where that leaves the workspace.
fn straight(
    arm: &ProbeArm,
    settings: &PlanSettings,
    from: &Joints,
    to: &Joints,
    place: Place,
) -> Result<Vec<Leg>, PlanError> {
    if from.zip(to, |a, b| a - b).largest() < START_WITHIN {
        return Ok(Vec::new());
    }
    match Leg::new(arm, from, to, settings, place) {
        Ok(leg) => Ok(vec![leg]),
        Err(PlanError { refusal: Refusal::Workspace { .. }, .. }) => legs(arm, settings, from, to),
        Err(other) => Err(other),
    }
}

#[cfg(test)]
mod tests;
