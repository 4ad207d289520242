//! Knobs to fail: what goes wrong in the simulated cell, and when. All off by default.

use serde::{Deserialize, Serialize};

/// What fails.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Knobs {
    /// What fails in the arm.
    pub arm: ArmKnobs,
    /// What fails in the ultrasound machine.
    pub machine: MachineKnobs,
}

/// What fails in the arm; ticks are those of the world, counted from its beginning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmKnobs {
    /// The connection is lost at this tick, until the arm is connected again.
    pub connection_lost_at_tick: Option<u64>,
    /// The arm stops by itself at this tick, until it is connected again.
    pub protective_stop_at_tick: Option<u64>,
    /// Ticks whose states never arrive.
    pub skipped: Option<Ticks>,
    /// Ticks at which the wrench is no number.
    pub wrench_not_a_number: Option<Ticks>,
}

/// Some ticks in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ticks {
    /// The first.
    pub from_tick: u64,
    /// How many.
    pub count: u64,
}

impl Ticks {
    /// Whether `tick` is one of them.
    pub fn has(&self, tick: u64) -> bool {
        tick >= self.from_tick && tick - self.from_tick < self.count
    }
}

/// What fails in the ultrasound machine; times are those of the exam's clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MachineKnobs {
    /// Fraction of the B-scans that never arrive, 0 to 1.
    pub dropped: f64,
    /// No B-scan is formed while this lasts.
    pub stall: Option<Interval>,
    /// The picture stays what it was while this lasts; numbers and stamps go on.
    pub frozen: Option<Interval>,
    /// The connection is lost from here on (s).
    pub connection_lost_at_s: Option<f64>,
    /// How much longer the latency truly is than the cell file says (ms); negative is shorter.
    pub unknown_latency_ms: f64,
}

/// A while.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// Its beginning (s).
    pub from_s: f64,
    /// Its length (s).
    pub lasts_s: f64,
}

impl Interval {
    /// Whether `seconds` lies in it.
    pub fn has(&self, seconds: f64) -> bool {
        seconds >= self.from_s && seconds < self.from_s + self.lasts_s
    }
}
