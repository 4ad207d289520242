//! How a simulated controller is set up, and what fails in it.

use std::net::{IpAddr, Ipv4Addr};

use serde::{Deserialize, Serialize};

use super::ControllerError;
use crate::knobs::Ticks;

/// How a simulated controller is set up.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerConfig {
    /// The address that it listens on, at the standard ports. Controllers side by side differ in their loopback address.
    pub host: IpAddr,
    /// What makes its clock go.
    pub time: Time,
    /// Which version it says it is.
    pub version: Version,
    /// What fails.
    pub knobs: WireKnobs,
    /// Whether somebody is there who takes the probe.
    pub hand: Helper,
    /// Whether the motors have power and the brakes are open from the beginning.
    pub powered: bool,
    /// How long after a protective stop it may be unlocked (s); the real one wants 5.
    pub unlock_after_s: f64,
    /// For how long the cell's truth is remembered (s); all of it when absent, which is 0.2 MB a second.
    pub remembers_s: Option<f64>,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            host: IpAddr::V4(Ipv4Addr::LOCALHOST),
            time: Time::Wall,
            version: Version::default(),
            knobs: WireKnobs::default(),
            hand: Helper::default(),
            powered: true,
            unlock_after_s: 5.0,
            remembers_s: None,
        }
    }
}

/// What makes the controller's clock go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Time {
    /// 500 Hz by the machine's clock. When the machine is too slow the controller's clock falls behind it; it never
    /// hurries to catch up.
    #[default]
    Wall,
    /// A tick for each package of the client whose script runs, as fast as both go: the same commands give the same
    /// states. While no script runs and nothing moves, the cell's time stands still.
    Simulated,
}

/// Who is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Helper {
    /// The cell's hand takes the probe when a popup asks to guide it, or when freedrive begins, and holds the teach
    /// button while it guides.
    #[default]
    Guides,
    /// Nobody.
    Absent,
}

/// A controller's version.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// 5 is the e-series.
    pub major: u32,
    /// Minor.
    pub minor: u32,
    /// Bug fix.
    pub bugfix: u32,
    /// Build.
    pub build: u32,
}

impl Default for Version {
    fn default() -> Self {
        Self { major: 5, minor: 19, bugfix: 0, build: 1_210_631 }
    }
}

/// What fails on the wire and in the controller; all off by default. Ticks are the controller's, counted from its start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WireKnobs {
    /// Every data package leaves so much later (ms). In wall time only.
    pub latency_ms: f64,
    /// And up to so much later still, at random (ms). In wall time only.
    pub jitter_ms: f64,
    /// At this tick every RTDE connection is cut in the middle of a package; new ones are served.
    pub cut_at_tick: Option<u64>,
    /// No package leaves during these ticks, though connections stay; then the newest goes on.
    pub stalled: Option<Ticks>,
    /// The packages of these ticks never leave.
    pub skipped: Option<Ticks>,
    /// Input names that another client has taken already: who asks for them gets `IN_USE`. `*` is all of them.
    pub taken: Vec<String>,
    /// A data package leaves before the answer to START, as it may.
    pub data_races_start: bool,
    /// The RTDE server accepts no protocol version.
    pub refuses_protocol: bool,
    /// The controller stops the arm by itself at this tick.
    pub protective_stop_at_tick: Option<u64>,
    /// Somebody holds the emergency stop during these ticks; power is off after.
    pub emergency_stop: Option<Ticks>,
    /// Somebody stands in the safeguarded space during these ticks; the program pauses, and stays paused.
    pub safeguard_stop: Option<Ticks>,
    /// Reduced mode during these ticks.
    pub reduced: Option<Ticks>,
    /// The script's thread that reads the registers stands still during these ticks (ur_rtde's whole loop).
    pub reader_hangs: Option<Ticks>,
    /// The thread of probepath's script that moves the arm stands still during these ticks.
    pub mover_hangs: Option<Ticks>,
    /// The teach button is held during these ticks, whoever guides.
    pub teach_button: Option<Ticks>,
}

impl ControllerConfig {
    /// Whether every number can be what it says.
    pub(super) fn check(&self) -> Result<(), ControllerError> {
        let all = [
            ("unlock_after_s", self.unlock_after_s, 3600.0),
            ("remembers_s", self.remembers_s.unwrap_or(0.0), 1e6),
            ("knobs.latency_ms", self.knobs.latency_ms, 60_000.0),
            ("knobs.jitter_ms", self.knobs.jitter_ms, 60_000.0),
        ];
        for (field, value, high) in all {
            // Written so that NaN is refused as well.
            if !(value >= 0.0 && value <= high) {
                return Err(ControllerError::Config { field, value, low: 0.0, high });
            }
        }
        Ok(())
    }
}
