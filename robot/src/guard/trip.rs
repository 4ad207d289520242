use thiserror::Error;

use crate::Safety;

/// Why the guard stopped the arm. `Copy`, so that a tick can carry it into the black box.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Trip {
    /// More force than the hard limit.
    #[error(
        "{force_n:.1} N on the probe, above {limit_n:.1} N: lift the probe, then find out what it pressed on"
    )]
    Force {
        /// Force (N).
        force_n: f64,
        /// The limit (N).
        limit_n: f64,
    },
    /// A wrench that is NaN or beyond any sensor's range.
    #[error("an implausible wrench ({force_n} N, {torque_n_m} N m): check the sensor's cable and its zero")]
    ImplausibleWrench {
        /// Force (N).
        force_n: f64,
        /// Torque (N m).
        torque_n_m: f64,
    },
    /// A wrench that is the same to the last bit for too long.
    #[error("the force sensor has said the same for {:.0} ms: it hangs; restart it, then check its zero", seconds * 1e3)]
    FrozenSensor {
        /// For how long (s).
        seconds: f64,
    },
    /// More force across the probe's axis than allowed.
    #[error(
        "{force_n:.1} N across the probe's axis, above {limit_n:.1} N: it drags on something; add gel, or lift it"
    )]
    Sideways {
        /// Force (N).
        force_n: f64,
        /// The limit (N).
        limit_n: f64,
    },
    /// More pressure at an edge of the probe's face than allowed.
    #[error(
        "{edge_n_cm2:.1} N/cm² at the edge of the probe's face, above {limit_n_cm2:.1} N/cm²: lift the probe, and turn \
         it flat on the skin"
    )]
    Pressure {
        /// Pressure (N/cm²).
        edge_n_cm2: f64,
        /// The limit (N/cm²).
        limit_n_cm2: f64,
    },
    /// The arm's own safety system does not let it move.
    #[error("the arm's own safety system reports a {}: find the cause, then recover the arm by hand", safety.name())]
    StoppedItself {
        /// What it says.
        safety: Safety,
    },
    /// A state with a NaN, or with another number of joints.
    #[error("the arm's state has a joint that is not finite, or another number of joints than its limits")]
    ImplausibleState,
    /// A joint outside its range.
    #[error("joint {joint} is at {at:.4}, outside {lower:.4} to {upper:.4} (rad, m): guide it back by hand")]
    JointPosition {
        /// The joint, counted from zero.
        joint: usize,
        /// Where it is (rad, m).
        at: f64,
        /// Lower limit.
        lower: f64,
        /// Upper limit.
        upper: f64,
    },
    /// A joint faster than its limit.
    #[error("joint {joint} moves at {velocity:.3}, above {limit:.3} (rad/s, m/s)")]
    JointVelocity {
        /// The joint, counted from zero.
        joint: usize,
        /// Its velocity (rad/s, m/s).
        velocity: f64,
        /// The limit.
        limit: f64,
    },
    /// A joint far from where it was commanded.
    #[error("joint {joint} is at {at:.4}, commanded to {commanded:.4} (rad, m): does something hold it?")]
    Following {
        /// The joint, counted from zero.
        joint: usize,
        /// Where it is (rad, m).
        at: f64,
        /// Where it should be.
        commanded: f64,
    },
    /// A measured position that jumped.
    #[error(
        "joint {joint} was measured {by:.4} (rad, m) further in one tick: an encoder or the link is at fault"
    )]
    Jump {
        /// The joint, counted from zero.
        joint: usize,
        /// How far it jumped (rad, m).
        by: f64,
    },
    /// The limits had to change a command by more than rounding.
    #[error(
        "the limits changed joint {joint} by {by:.2e} (rad, m): the motion was planned beyond its limits"
    )]
    Corrected {
        /// The joint, counted from zero.
        joint: usize,
        /// By how much (rad, m).
        by: f64,
    },
    /// The probe beyond a plane of the workspace.
    #[error("the probe would go {:.1} mm beyond the workspace's plane {plane}: move the path or the plane", beyond_m * 1e3)]
    Workspace {
        /// The plane's number, in the order they were given.
        plane: usize,
        /// How far beyond (m).
        beyond_m: f64,
    },
    /// The probe leaning over further than allowed.
    #[error(
        "the probe would lean {:.1} degrees over, above {:.1}: teach the path with the probe more upright",
        tilt_rad.to_degrees(), limit_rad.to_degrees()
    )]
    Tilt {
        /// The angle (rad).
        tilt_rad: f64,
        /// The limit (rad).
        limit_rad: f64,
    },
    /// The probe faster than allowed.
    #[error("the probe would move at {:.1} mm/s, above {:.1} mm/s", speed_m_s * 1e3, limit_m_s * 1e3)]
    ProbeSpeed {
        /// Its speed (m/s).
        speed_m_s: f64,
        /// The limit (m/s).
        limit_m_s: f64,
    },
    /// Too long without a state.
    #[error("{:.1} ms between two states, {missed} ticks missed: the computer or the link is too slow", gap_s * 1e3)]
    LateTick {
        /// Time between them (s).
        gap_s: f64,
        /// Ticks missed.
        missed: u64,
    },
    /// The same state again and again.
    #[error("the arm's state is {:.1} ms old: its connection hangs; connect again", age_s * 1e3)]
    OldData {
        /// Its age (s).
        age_s: f64,
    },
    /// A state from before the last one.
    #[error("tick {tick} came after tick {after}: the arm was restarted; connect again")]
    BackInTime {
        /// The tick that came.
        tick: u64,
        /// The tick before it.
        after: u64,
    },
    /// A motion was begun although the last one was stopped.
    #[error("the arm was stopped and nobody has confirmed since: look at it, then confirm")]
    NotConfirmed,
    /// A confirmation on a state that was not measured since the stop.
    #[error("the confirmation came with the state of the stop itself: measure again, then confirm")]
    NotFresh,
    /// A confirmation while the arm moves.
    #[error("joint {joint} still moves at {velocity:.3} (rad/s, m/s): confirm when the arm is at rest")]
    Moving {
        /// The joint, counted from zero.
        joint: usize,
        /// Its velocity (rad/s, m/s).
        velocity: f64,
    },
    /// The operator stopped the arm.
    #[error("the operator stopped the arm")]
    Operator,
    /// Whoever watched the motion stopped the arm.
    #[error("whoever watched the motion stopped the arm")]
    Watcher,
    /// Something outside the guard ended the motion.
    #[error("the motion was ended by a fault outside the guard")]
    Fault,
}

impl Trip {
    /// Whether the probe should be lifted off before anything else.
    pub const fn asks_to_lift(&self) -> bool {
        matches!(self, Self::Force { .. } | Self::Pressure { .. } | Self::Sideways { .. })
    }

    /// Whether the arm has stopped by its own means, so that a brake has nothing to say.
    pub const fn is_of_the_arm(&self) -> bool {
        matches!(self, Self::StoppedItself { .. })
    }
}
