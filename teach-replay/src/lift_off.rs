//! [`LiftOff`]: takes the probe off the skin, from wherever a stop left it.

use probepath_frames::{Base, Pose, Probe};
use probepath_robot::{Command, ContactError, ContactLaw, ContactSettings, Controller, Joints, State};

use crate::ProbeArm;
use crate::probe_arm::along_z;

/// Moves the probe back along its own axis, and nowhere else. From rest to rest.
#[derive(Clone, Debug)]
pub struct LiftOff {
    arm: ProbeArm,
    law: ContactLaw,
    distance: f64,
    speed: f64,
    from: Option<Pose<Base, Probe>>,
    last: Joints,
}

/// Room beyond the distance, to brake in (m).
const ROOM: f64 = 0.01;
/// Nearer to the distance than this (m) it is reached.
const REACHED: f64 = 0.5e-3;

impl LiftOff {
    /// `distance` metres (0.04) at `speed` m/s (0.02) from where the arm rests at the first step.
    ///
    /// # Errors
    /// When distance or speed is not finite and above zero.
    pub fn new(arm: ProbeArm, distance: f64, speed: f64) -> Result<Self, ContactError> {
        let defaults = ContactSettings::default();
        let settings = ContactSettings {
            speed_m_s: speed,
            acceleration_m_s2: defaults.acceleration_m_s2.min(0.2),
            jerk_m_s3: defaults.jerk_m_s3.min(4.0),
            lowest_m: -distance - ROOM,
            highest_m: ROOM,
            ..defaults
        };
        let law = ContactLaw::new(settings, arm.period)?;
        Ok(Self { arm, law, distance, speed, from: None, last: Joints::zeros(0) })
    }
}

impl Controller for LiftOff {
    fn step(&mut self, state: &State) -> Option<Command> {
        if self.from.is_none() {
            self.last = state.commanded;
        }
        let from = *self.from.get_or_insert_with(|| self.arm.probe(&state.commanded));
        let reached = self.law.offset_m() <= REACHED - self.distance;
        if reached && self.law.speed_m_s().abs() < 1e-6 {
            return None;
        }
        let offset = self.law.step_at(if reached { 0.0 } else { -self.speed }, -state.wrench.force.z);
        self.last = self.arm.joints(&along_z(&from, offset), &self.last)?;
        Some(Command::Position(self.last))
    }
}

#[cfg(test)]
mod tests {
    use probepath_robot::{Guard, GuardLimits, Tick, Wish, run};

    use super::*;
    use crate::replay::plant::{DT, Plant, Skin, arm, home};

    #[test]
    fn it_goes_back_along_the_probes_axis_within_every_limit() {
        let mut start = home();
        start[3] += 0.2;
        let mut plant = Plant::new(Skin { stiffness: 500.0, bump: 0.0, wave: 1.0, until: 1.0 }, start, 0);
        let mut guard = Guard::new(GuardLimits::default(), arm().limits).unwrap();
        let mut commanded = vec![start; 3];
        let mut observer = |tick: &Tick| {
            assert!(tick.changed < 1e-9);
            commanded.push(tick.state.commanded);
            Wish::GoOn
        };
        run(&mut plant, &mut LiftOff::new(arm(), 0.04, 0.02).unwrap(), &mut guard, &mut observer).unwrap();
        let (from, to) = (arm().probe(&start), arm().probe(&commanded[commanded.len() - 1]));
        let way = (from.inverse() * to).isometry().translation.vector;
        assert!((way.z + 0.04).abs() < 1e-3 && way.xy().norm() < 1e-9, "{way}");
        let mut rows = commanded;
        for limit in [arm().limits.velocity, arm().limits.acceleration, arm().limits.jerk] {
            rows = rows.windows(2).map(|p| p[1].zip(&p[0], |b, a| (b - a) / DT)).collect();
            assert!(rows.iter().all(|row| row.zip(&limit, |x, l| x / l).largest() <= 1.0));
        }
    }
}
