//! [`ArmLag`]: where the probe was when the force that is read now was felt.

/// Commands that are remembered: 62 ms of dead time at 500 Hz.
const QUEUE: usize = 32;

/// The offset commanded, through a dead time of whole ticks and a critically damped servo.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArmLag {
    queue: [f64; QUEUE],
    newest: usize,
    dead: usize,
    share: f64,
    first: f64,
    second: f64,
    late_s: f64,
}

impl ArmLag {
    /// At rest at zero. `dead_s` from the command to the force that answers it, `lag_s` behind a steady motion; none
    /// when the dead time is too long to remember.
    pub(super) fn new(dead_s: f64, lag_s: f64, dt: f64) -> Option<Self> {
        // The command of this tick is not known yet when the force is read: one tick is late in any case.
        let dead = ((dead_s / dt).round().max(1.0) as usize).checked_sub(1).filter(|dead| *dead < QUEUE)?;
        let fade = (-2.0 * dt / lag_s).exp();
        let late_s = dt * ((dead + 1) as f64 + 2.0 * fade / (1.0 - fade));
        Some(Self {
            queue: [0.0; QUEUE],
            newest: 0,
            dead,
            share: 1.0 - fade,
            first: 0.0,
            second: 0.0,
            late_s,
        })
    }

    /// How late all of it is behind a steady motion (s).
    pub(super) const fn late_s(&self) -> f64 {
        self.late_s
    }

    /// One tick, before its command is known: where the probe was (m).
    pub(super) fn felt_at(&mut self) -> f64 {
        let oldest = (self.newest + QUEUE - self.dead) % QUEUE;
        let told = self.queue.get(oldest).copied().unwrap_or_default();
        self.first += self.share * (told - self.first);
        self.second += self.share * (self.first - self.second);
        self.second
    }

    /// The tick's command.
    pub(super) fn command(&mut self, offset: f64) {
        self.newest = (self.newest + 1) % QUEUE;
        if let Some(place) = self.queue.get_mut(self.newest) {
            *place = offset;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn behind_a_steady_motion_it_is_as_late_as_it_says() {
        for (dead, lag) in [(0.002, 0.004), (0.008, 0.010), (0.03, 0.02)] {
            let mut arm = ArmLag::new(dead, lag, 0.002).unwrap();
            let (mut told, mut felt) = (0.0, 0.0);
            for _ in 0..500 {
                felt = arm.felt_at();
                told += 1e-4;
                arm.command(told);
            }
            let late = (told - felt) / 1e-4 * 0.002;
            assert!((late - arm.late_s()).abs() < 1e-9, "{late} {}", arm.late_s());
        }
        assert!(ArmLag::new(0.1, 0.01, 0.002).is_none());
    }
}
