//! [`HandGuide`]: the arm gives way to the hand.

mod give_way;

use probepath_robot::step::{Binding, StepError, StepSettings, Stepper};
use probepath_robot::{Command, Controller, Joints, State, Workspace};
use thiserror::Error;

use crate::ProbeArm;
pub use give_way::GiveWay;
use give_way::Motion;

/// A hand guiding that cannot begin.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GuideError {
    /// A setting that cannot be.
    #[error("{name} = {value} cannot be: it has to be finite and above zero")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The arm's limits cannot be kept, or a step cannot be made with it.
    #[error("{0}")]
    Step(#[from] StepError),
    /// The start has a number that is not finite, or a wrong number of joints.
    #[error("hand guiding cannot start from {found} joints, the arm has {joints}, all finite")]
    Start {
        /// How many came.
        found: usize,
        /// How many were wanted.
        joints: usize,
    },
}

/// Where hand guiding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Waiting { ticks: u32 },
    Guiding,
    Braking,
}

/// Gives way to hand and skin while the operator holds the switch.
///
/// ```text
///            switch held             switch let go             at rest
///  Waiting ──────────────▶ Guiding ─────────────────▶ Braking ─────────▶ end
///     │ nobody holds it for too long                                      ▲
///     └───────────────────────────────────────────────────────────────────┘
/// ```
///
/// The wrench, less a dead band, becomes a velocity of the probe through a mass and a damper in every direction of
/// the probe (admittance); it is bounded, and the [`Stepper`] turns it into joint steps: as nearly the velocity as the
/// joints' limits, the workspace's planes and the distance to singularities allow, so that the probe slides along what
/// it must not cross.
#[derive(Clone, Debug)]
pub struct HandGuide {
    arm: ProbeArm,
    settings: GiveWay,
    stepper: Stepper,
    held_by: Option<Binding>,
    motion: Motion,
    stage: Stage,
    /// The most that the probe is led at (m/s): little after a confirmation, then e times as much each second.
    pace: f64,
    dt: f64,
}

/// After a confirmation the probe is led no faster at first (m/s): less than the guard's 10 mm/s, as joints that lag one
/// behind the other may add some.
const RESUMED_M_S: f64 = 0.0075;

impl HandGuide {
    /// Hand guiding from the commanded joints `start`, at rest.
    ///
    /// # Errors
    /// When a setting is not above zero, or limits and start do not fit the arm.
    pub fn new(arm: ProbeArm, start: &Joints, settings: GiveWay) -> Result<Self, GuideError> {
        settings.check()?;
        if start.len() != arm.model.joints() || !start.is_finite() {
            return Err(GuideError::Start { found: start.len(), joints: arm.model.joints() });
        }
        let stepper = stepper(&arm, &settings, *start, Workspace::new())?;
        let dt = arm.period.seconds();
        let stage = Stage::Waiting { ticks: 0 };
        let motion = Motion::at_rest(dt);
        Ok(Self { arm, settings, stepper, held_by: None, motion, stage, pace: f64::INFINITY, dt })
    }

    /// The same, before it begins, the probe led nowhere outside of `workspace`.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn within(mut self, workspace: Workspace) -> Result<Self, GuideError> {
        self.stepper = stepper(&self.arm, &self.settings, *self.stepper.limiter().position(), workspace)?;
        Ok(self)
    }

    /// The same, slow at first, then e times faster every second. After a stop.
    #[must_use]
    pub const fn slowly(mut self) -> Self {
        self.pace = RESUMED_M_S;
        self
    }

    /// The limit that the hand pushes against now.
    pub const fn held_by(&self) -> Option<Binding> {
        self.held_by
    }

    /// Whether the hand leads now.
    pub fn is_guiding(&self) -> bool {
        self.stage == Stage::Guiding
    }

    fn wait(&mut self, ticks: u32) -> Option<Joints> {
        let waited = f64::from(ticks) * self.dt;
        if waited > self.settings.wait_s {
            return None;
        }
        self.stage = Stage::Waiting { ticks: ticks + 1 };
        Some(*self.stepper.limiter().position())
    }

    fn guide(&mut self, state: &State) -> Option<Joints> {
        let settings = GiveWay { speed_m_s: self.settings.speed_m_s.min(self.pace), ..self.settings };
        self.motion.feel(&settings, &state.wrench);
        let base_from_probe = self.arm.probe(self.stepper.limiter().position());
        let (twist, freedom) = self.motion.twist(&settings, &base_from_probe);
        // Not finite: the step refuses it; the arm comes to rest where it is.
        match self.stepper.lead(&twist, freedom) {
            Ok(stepped) => {
                self.held_by = stepped.binding;
                Some(stepped.position)
            }
            Err(_) => Some(self.stepper.brake()),
        }
    }

    fn brake(&mut self) -> Option<Joints> {
        if self.stepper.limiter().is_at_rest() {
            return None;
        }
        Some(self.stepper.brake())
    }
}

/// Steps the arm from rest at `start`, within a part of its limits.
fn stepper(
    arm: &ProbeArm,
    settings: &GiveWay,
    start: Joints,
    workspace: Workspace,
) -> Result<Stepper, StepError> {
    let step = StepSettings { workspace, least_singular: settings.least_singular, ..StepSettings::default() };
    let limits = arm.limits.scaled(give_way::SHARE);
    Stepper::at_rest(arm.model.clone(), arm.flange_from_probe, limits, arm.period, start, step)
}

impl Controller for HandGuide {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.stage = match self.stage {
            Stage::Waiting { .. } if state.guiding => Stage::Guiding,
            Stage::Guiding if !state.guiding => Stage::Braking,
            other => other,
        };
        self.pace *= 1.0 + self.dt;
        let joints = match self.stage {
            Stage::Waiting { ticks } => self.wait(ticks),
            Stage::Guiding => self.guide(state),
            Stage::Braking => self.brake(),
        };
        joints.map(Command::Position)
    }
}

#[cfg(test)]
mod tests;
