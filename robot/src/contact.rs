//! [`ContactLaw`]: holds the force along the probe's z by moving the probe along it.
//!
//! Pressing force in, offset along the probe's z out (positive into the tissue), every output jerk-limited.
//!
//! The skin answers with `f = k (x - w)`: stiffness times how far the probe is in. The law reckons where the force would
//! be the one to hold, `x + (f* - f) / k`, from where the probe was when the force was felt ([`arm_lag`]); tracks that
//! place and its speed; and goes to where it will be when the command has arrived. So what stands still or moves
//! steadily costs nothing, and whatever the arm's lag is, slow errors are integrated twice. The path's own shape is
//! fed forward by being the path: the offset is beside it. Limits wind nothing up, for the place is reckoned from what
//! was commanded in truth.
//!
//! Only the ratio of the true stiffness to the one reckoned with decides on stability, and everything below 1.4 is
//! stable; so the stiffness is held on the stiff side, asked for all the time ([`stiffness`]), and when the law hands the
//! skin more energy than it may, it is calmed down ([`tank`]). The argument and the numbers are in `docs/contact.md`.

mod arm_lag;
mod patience;
pub(crate) mod pressure;
mod settings;
mod stiffness;
mod tank;

use probepath_frames::Span;

use crate::limits::axis::{self, Bounds, Motion};
use arm_lag::ArmLag;
pub use patience::Patience;
pub use settings::{ContactError, ContactSettings};
pub use stiffness::SkinEstimate;
use stiffness::Stiffness;
use tank::Tank;

/// How the bandwidth falls with the stiffness that is reckoned with: softer skin makes less force of the same error in
/// place, and more motion of the same noise.
const SOFTER_IS_SLOWER: f64 = 0.4;
/// On the skin (N): below, nothing is learned of it.
const ON_SKIN_N: f64 = 0.4;
/// Where the skin is asked for its stiffness, as a multiple of how fast it is followed: there the loop is a good quarter
/// of a period late.
const ASKED_ABOVE: f64 = 1.0;
/// How much slower, and softer, the law is while the tank is empty.
const CALM: f64 = 0.5;

/// The part of its speed that the law keeps however fast the path is followed.
const LEFT_TO_THE_LAW: f64 = 0.25;

/// How long the law stays slower after the jerk was at its limit (s), and how slow it may become.
const EASED_FOR_S: f64 = 0.1;
const EASED_LEAST: f64 = 0.3;
/// Over how long what is asked of the jerk is smoothed (s).
const DEMAND_S: f64 = 0.006;

/// Force in, offset out.
#[derive(Clone, Copy, Debug)]
pub struct ContactLaw {
    settings: ContactSettings,
    bounds: Bounds,
    dt: f64,
    /// The speed of the path beside it (m/s).
    path_m_s: f64,
    /// The offset and its differences, per tick.
    motion: Motion,
    arm: ArmLag,
    /// Where the probe was when the last force was felt (m).
    felt_at: f64,
    /// The offset at which the force would be the set one (m), and how fast it moves (m/s).
    goal: (f64, f64),
    skin: Stiffness,
    tank: Tank,
    /// How far the question to the skin is (rad).
    asking: f64,
    /// How much slower the law is for the jerk's sake: 1 is not at all.
    eased: f64,
    /// The jerk asked for, as a multiple of what is allowed, smoothed.
    demand: f64,
    /// The last force that was a number (N), and the filtered one, once one has come.
    raw: f64,
    force: Option<f64>,
}

impl ContactLaw {
    /// At rest at offset zero.
    ///
    /// # Errors
    /// When a setting is not finite or has the wrong sign.
    pub fn new(settings: ContactSettings, period: Span) -> Result<Self, ContactError> {
        let dt = period.seconds();
        let arm = settings.check(dt)?;
        let s = &settings;
        let bounds = Bounds {
            lower: s.lowest_m,
            upper: s.highest_m,
            velocity: s.speed_m_s * dt,
            acceleration: s.acceleration_m_s2 * dt * dt,
            jerk: s.jerk_m_s3 * dt * dt * dt,
        };
        Ok(Self {
            settings,
            bounds,
            dt,
            path_m_s: 0.0,
            motion: Motion { position: 0.0, velocity: 0.0, acceleration: 0.0 },
            arm,
            felt_at: 0.0,
            goal: (0.0, 0.0),
            skin: Stiffness::new(s.softest_n_m, s.stiffest_n_m, dt),
            tank: Tank::full(),
            asking: 0.0,
            eased: 1.0,
            demand: 0.0,
            raw: 0.0,
            force: None,
        })
    }

    /// One tick: the pressing force (N, positive; minus the wrench's force along the probe's z) and the force to hold
    /// give the next offset (m). A force that is not finite counts as the one before.
    pub fn step(&mut self, pressing_n: f64, set_n: f64) -> f64 {
        let moved = self.feel(pressing_n);
        let missing = set_n - self.raw;
        // In the air nothing is given back, however far the probe goes.
        if self.raw > ON_SKIN_N {
            self.tank.account(missing, moved);
        }
        self.track(missing);
        self.toward_goal();
        self.arm.command(self.motion.position);
        self.motion.position
    }

    /// From now on the law goes no faster than a path that is followed at this speed (m/s) leaves it of the speed that
    /// both have together; a quarter of its own is always left.
    pub fn beside(&mut self, path_speed_m_s: f64) {
        self.path_m_s = path_speed_m_s;
        let s = &self.settings;
        let left = s.together_m_s - path_speed_m_s;
        self.bounds.velocity = left.max(LEFT_TO_THE_LAW * s.speed_m_s).min(s.speed_m_s) * self.dt;
    }

