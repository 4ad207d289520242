use probepath_frames::Span;

/// How long a motion may take to slow down when the arm goes into reduced mode (s).
const SLOWED_WITHIN_S: f64 = 0.5;

/// What the guard watches for; FIELD.md section 10 has the figures' sources.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuardLimits {
    /// How far beyond a joint's range it may be measured (rad, m): noise and calibration. 0.01.
    pub position_margin: f64,
    /// Measured joint speed, as a multiple of the joint's limit. 1.2.
    pub velocity_factor: f64,
    /// How far a joint may be measured from where it was commanded (rad, m): servo lag at full speed. 0.15.
    pub following: f64,
    /// How far a measured joint may jump in a tick beyond what its speed allows (rad, m). 0.02.
    pub jump: f64,
    /// How far the limits may change a command (rad, m): rounding, not planning. 1e-4.
    pub correction: f64,
    /// Force (N) above which whoever holds a contact force should lower it. 10.
    pub force_soft_n: f64,
    /// Force (N) that stops the arm, which should then be lifted. 15.
    pub force_hard_n: f64,
    /// Force (N) along the skin that stops the arm, which should then be lifted: friction over gel is a newton or two. 8.
    pub sideways_n: f64,
    /// Pressure (N/cm²) at an edge of the probe's face that stops the arm, which should then be lifted: half of
    /// what 10 N are on an edge of 0.2 cm². 25.
    pub edge_n_cm2: f64,
    /// Force (N) that no sensor on a probe reports in earnest. 200.
    pub force_plausible_n: f64,
    /// Torque (N m) that no sensor on a probe reports in earnest. 20.
    pub torque_plausible_n_m: f64,
    /// The longest time between two states, and the oldest state that is believed. 10 ms.
    pub heartbeat: Span,
    /// Speed of the probe's origin in free air (m/s). 0.25.
    pub free_speed_m_s: f64,
    /// Speed of the probe's origin while it presses (m/s): 20 mm/s along the skin, and as much again to follow its
    /// bumps. 0.05.
    pub skin_speed_m_s: f64,
    /// Speed of the probe's origin at first after a confirmation (m/s). 0.01.
    pub resume_speed_m_s: f64,
    /// Speed of the probe's origin while the arm is in reduced mode (m/s), half a second after it went into it. 0.02.
    pub reduced_speed_m_s: f64,
    /// How long a sensor may say the same thing to the last bit (s): every sensor has noise. 0.1.
    pub frozen_after_s: f64,
    /// Pressing force (N) from which the probe counts as on the skin. 2.
    pub contact_n: f64,
}

impl Default for GuardLimits {
    fn default() -> Self {
        Self {
            position_margin: 0.01,
            velocity_factor: 1.2,
            following: 0.15,
            jump: 0.02,
            correction: 1e-4,
            force_soft_n: 10.0,
            force_hard_n: 15.0,
            sideways_n: 8.0,
            edge_n_cm2: 25.0,
            force_plausible_n: 200.0,
            torque_plausible_n_m: 20.0,
            heartbeat: Span::from_milliseconds(10),
            free_speed_m_s: 0.25,
            skin_speed_m_s: 0.05,
            resume_speed_m_s: 0.010,
            reduced_speed_m_s: 0.020,
            frozen_after_s: 0.1,
            contact_n: 2.0,
        }
    }
}

impl GuardLimits {
    /// For hand guiding: the hand's own force passes through the sensor, and leads at up to 100 mm/s, on the skin or
    /// off it.
    pub fn hand_guiding() -> Self {
        Self {
            force_soft_n: 40.0,
            force_hard_n: 60.0,
            // The hand's own force goes through the sensor, and acts on the handle.
            sideways_n: f64::INFINITY,
            edge_n_cm2: f64::INFINITY,
            free_speed_m_s: 0.12,
            skin_speed_m_s: 0.12,
            reduced_speed_m_s: 0.12,
            ..Self::default()
        }
    }

    /// For the arm's own giving way ([`Command::Freedrive`](crate::Command::Freedrive)): nothing bounds the hand, so
    /// that only the standards' 250 mm/s for teaching stops the arm.
    pub fn freedrive() -> Self {
        let speed = 0.25;
        let guiding = Self::hand_guiding();
        Self { free_speed_m_s: speed, skin_speed_m_s: speed, reduced_speed_m_s: speed, ..guiding }
    }

    /// The probe's speed limit (m/s) at a pressing force (N), and after some time in reduced mode (s).
    pub(super) fn speed_m_s(&self, pressing_n: f64, reduced_s: Option<f64>) -> f64 {
        let usual = if pressing_n > self.contact_n { self.skin_speed_m_s } else { self.free_speed_m_s };
        match reduced_s {
            Some(seconds) if seconds > SLOWED_WITHIN_S => usual.min(self.reduced_speed_m_s),
            _ => usual,
        }
    }
}
