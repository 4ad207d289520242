//! [`ZeroWatch`]: the sensor's zero, watched in the air and taken only there.

use probepath_frames::{Base, Direction, Point, Pose, Probe, Span, Wrench};

use super::{Tool, ToolError};

/// When the probe counts as in the air, and how much drift is too much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZeroSettings {
    /// A force (N) above which something touches. 0.8.
    pub touch_n: f64,
    /// How far the probe has to be from where it was last touched (m). 0.005.
    pub away_m: f64,
    /// How long it has to be still and untouched (s). 0.5.
    pub still_s: f64,
    /// Still is what stays within this distance (m). 0.0005.
    pub still_m: f64,
    /// A drift (N) that should be zeroed before the next contact. 0.3.
    pub drift_n: f64,
}

impl Default for ZeroSettings {
    fn default() -> Self {
        Self { touch_n: 0.8, away_m: 0.005, still_s: 0.5, still_m: 0.0005, drift_n: 0.3 }
    }
}

/// What the watch makes of a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Air {
    /// Something touches, or did so here.
    Touched {
        /// How hard (N), the tool taken off.
        force_n: f64,
    },
    /// In the air, but not still for long enough.
    Settling,
    /// In the air and still: what is read beyond the tool is drift.
    Free {
        /// How far the sensor's force has drifted (N).
        drift_n: f64,
        /// Whether that is too much.
        too_far: bool,
    },
}

/// Watches the zero.
#[derive(Clone, Copy, Debug)]
pub struct ZeroWatch {
    tool: Tool,
    down: Direction<Base>,
    settings: ZeroSettings,
    dt: f64,
    /// Where something touched last.
    touched: Option<Point<Base>>,
    /// Where it has been still from.
    anchor: Option<Point<Base>>,
    still_s: f64,
    /// Mean of what was read beyond the tool while still, and of how many states.
    beyond: Wrench<Probe>,
    count: f64,
    air: Air,
}

impl ZeroWatch {
    /// With a tool that was identified; `down` is where things fall to.
    pub fn new(tool: Tool, down: Direction<Base>, settings: ZeroSettings, period: Span) -> Self {
        Self {
            tool,
            down,
            settings,
            dt: period.seconds(),
            touched: None,
            anchor: None,
            still_s: 0.0,
            beyond: Wrench::zero(),
            count: 0.0,
            air: Air::Settling,
        }
    }

    /// One state: what the sensor read, nothing taken off, and where the probe was.
    pub fn step(&mut self, read: &Wrench<Probe>, base_from_probe: &Pose<Base, Probe>) -> Air {
        let beyond = self.tool.touching(read, base_from_probe, &self.down);
        let (here, force_n) = (base_from_probe.origin(), beyond.force.norm());
        // What is no number counts as a touch.
        if force_n >= self.settings.touch_n || force_n.is_nan() {
            self.touched = Some(here);
        }
        let near = self.touched.is_some_and(|touched| touched.distance(&here) < self.settings.away_m);
        let still = self.anchor.is_some_and(|anchor| anchor.distance(&here) < self.settings.still_m);
        if near || !still {
            self.anchor = Some(here);
            (self.still_s, self.count, self.beyond) = (0.0, 0.0, Wrench::zero());
        } else {
            self.average(beyond);
        }
        self.air = if near { Air::Touched { force_n } } else { self.judged() };
        self.air
    }

    fn average(&mut self, beyond: Wrench<Probe>) {
        self.still_s += self.dt;
        self.count += 1.0;
        let share = 1.0 / self.count;
        let toward = |mean: nalgebra::Vector3<f64>, now: nalgebra::Vector3<f64>| mean + (now - mean) * share;
        self.beyond =
            Wrench::new(toward(self.beyond.force, beyond.force), toward(self.beyond.torque, beyond.torque));
    }

    fn judged(&self) -> Air {
        if self.still_s < self.settings.still_s {
            return Air::Settling;
        }
        let drift_n = self.beyond.force.norm();
        Air::Free { drift_n, too_far: drift_n > self.settings.drift_n }
    }

    /// Takes what is read now for the zero: the bias changes, the weight stays.
    ///
    /// # Errors
    /// When the probe touches something, or did so here, or was not still for long enough.
    pub fn zero(&mut self) -> Result<Tool, ToolError> {
        let why = match self.air {
            Air::Free { .. } => {
                self.tool.bias = self.tool.bias + self.beyond;
                (self.still_s, self.count, self.beyond) = (0.0, 0.0, Wrench::zero());
                self.air = Air::Settling;
                return Ok(self.tool);
            }
            Air::Touched { force_n } => format!("{force_n:.2} N act on it, or it was touched here"),
            Air::Settling => format!("it was still for {:.2} s only", self.still_s),
        };
        Err(ToolError::NotInAir { why, still_s: self.settings.still_s })
    }

    /// What it goes by.
    pub const fn settings(&self) -> &ZeroSettings {
        &self.settings
    }

    /// The tool as it is known now.
    pub const fn tool(&self) -> &Tool {
        &self.tool
    }
}
