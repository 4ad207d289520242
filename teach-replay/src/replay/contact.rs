//! Whether the skin is felt: the force's zero in the air, first touch, and loss of contact.

/// Ticks in a row before a touch is believed.
const FELT_TICKS: u32 = 3;
/// States that a zero is taken from, at least.
const LEAST_WEIGHED: u32 = 25;
/// A zero larger than this (N) is no drift: something touches the probe, or the tool's weight is wrong.
const HEAVY_N: f64 = 2.0;

/// What is known of the contact.
#[derive(Clone, Debug)]
pub(super) struct Touch {
    sum: f64,
    weighed: u32,
    felt: u32,
    below: u32,
    lost_ticks: u32,
}

impl Touch {
    pub(super) fn new(lost_after: f64, dt: f64) -> Self {
        Self { sum: 0.0, weighed: 0, felt: 0, below: 0, lost_ticks: (lost_after / dt).ceil() as u32 }
    }

    /// The force in the air goes into the zero, unless it is so far from it that something touches.
    pub(super) fn weigh(&mut self, pressing: f64, touch: f64) {
        let drift = !self.is_weighed() || (pressing - self.zero()).abs() < 0.5 * touch;
        if pressing.is_finite() && drift {
            self.sum += pressing;
            self.weighed += 1;
        }
    }

    /// Whether the zero is known; before, no touch is believed.
    pub(super) const fn is_weighed(&self) -> bool {
        self.weighed >= LEAST_WEIGHED
    }

    /// The force that the sensor reads with nothing on it (N).
    pub(super) fn zero(&self) -> f64 {
        if self.is_weighed() { self.sum / f64::from(self.weighed) } else { 0.0 }
    }

    /// Whether what it reads in the air is too much for a drift.
    pub(super) fn is_heavy(&self) -> bool {
        self.zero().abs() > HEAVY_N
    }

    /// Whether the force has been above the threshold for long enough to be a touch.
    pub(super) fn is_felt(&mut self, force: f64, above: f64) -> bool {
        self.felt = if force > above && self.is_weighed() { self.felt + 1 } else { 0 };
        self.felt >= FELT_TICKS
    }

    /// Whether the force has been below the threshold for too long.
    pub(super) fn is_lost(&mut self, force: f64, below: f64) -> bool {
        self.below = if force < below { self.below + 1 } else { 0 };
        self.below >= self.lost_ticks
    }
}
