//! [`ContactSettings`]: what the contact law may do, and how it does it.

use thiserror::Error;

use super::arm_lag::ArmLag;

/// What the contact law may do, and how it does it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Largest speed along the probe's z (m/s). 0.042.
    pub speed_m_s: f64,
    /// Largest speed of the law and of the path together (m/s): below what the guard allows on the skin, by what turns. 0.045.
    pub together_m_s: f64,
    /// Largest acceleration along it (m/s²). 1.
    pub acceleration_m_s2: f64,
    /// Largest jerk along it (m/s³). 40.
    pub jerk_m_s3: f64,
    /// How far the offset may go against the path, out of the tissue (m, negative). -0.04.
    pub lowest_m: f64,
    /// How far the offset may go into the tissue (m); 5 N on skin of 0.3 N/mm is 17 mm. 0.04.
    pub highest_m: f64,
    /// The softest skin it reckons with (N/m). 300.
    pub softest_n_m: f64,
    /// The stiffest (N/m); on skin half as stiff again it still holds. 3000.
    pub stiffest_n_m: f64,
    /// How fast the skin's motion is followed on the stiffest skin (rad/s). 66.
    pub follow_rad_s: f64,
    /// Angular frequency of the second-order filter on what is commanded, on the stiffest skin (rad/s). 80.
    pub smooth_rad_s: f64,
    /// Time constant of the filter on the force that is told and judged, not on the one that is held (s). 0.005.
    pub filter_s: f64,
    /// How hard the skin is asked for its stiffness while the force is held (N, amplitude). 0.04.
    pub question_n: f64,
    /// And how far the probe moves for it at least: further than the joints' play (m, amplitude). 12e-6.
    pub question_m: f64,
    /// From a command to the force that answers it (s): the tick, the bus, the sensor. 0.008.
    pub dead_s: f64,
    /// How late the arm is behind a steady motion beyond that (s): rather too little than too much. 0.008.
    pub lag_s: f64,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            speed_m_s: 0.042,
            together_m_s: 0.045,
            acceleration_m_s2: 1.0,
            jerk_m_s3: 40.0,
            lowest_m: -0.04,
            highest_m: 0.04,
            softest_n_m: 300.0,
            stiffest_n_m: 3000.0,
            follow_rad_s: 66.0,
            smooth_rad_s: 80.0,
            filter_s: 0.005,
            question_n: 0.04,
            question_m: 12e-6,
            dead_s: 0.008,
            lag_s: 0.008,
        }
    }
}

/// Settings that no contact can be held with.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("the contact setting {what} is {value}; {wanted}")]
pub struct ContactError {
    /// Which setting.
    pub what: &'static str,
    /// The number found.
    pub value: f64,
    /// What it has to be.
    pub wanted: &'static str,
}

impl ContactSettings {
    /// The default, for another stiffest skin (N/m).
    pub fn for_stiffest(stiffness_n_m: f64) -> Self {
        let default = Self::default();
        let softest_n_m = default.softest_n_m.min(stiffness_n_m);
        Self { stiffest_n_m: stiffness_n_m, softest_n_m, ..default }
    }

    /// The arm's lag, when every setting can be.
    pub(super) fn check(&self, dt: f64) -> Result<ArmLag, ContactError> {
        let positive = [
            ("speed", self.speed_m_s),
            ("speed together with the path", self.together_m_s),
            ("acceleration", self.acceleration_m_s2),
            ("jerk", self.jerk_m_s3),
            ("highest offset", self.highest_m),
            ("lowest offset, negated", -self.lowest_m),
            ("softest skin", self.softest_n_m),
            ("stiffest skin", self.stiffest_n_m),
            ("following", self.follow_rad_s),
            ("smoothing", self.smooth_rad_s),
            ("filter", self.filter_s),
            ("question", self.question_n),
            ("question's motion", self.question_m),
            ("dead time", self.dead_s),
            ("lag", self.lag_s),
            ("period", dt),
        ];
        if let Some((what, value)) =
            positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
        {
            return Err(ContactError { what, value, wanted: "it must be positive and finite" });
        }
        if self.softest_n_m > self.stiffest_n_m {
            let wanted = "it must not be stiffer than the stiffest skin";
            return Err(ContactError { what: "softest skin", value: self.softest_n_m, wanted });
        }
        let wanted = "it must be at most 31 ticks";
        let too_long = ContactError { what: "dead time", value: self.dead_s, wanted };
        ArmLag::new(self.dead_s, self.lag_s, dt).ok_or(too_long)
    }
}
