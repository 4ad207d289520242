//! Going on after a stop.

use super::{Allowance, Guard, Phase, Trip};
use crate::State;

/// A joint that is measured slower than this rests (rad/s, m/s): noise of a velocity.
const AT_REST: f64 = 0.02;

impl Guard {
    /// A fresh confirmation after a stop, by a person, on a state that was just measured. The probe is slow at first
    /// from here.
    ///
    /// # Errors
    /// When the state is not fit to move from, the arm still moves, the skin presses harder than the soft limit (lift
    /// first), or the state is no newer than the last one of the motion that was stopped.
    pub fn confirm(&mut self, fresh: &State) -> Result<(), Trip> {
        let force_n = fresh.wrench.force.norm();
        if force_n > self.limits.force_soft_n {
            return Err(Trip::Force { force_n, limit_n: self.limits.force_soft_n });
        }
        self.ready(fresh)?;
        self.phase = Phase::Armed(Allowance::confirmed(&self.limits));
        Ok(())
    }

    /// A fresh confirmation to lift the probe out of too much force: as [`confirm`](Self::confirm), but the force may
    /// still be high. It may only fall from here: the tolerance follows it down.
    ///
    /// # Errors
    /// When the state is not fit to move from for another reason.
    pub fn confirm_to_lift(&mut self, fresh: &State) -> Result<(), Trip> {
        self.ready(fresh)?;
        let force_n = fresh.wrench.force.norm();
        self.phase = Phase::Armed(Allowance::lifting(&self.limits, force_n));
        Ok(())
    }

    /// Whether this state, measured after the stop, is one to start from.
    fn ready(&self, fresh: &State) -> Result<(), Trip> {
        if self.stopped_at == Some(fresh.stamp) {
            return Err(Trip::NotFresh);
        }
        self.fit(fresh)?;
        let moving = fresh.velocity.iter().enumerate().find(|(_, velocity)| velocity.abs() > AT_REST);
        moving.map_or(Ok(()), |(joint, velocity)| Err(Trip::Moving { joint, velocity }))
    }
}
