//! The servo: how the joints follow what they are told.

use probepath_robot::Joints;

/// Every joint behaves as a critically damped second-order system one tick behind its command.
///
/// `q'' + 2 a q' + a^2 q = a^2 u` with `u` running straight from one command to the next; each tick is solved
/// exactly, so nothing depends on the tick's length. Behind a steady motion it lags `2 / a`, plus the tick.
#[derive(Clone, Debug)]
pub(crate) struct Servo {
    rate: f64,
    told: Joints,
    before: Joints,
    position: Joints,
    velocity: Joints,
}

impl Servo {
    /// At rest at `start`, lagging `lag_s` seconds behind a steady motion (a tick aside).
    pub(crate) fn new(start: Joints, lag_s: f64) -> Self {
        let rest = Joints::zeros(start.len());
        Self { rate: 2.0 / lag_s, told: start, before: start, position: start, velocity: rest }
    }

    /// What it was last told.
    pub(crate) const fn told(&self) -> &Joints {
        &self.told
    }

    /// Where the motors are.
    pub(crate) const fn position(&self) -> &Joints {
        &self.position
    }

    /// How fast the motors turn.
    pub(crate) const fn velocity(&self) -> &Joints {
        &self.velocity
    }

    /// How fast the commands move (rad/s).
    pub(crate) fn told_velocity(&self, seconds: f64) -> Joints {
        self.told.zip(&self.before, |now, then| (now - then) / seconds)
    }

    /// One tick of `seconds`, at whose end the arm is told to be at `next`.
    pub(crate) fn step(&mut self, next: &Joints, seconds: f64) {
        for joint in 0..self.position.len() {
            let (from, to) = (self.before[joint], self.told[joint]);
            let slope = (to - from) / seconds;
            let error = self.position[joint] - from + 2.0 * slope / self.rate;
            let pull = self.velocity[joint] - slope + self.rate * error;
            let fade = (-self.rate * seconds).exp();
            self.position[joint] = to - 2.0 * slope / self.rate + (error + pull * seconds) * fade;
            self.velocity[joint] = slope + (pull - self.rate * (error + pull * seconds)) * fade;
        }
        self.before = self.told;
        self.told = *next;
    }

    /// The command that slows the last one down by at most `deceleration` (rad/s^2) in the fastest joint, all joints
    /// in proportion, so that the arm brakes along its way.
    pub(crate) fn braked(&self, deceleration: f64, seconds: f64) -> Joints {
        let speed = self.told_velocity(seconds);
        let fastest = speed.largest();
        let left = if fastest > 0.0 { (1.0 - deceleration * seconds / fastest).max(0.0) } else { 0.0 };
        self.told.zip(&speed, |told, v| told + v * left * seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 0.002;

    #[test]
    fn a_steady_motion_is_followed_by_the_lag_and_a_tick() {
        let mut servo = Servo::new(Joints::zeros(1), 0.010);
        let mut u = Joints::zeros(1);
        for _ in 0..500 {
            u[0] += 0.5 * TICK;
            servo.step(&u, TICK);
        }
        let behind = (u[0] - servo.position()[0]) / 0.5;
        assert!((behind - 0.012).abs() < 1e-6, "{behind}");
        assert!((servo.velocity()[0] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_exact_step_agrees_with_small_euler_steps() {
        let mut servo = Servo::new(Joints::zeros(1), 0.010);
        let (mut q, mut v, mut before, mut told) = (0.0, 0.0, 0.0, 0.0);
        for k in 0..200 {
            let next = (f64::from(k) * 0.05).sin() * 0.01;
            let n = 2000;
            for i in 0..n {
                let u = before + (told - before) * (f64::from(i) + 0.5) / f64::from(n);
                let a = 200.0f64.powi(2) * (u - q) - 400.0 * v;
                v += a * TICK / f64::from(n);
                q += v * TICK / f64::from(n);
            }
            (before, told) = (told, next);
            servo.step(&Joints::splat(1, next), TICK);
            assert!((servo.position()[0] - q).abs() < 2e-6 && (servo.velocity()[0] - v).abs() < 5e-4, "{k}");
        }
    }

    #[test]
    fn braking_ends_at_rest_without_a_jump() {
        let mut servo = Servo::new(Joints::zeros(2), 0.010);
        let mut u = Joints::zeros(2);
        for _ in 0..200 {
            u[0] += 0.4 * TICK;
            u[1] -= 0.2 * TICK;
            servo.step(&u, TICK);
        }
        let (start, mut last) = (u, servo.told_velocity(TICK));
        for _ in 0..200 {
            let next = servo.braked(8.0, TICK);
            servo.step(&next, TICK);
            let speed = servo.told_velocity(TICK);
            assert!((speed[0] - last[0]).abs() <= 8.0 * TICK + 1e-12);
            last = speed;
        }
        assert!(last.largest() < 1e-12 && servo.velocity().largest() < 1e-6);
        let (d0, d1) = (servo.told()[0] - start[0], servo.told()[1] - start[1]);
        assert!((d0 + 2.0 * d1).abs() < 1e-9, "both joints brake in proportion");
    }
}
