//! The questions the guard asks at every tick; none of them changes anything but what it remembers of the probe.

use super::{Guard, Phase, Trip};
use crate::{Joints, State};

impl Guard {
    /// The commanded place of the probe: no faster than allowed, and from where a brake ends inside the workspace. As
    /// the tick before passed the same question, the brake that follows a trip ends inside too. A probe found outside
    /// may come back, but go no further out.
    pub(super) fn judge_place(
        &mut self,
        position: &Joints,
        brakes_at: impl Fn() -> Joints,
        dt: f64,
    ) -> Option<Trip> {
        let (Some(place), Phase::Running(watch)) = (&self.probe, &mut self.phase) else {
            return None;
        };
        let probe = place(position);
        let before = watch.probe.replace(probe).unwrap_or(probe);
        let speed_m_s = before.distance(&probe) / dt;
        let limit_m_s = self.limits.speed_m_s(-watch.last.wrench.force.z);
        if speed_m_s > limit_m_s {
            return Some(Trip::ProbeSpeed { speed_m_s, limit_m_s });
        }
        if self.workspace.planes().is_empty() {
            return None;
        }
        let rest = place(&brakes_at());
        self.workspace.crossed(&rest, &before).map(|(plane, beyond_m)| Trip::Workspace { plane, beyond_m })
    }

    pub(super) fn late(&self, last: &State, state: &State, stale_ns: i64) -> Result<(), Trip> {
        let heartbeat = self.limits.heartbeat.nanoseconds();
        if stale_ns > heartbeat {
            return Err(Trip::OldData { age_s: stale_ns as f64 * 1e-9 });
        }
        let gap = (state.stamp - last.stamp).nanoseconds();
        if gap > heartbeat {
            return Err(Trip::LateTick {
                gap_s: gap as f64 * 1e-9,
                missed: state.tick.saturating_sub(last.tick + 1),
            });
        }
        if gap < 0 || state.tick < last.tick {
            return Err(Trip::BackInTime { tick: state.tick, after: last.tick });
        }
        Ok(())
    }

    /// Whether a state is fit to move from.
    pub(super) fn fit(&self, state: &State) -> Result<(), Trip> {
        self.unfit(state).map_or(Ok(()), Err)
    }

    /// What is wrong with a state by itself.
    pub(super) fn unfit(&self, state: &State) -> Option<Trip> {
        let joints = self.motion.joints();
        let lists = [&state.position, &state.velocity, &state.commanded];
        if lists.iter().any(|list| list.len() != joints || !list.is_finite()) {
            return Some(Trip::ImplausibleState);
        }
        let (force, torque) = (state.wrench.force.norm(), state.wrench.torque.norm());
        // NaN compares as nothing, so plausible is what has to be shown.
        if !(force <= self.limits.force_plausible_n && torque <= self.limits.torque_plausible_n_m) {
            return Some(Trip::ImplausibleWrench { force_n: force, torque_n_m: torque });
        }
        (0..joints).find_map(|joint| self.unfit_joint(state, joint))
    }

    fn unfit_joint(&self, state: &State, joint: usize) -> Option<Trip> {
        let (at, limits) = (state.position[joint], &self.limits);
        let (lower, upper) = (self.motion.lower[joint], self.motion.upper[joint]);
        if at < lower - limits.position_margin || at > upper + limits.position_margin {
            return Some(Trip::JointPosition { joint, at, lower, upper });
        }
        let most = self.motion.velocity[joint] * limits.velocity_factor;
        if state.velocity[joint].abs() > most {
            return Some(Trip::JointVelocity { joint, velocity: state.velocity[joint], limit: most });
        }
        let commanded = state.commanded[joint];
        ((at - commanded).abs() > limits.following).then_some(Trip::Following { joint, at, commanded })
    }

    /// A measured position that no joint can have reached since the last tick.
    pub(super) fn jumped(&self, last: &State, state: &State, dt: f64) -> Option<Trip> {
        let elapsed = (state.stamp - last.stamp).seconds().max(dt);
        (0..self.motion.joints()).find_map(|joint| {
            let by = state.position[joint] - last.position[joint];
            let most = self.motion.velocity[joint] * self.limits.velocity_factor * elapsed + self.limits.jump;
            (by.abs() > most).then_some(Trip::Jump { joint, by })
        })
    }
}
