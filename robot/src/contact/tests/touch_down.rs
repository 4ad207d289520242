//! A soft touch-down, to bring the law onto a skin: down at a steady speed until the skin is felt, then the force is
//! raised to the one wanted. What drives an arm is the replay's own.

use super::super::ContactLaw;
use super::{DT, WANTED};

/// Speed of the descent (m/s), the force that counts as contact (N), how fast it is raised (N/s), and how near it has to
/// be for how long to count as held (N, s).
const DOWN_M_S: f64 = 0.008;
const CONTACT_N: f64 = 0.8;
const RAMP_N_S: f64 = 2.0;
const HELD: (f64, f64) = (0.5, 0.25);

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Phase {
    Descending,
    Pressing { set_n: f64 },
    Held,
    NoContact,
}

pub(super) struct TouchDown {
    pub(super) law: ContactLaw,
    pub(super) phase: Phase,
    near_s: f64,
}

impl TouchDown {
    pub(super) const fn new(law: ContactLaw) -> Self {
        Self { law, phase: Phase::Descending, near_s: 0.0 }
    }

    /// One tick: pressing force (N) in, offset along the probe's z (m) out.
    pub(super) fn step(&mut self, pressing_n: f64) -> f64 {
        match self.phase {
            Phase::Descending => self.descend(pressing_n),
            Phase::Pressing { set_n } => self.press(pressing_n, set_n),
            Phase::Held => self.law.step(pressing_n, WANTED),
            Phase::NoContact => self.law.step_at(0.0, pressing_n),
        }
    }

    fn descend(&mut self, pressing_n: f64) -> f64 {
        let offset = self.law.step_at(DOWN_M_S, pressing_n);
        if self.law.force_n() >= CONTACT_N {
            self.phase = Phase::Pressing { set_n: CONTACT_N };
        } else if offset >= self.law.settings().highest_m - 1e-4 {
            self.phase = Phase::NoContact;
        }
        offset
    }

    fn press(&mut self, pressing_n: f64, set_n: f64) -> f64 {
        let set_n = (set_n + RAMP_N_S * DT).min(WANTED);
        let offset = self.law.step(pressing_n, set_n);
        let near = set_n >= WANTED && (self.law.force_n() - set_n).abs() <= HELD.0;
        self.near_s = if near { self.near_s + DT } else { 0.0 };
        self.phase = if self.near_s >= HELD.1 { Phase::Held } else { Phase::Pressing { set_n } };
        offset
    }
}
