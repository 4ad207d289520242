//! [`Behind`]: how far along the path an arm is that may not keep up with the clock.

use super::Stepped;

/// The clock waits when it is so far ahead (m), or the probe so far off its way (m, and rad).
const WAITS_M: f64 = 0.0005;
const WAITS_OFF: (f64, f64) = (0.0002, 0.002);
/// What is behind is caught up within about so long (s).
const CATCH_UP_S: f64 = 0.2;
/// Nearer to the clock than this (m) the arm is with it.
const WITH_IT_M: f64 = 1e-12;

/// Where along the path the arm is (m), which the steps' parts add up to, and how much that holds the path's clock
/// back. Nominally it is where the clock is, to the bit. It never goes back, and what it catches up is spread smoothly.
///
/// Each tick: the clock is stepped at its speed times [`scale`](Self::scale); [`aim`](Self::aim) says where to go;
/// [`went`](Self::went) takes in which part of that was gone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Behind {
    at: f64,
    clock: f64,
    aim: f64,
    /// How far off its way the probe is, as a part of what the clock waits at.
    off: f64,
}

impl Behind {
    /// At `s` metres, with the clock.
    pub const fn at(s: f64) -> Self {
        Self { at: s, clock: s, aim: s, off: 0.0 }
    }

    /// Where the arm should be at the end of a tick, at the end of which the clock is at `clock` metres.
    pub fn aim(&mut self, clock: f64, dt: f64) -> f64 {
        let behind = (self.clock - self.at).max(0.0);
        let on = (clock - self.clock).max(0.0);
        self.clock = self.clock.max(clock);
        self.aim = if behind <= WITH_IT_M {
            self.clock
        } else {
            (self.at + on + behind * (dt / CATCH_UP_S).min(1.0)).min(self.clock)
        };
        self.aim
    }

    /// What the step made of the aim.
    pub fn went(&mut self, stepped: &Stepped) {
        let part = stepped.part;
        self.at = if part >= 1.0 { self.aim } else { self.at + part.max(0.0) * (self.aim - self.at) };
        self.off = (stepped.off.0 / WAITS_OFF.0).max(stepped.off.1 / WAITS_OFF.1);
    }

    /// Where the arm is (m).
    pub const fn place(&self) -> f64 {
        self.at
    }

    /// How far it is behind the clock (m).
    pub fn by(&self) -> f64 {
        self.clock - self.at
    }

    /// What the clock's speed is to be multiplied by.
    pub fn scale(&self) -> f64 {
        (1.0 - self.by() / WAITS_M - self.off).clamp(0.0, 1.0)
    }
}