    /// One tick at a given speed (m/s, positive into the tissue) instead of a force, as smoothly: the descent before
    /// contact, the lift after.
    pub fn step_at(&mut self, speed_m_s: f64, pressing_n: f64) -> f64 {
        self.feel(pressing_n);
        self.tank = Tank::full();
        self.at_speed(speed_m_s);
        self.goal = (self.felt_at, 0.0);
        self.arm.command(self.motion.position);
        self.motion.position
    }

    /// The offset now (m).
    pub const fn offset_m(&self) -> f64 {
        self.motion.position
    }

    /// The offset's speed now (m/s).
    pub fn speed_m_s(&self) -> f64 {
        self.motion.velocity / self.dt
    }

    /// The pressing force it believes (N), filtered.
    pub fn force_n(&self) -> f64 {
        self.force.unwrap_or(0.0)
    }

    /// What it knows of the skin's stiffness.
    pub const fn skin(&self) -> SkinEstimate {
        self.skin.estimate()
    }

    /// What is left of the energy that it may hand to the skin, 0 to 1; at 0 it goes slowly until some came back.
    pub fn energy_left(&self) -> f64 {
        self.tank.left()
    }

    /// What it may do.
    pub const fn settings(&self) -> &ContactSettings {
        &self.settings
    }

    /// Takes in a force; how far the probe moved (m) from where the last was felt to where this was.
    fn feel(&mut self, pressing_n: f64) -> f64 {
        if pressing_n.is_finite() {
            self.raw = pressing_n;
        }
        let before = self.force.unwrap_or(self.raw);
        let force = before + self.dt / (self.settings.filter_s + self.dt) * (self.raw - before);
        self.force = Some(force);
        let at = self.arm.felt_at();
        let moved = at - self.felt_at;
        self.felt_at = at;
        if force > ON_SKIN_N {
            self.skin.learn(at, self.raw, self.asked_at());
        } else {
            self.skin.forget();
        }
        moved
    }

    /// How much slower than on the stiffest skin.
    fn slower(&self) -> f64 {
        let calm = if self.tank.is_empty() { CALM } else { 1.0 };
        calm * self.eased * (self.skin.now() / self.settings.stiffest_n_m).powf(SOFTER_IS_SLOWER)
    }

    /// Where the force would be the set one, and how fast that place moves: a tracker with two equal poles.
    fn track(&mut self, missing: f64) {
        let fade = (-self.settings.follow_rad_s * self.slower() * self.dt).exp();
        let stiffness = if self.tank.is_empty() { self.skin.now() / CALM } else { self.skin.now() };
        let seen = self.felt_at + missing / stiffness;
        let (at, speed) = self.goal;
        let foreseen = at + speed * self.dt;
        let off = seen - foreseen;
        self.goal = (foreseen + (1.0 - fade * fade) * off, speed + (1.0 - fade).powi(2) / self.dt * off);
    }

    /// To where the goal will be when the command has arrived, as a critically damped filter of second order goes that
    /// knows the goal's speed; within the bounds.
    fn toward_goal(&mut self) {
        let (at, speed) = self.goal;
        let to = at + speed * self.arm.late_s() + self.question();
        let w = self.settings.smooth_rad_s * self.slower() * self.dt;
        let m = &self.motion;
        let (off, slow) = (to - m.position - m.velocity, speed * self.dt - m.velocity);
        // Solved for the end of the tick, so that it is stable at any frequency.
        let acceleration = (w * w * off + 2.0 * w * slow) / (1.0 + 2.0 * w + w * w);
        let demand = (acceleration - m.acceleration) / self.bounds.jerk;
        self.go(m.position + (m.velocity + acceleration));
        self.ease(demand);
    }

    /// What the jerk's limit cuts off comes late, and a late answer rocks the loop. The same way in a third of the jerk
    /// is one that is slower by the third root: the law becomes that much slower at once, and fast again within a while.
    /// Noise asks for one sign as often as for the other, and does not count.
    fn ease(&mut self, demand: f64) {
        self.demand += self.dt / (DEMAND_S + self.dt) * (demand - self.demand);
        let demand = self.demand.abs();
        let risen = self.eased + (1.0 - self.eased) * self.dt / EASED_FOR_S;
        self.eased = if demand > 1.0 { risen.min(demand.cbrt().recip().max(EASED_LEAST)) } else { risen };
    }

    /// The angular frequency of the question to the skin.
    fn asked_at(&self) -> f64 {
        ASKED_ABOVE * self.settings.follow_rad_s * self.slower()
    }

    /// A small motion to and fro, which asks the skin for its stiffness (m).
    fn question(&mut self) -> f64 {
        self.asking = (self.asking + self.asked_at() * self.dt) % std::f64::consts::TAU;
        let size = (self.settings.question_n / self.skin.now()).max(self.settings.question_m);
        size * self.asking.sin()
    }

    /// Moves toward a speed, as a critically damped filter of second order does.
    fn at_speed(&mut self, speed_m_s: f64) {
        let w = self.settings.smooth_rad_s * self.dt;
        let speed = speed_m_s.clamp(-self.settings.speed_m_s, self.settings.speed_m_s) * self.dt;
        let m = &self.motion;
        let acceleration = (m.acceleration + w * w * (speed - m.velocity)) / (1.0 + 2.0 * w + w * w);
        self.go(m.position + (m.velocity + acceleration));
    }

    /// As near to a position as the bounds allow.
    fn go(&mut self, wanted: f64) {
        let m = &self.motion;
        let position = axis::limit(m, &self.bounds, wanted);
        let velocity = position - m.position;
        self.motion = Motion { position, velocity, acceleration: velocity - m.velocity };
    }
}

#[cfg(test)]
mod passive;
#[cfg(test)]
mod tests;
