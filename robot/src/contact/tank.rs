//! [`Tank`]: the energy that the law may hand to the skin.
//!
//! Around the set force `f*` the law answers the missing force `e = f* - f` with a speed `v`; the skin answers the speed
//! with a force. A passive skin gives back no more than it was given: `∫(f - f*) v ≤ S` at all times. A law that is
//! passive at this port (`∫ e v ≥ -E`) hands over at most `E` beyond the set force's own work, and the two together
//! can only come to rest. Lags make a law active at high frequencies: it pushes on when the force is already too high.
//! The tank keeps the account: it is drained by what is handed over, filled by what is taken back, and never holds more
//! than it began with. When it is empty the law is a slow one that is passive whatever the lag (`docs/contact.md`).

/// What the tank holds when it is full (J): a newton too much over six millimetres.
const FULL_J: f64 = 0.006;
/// An empty tank has to be filled to this part before the law is trusted again.
const TRUSTED: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
pub(super) struct Tank {
    level: f64,
    empty: bool,
}

impl Tank {
    pub(super) const fn full() -> Self {
        Self { level: FULL_J, empty: false }
    }

    /// The force missing (N) while the probe moved so far in (m).
    pub(super) fn account(&mut self, missing: f64, moved: f64) {
        self.level = (self.level + missing * moved).clamp(0.0, FULL_J);
        self.empty = self.level <= 0.0 || (self.empty && self.level < TRUSTED * FULL_J);
    }

    /// Whether the law has to be the slow one.
    pub(super) const fn is_empty(&self) -> bool {
        self.empty
    }

    /// What is left, as a part of what it holds when it is full.
    pub(super) fn left(&self) -> f64 {
        self.level / FULL_J
    }
}
