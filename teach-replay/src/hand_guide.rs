//! [`HandGuide`]: the arm gives way to the hand.

mod give_way;

use probepath_robot::{Command, Controller, Joints, Limiter, LimitsError, State};
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
    /// The arm's limits cannot be kept.
    #[error("{0}")]
    Limits(#[from] LimitsError),
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
/// the probe (admittance); it is bounded, turned into joint velocities by damped least squares, slowed down toward
/// singularities, and kept within every joint's position, velocity, acceleration and jerk by the same limiter that has
/// the last word in the loop.
#[derive(Clone, Debug)]
pub struct HandGuide {
    arm: ProbeArm,
    settings: GiveWay,
    limiter: Limiter,
    motion: Motion,
    stage: Stage,
    dt: f64,
}

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
        let limiter = Limiter::at_rest(arm.limits.scaled(give_way::SHARE), arm.period, *start)?;
        let dt = arm.period.seconds();
        let stage = Stage::Waiting { ticks: 0 };
        let motion = Motion::at_rest(dt);
        Ok(Self { arm, settings, limiter, motion, stage, dt })
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
        Some(*self.limiter.position())
    }

    fn guide(&mut self, state: &State) -> Option<Joints> {
        self.motion.feel(&self.settings, &state.wrench);
        let here = *self.limiter.position();
        let velocity = self.motion.joint_velocity(&self.arm, &self.settings, &here);
        let wanted = here.zip(&velocity, |q, v| q + v * self.dt);
        // Not finite: the limiter refuses it; the arm comes to rest where it is.
        match self.limiter.limit(&wanted) {
            Ok(limited) => Some(limited.position),
            Err(_) => Some(self.limiter.brake()),
        }
    }

    fn brake(&mut self) -> Option<Joints> {
        if self.limiter.is_at_rest() {
            return None;
        }
        Some(self.limiter.brake())
    }
}

impl Controller for HandGuide {
    fn step(&mut self, state: &State) -> Option<Command> {
        self.stage = match self.stage {
            Stage::Waiting { .. } if state.guiding => Stage::Guiding,
            Stage::Guiding if !state.guiding => Stage::Braking,
            other => other,
        };
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
