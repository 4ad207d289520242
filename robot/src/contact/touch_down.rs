use probepath_frames::Span;

use super::{ContactError, ContactLaw};

/// How the probe comes down on the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchDownSettings {
    /// Speed of the descent (m/s). 0.008.
    pub approach_m_s: f64,
    /// Filtered force (N) that counts as contact: well above the sensor's noise. 0.8.
    pub contact_n: f64,
    /// How fast the force is then raised to the one wanted (N/s). 2.
    pub ramp_n_s: f64,
    /// How near (N) the force has to be, for how long (s), to count as held. 0.5 and 0.25.
    pub held_within_n: f64,
    /// See `held_within_n`.
    pub held_for_s: f64,
}

impl Default for TouchDownSettings {
    fn default() -> Self {
        Self { approach_m_s: 0.008, contact_n: 0.8, ramp_n_s: 2.0, held_within_n: 0.5, held_for_s: 0.25 }
    }
}

/// How far the touch-down is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchDownPhase {
    /// Nothing felt yet.
    Descending,
    /// On the skin; the force is raised to this one (N) by now.
    Pressing {
        /// The force held now (N).
        set_n: f64,
    },
    /// The wanted force is held.
    Held,
    /// The offset reached its end without contact: there is no skin where the path expects it.
    NoContact,
}

/// Finds the skin softly: descends at a steady speed, feels it, then raises the force to the one wanted.
///
/// ```text
///   Descending ──force ≥ contact_n──▶ Pressing ──at the wanted force for a while──▶ Held
///       └──────────offset at its end──▶ NoContact
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TouchDown {
    law: ContactLaw,
    settings: TouchDownSettings,
    phase: TouchDownPhase,
    wanted_n: f64,
    dt: f64,
    /// How long the force has been near the wanted one (s).
    near_s: f64,
}

impl TouchDown {
    /// With a law that is at rest in free air, down to `wanted_n` newtons.
    ///
    /// # Errors
    /// When a setting, or the wanted force, is not positive and finite.
    pub fn new(
        law: ContactLaw,
        settings: TouchDownSettings,
        wanted_n: f64,
        period: Span,
    ) -> Result<Self, ContactError> {
        let s = &settings;
        let positive = [
            ("approach speed", s.approach_m_s),
            ("contact force", s.contact_n),
            ("ramp of the force", s.ramp_n_s),
            ("nearness of a held force", s.held_within_n),
            ("time of a held force", s.held_for_s),
            ("wanted force", wanted_n),
            ("period", period.seconds()),
        ];
        if let Some((what, value)) =
            positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
        {
            return Err(ContactError { what, value, wanted: "it must be positive and finite" });
        }
        let phase = TouchDownPhase::Descending;
        Ok(Self { law, settings, phase, wanted_n, dt: period.seconds(), near_s: 0.0 })
    }

    /// One tick: pressing force (N) in, offset along the probe's z (m) out.
    pub fn step(&mut self, pressing_n: f64) -> f64 {
        match self.phase {
            TouchDownPhase::Descending => self.descend(pressing_n),
            TouchDownPhase::Pressing { set_n } => self.press(pressing_n, set_n),
            TouchDownPhase::Held => self.law.step(pressing_n, self.wanted_n),
            TouchDownPhase::NoContact => self.law.step_at(0.0, pressing_n),
        }
    }

    /// How far it is.
    pub const fn phase(&self) -> TouchDownPhase {
        self.phase
    }

    /// The law, to go on with where the touch-down ends.
    pub const fn law(&self) -> &ContactLaw {
        &self.law
    }

    fn descend(&mut self, pressing_n: f64) -> f64 {
        let offset = self.law.step_at(self.settings.approach_m_s, pressing_n);
        let contact_n = self.settings.contact_n.min(self.wanted_n);
        if self.law.force_n() >= contact_n {
            self.phase = TouchDownPhase::Pressing { set_n: contact_n };
        } else if offset >= self.law.settings().highest_m - 1e-4 {
            self.phase = TouchDownPhase::NoContact;
        }
        offset
    }

    fn press(&mut self, pressing_n: f64, set_n: f64) -> f64 {
        let set_n = (set_n + self.settings.ramp_n_s * self.dt).min(self.wanted_n);
        self.phase = TouchDownPhase::Pressing { set_n };
        let offset = self.law.step(pressing_n, set_n);
        let near =
            set_n >= self.wanted_n && (self.law.force_n() - set_n).abs() <= self.settings.held_within_n;
        self.near_s = if near { self.near_s + self.dt } else { 0.0 };
        if self.near_s >= self.settings.held_for_s {
            self.phase = TouchDownPhase::Held;
        }
        offset
    }
}
