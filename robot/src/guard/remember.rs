use probepath_frames::{Base, Pose, Probe, Wrench};

use super::GuardLimits;
use crate::{ContactWatch, Pressure, Safety, State};

/// What a motion may do that others may not, or the other way round, since the last confirmation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// The largest force (N) that is tolerated now: the hard limit, or more while the probe is lifted out of too much
    /// force; it follows the force down and never rises.
    pub force_n: f64,
    /// The fastest that the probe may be commanded (m/s): little after a confirmation, e times more every second of
    /// motion that is commanded. A hand that leads an arm which gives way by its own means is no command: it is held to
    /// the usual limits, and the pace waits for what is commanded after it.
    pub speed_m_s: f64,
}

/// How much more force (N) than now is tolerated while lifting out of too much of it: noise and the skin's rebound.
const WHILE_LIFTING: f64 = 1.0;
/// Whoever keeps to the pace after a confirmation keeps to it to some percent, and looks at it every some ticks.
const PACE_MARGIN: f64 = 1.1;
/// Faster than this (m/s) the pace no longer matters.
const PACE_OVER: f64 = 1.0;

impl Allowance {
    /// What every motion may do.
    pub(super) const fn usual(limits: &GuardLimits) -> Self {
        Self { force_n: limits.force_hard_n, speed_m_s: f64::INFINITY }
    }

    /// After a confirmation: slowly at first.
    pub(super) const fn confirmed(limits: &GuardLimits) -> Self {
        Self { speed_m_s: limits.resume_speed_m_s * PACE_MARGIN, ..Self::usual(limits) }
    }

    /// After a confirmation to lift: the force may be high, but only fall.
    pub(super) const fn lifting(limits: &GuardLimits, force_n: f64) -> Self {
        let usual = Self::usual(limits);
        Self { force_n: usual.force_n.max(force_n + WHILE_LIFTING), ..usual }
    }

    /// Other limits: a confirmation to lift stays one.
    pub(super) const fn change(&mut self, before: &GuardLimits, now: &GuardLimits) {
        if self.force_n <= before.force_hard_n {
            self.force_n = now.force_hard_n;
        }
    }

    /// A tick later; `free` when the arm gave way to the hand by its own means.
    fn after(self, force_n: f64, dt: f64, limits: &GuardLimits, free: bool) -> Self {
        let speed = self.speed_m_s * if free { 1.0 } else { 1.0 + dt };
        Self {
            force_n: limits.force_hard_n.max(self.force_n.min(force_n + WHILE_LIFTING)),
            speed_m_s: if speed > PACE_OVER { f64::INFINITY } else { speed },
        }
    }
}

/// What the guard remembers of a running motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watch {
    pub(super) allowance: Allowance,
    pub(super) last: State,
    /// Where the probe was commanded last; measured, while the arm gives way to the hand.
    pub(super) probe: Option<Pose<Base, Probe>>,
    /// Nanoseconds since the state was last new.
    pub(super) stale_ns: i64,
    /// Ticks in a row with the same wrench, to the last bit.
    pub(super) same_wrench: u32,
    /// Whether the wrench has ever changed: an arm without a sensor reads zero for ever, and is no hazard by that.
    pub(super) wrench_lives: bool,
    /// How long the arm has been in reduced mode (s).
    pub(super) reduced_s: Option<f64>,
    /// Smooths the wrench.
    contact: Option<ContactWatch>,
    /// How the face lies on the skin now.
    pub(super) pressure: Option<Pressure>,
}

impl Watch {
    pub(super) fn new(
        allowance: Allowance,
        state: &State,
        probe: Option<Pose<Base, Probe>>,
        contact: Option<ContactWatch>,
    ) -> Self {
        Self {
            allowance,
            last: *state,
            probe,
            stale_ns: 0,
            same_wrench: 0,
            wrench_lives: state.wrench != Wrench::zero(),
            reduced_s: (state.safety == Safety::Reduced).then_some(f64::INFINITY),
            contact,
            pressure: None,
        }
    }

    /// Takes in the next state.
    pub(super) fn see(&mut self, state: &State, dt: f64, limits: &GuardLimits, free: bool) {
        let new = state.tick != self.last.tick && state.stamp > self.last.stamp;
        self.stale_ns = if new { 0 } else { self.stale_ns + (dt * 1e9) as i64 };
        let same = state.wrench == self.last.wrench;
        self.same_wrench = if same { self.same_wrench.saturating_add(1) } else { 0 };
        self.wrench_lives |= !same;
        self.reduced_s = (state.safety == Safety::Reduced).then(|| self.reduced_s.unwrap_or(0.0) + dt);
        self.allowance = self.allowance.after(state.wrench.force.norm(), dt, limits, free);
        self.pressure = self.contact.as_mut().map(|contact| contact.step(&state.wrench));
        self.last = *state;
    }
}
