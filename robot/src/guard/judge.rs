//! The questions the guard asks at every tick; none of them changes anything but what is remembered of the probe.

use probepath_frames::{Base, Pose, Probe};

use super::{Guard, Trip, Watch};
use crate::{Joints, Pressure, State};

impl Guard {
    /// The commanded place of the probe: no faster than allowed, and from where a brake ends inside the workspace and
    /// upright. As the tick before passed the same question, the brake that follows a trip ends so too. A probe found
    /// outside may come back, but go no further out.
    pub(super) fn judge_place(
        &self,
        watch: &mut Watch,
        position: &Joints,
        brakes_at: impl Fn() -> Joints,
        dt: f64,
    ) -> Option<Trip> {
        let place = self.probe.as_ref()?;
        let next = place(position);
        let before = watch.probe.replace(next).unwrap_or(next);
        self.too_fast(watch, &before, &next, (dt, watch.allowance.speed_m_s)).or_else(|| {
            let bounded = self.tilt.is_some() || !self.workspace.planes().is_empty();
            if bounded { self.outside(&place(&brakes_at()), &before) } else { None }
        })
    }

    /// The measured place of the probe, while the arm gives way to the hand by its own means.
    pub(super) fn judge_free(&self, watch: &mut Watch, state: &State, dt: f64) -> Option<Trip> {
        let next = self.probe.as_ref()?(&state.position);
        let before = watch.probe.replace(next).unwrap_or(next);
        // The hand leads: nothing was commanded that a confirmation could slow down.
        self.too_fast(watch, &before, &next, (dt, f64::INFINITY)).or_else(|| self.outside(&next, &before))
    }

    fn too_fast(
        &self,
        watch: &Watch,
        before: &Pose<Base, Probe>,
        next: &Pose<Base, Probe>,
        (dt, allowed_m_s): (f64, f64),
    ) -> Option<Trip> {
        let speed_m_s = before.origin().distance(&next.origin()) / dt;
        let limit_m_s = self.limits.speed_m_s(-watch.last.wrench.force.z, watch.reduced_s);
        let limit_m_s = limit_m_s.min(allowed_m_s);
        (speed_m_s > limit_m_s).then_some(Trip::ProbeSpeed { speed_m_s, limit_m_s })
    }

    fn outside(&self, rest: &Pose<Base, Probe>, before: &Pose<Base, Probe>) -> Option<Trip> {
        let crossed = self.workspace.crossed(&rest.origin(), &before.origin());
        crossed.map(|(plane, beyond_m)| Trip::Workspace { plane, beyond_m }).or_else(|| {
            let tilt = self.tilt?;
            let tilt_rad = tilt.exceeded(rest, before)?;
            Some(Trip::Tilt { tilt_rad, limit_rad: tilt.most_rad })
        })
    }

    pub(super) fn late(&self, last: &State, state: &State, stale_ns: i64) -> Option<Trip> {
        let heartbeat = self.limits.heartbeat.nanoseconds();
        let old = stale_ns.max(state.age.nanoseconds());
        if old > heartbeat {
            return Some(Trip::OldData { age_s: old as f64 * 1e-9 });
        }
        let gap = (state.stamp - last.stamp).nanoseconds();
        if gap > heartbeat {
            let missed = state.tick.saturating_sub(last.tick + 1);
            return Some(Trip::LateTick { gap_s: gap as f64 * 1e-9, missed });
        }
        let back = gap < 0 || state.tick < last.tick;
        back.then_some(Trip::BackInTime { tick: state.tick, after: last.tick })
    }

    /// A sensor that once lived and now says the same thing, to the last bit, again and again: every sensor has noise.
    pub(super) fn frozen(&self, watch: &Watch, dt: f64) -> Option<Trip> {
        let seconds = f64::from(watch.same_wrench) * dt;
        let frozen = watch.wrench_lives && seconds > self.limits.frozen_after_s;
        frozen.then_some(Trip::FrozenSensor { seconds })
    }

    /// More of a force than is tolerated: in all, sideways, or on too little of the probe's face.
    pub(super) fn too_much(&self, watch: &Watch, state: &State) -> Option<Trip> {
        let force_n = state.wrench.force.norm();
        let limit_n = watch.allowance.force_n;
        if force_n > limit_n {
            return Some(Trip::Force { force_n, limit_n });
        }
        // While too much force is lifted out of, these fall with it.
        if limit_n > self.limits.force_hard_n { None } else { self.badly_pressed(&watch.pressure?) }
    }

    fn badly_pressed(&self, pressure: &Pressure) -> Option<Trip> {
        let (limits, force_n) = (&self.limits, pressure.tangential_n);
        if force_n > limits.sideways_n {
            return Some(Trip::Sideways { force_n, limit_n: limits.sideways_n });
        }
        let (edge_n_cm2, limit_n_cm2) = (pressure.edge_n_cm2, limits.edge_n_cm2);
        (edge_n_cm2 > limit_n_cm2).then_some(Trip::Pressure { edge_n_cm2, limit_n_cm2 })
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
        if !state.safety.lets_move() {
            return Some(Trip::StoppedItself { safety: state.safety });
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
