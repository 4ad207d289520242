//! `[machine]`: where the ultrasound machine is on the network, how it is set, and whose clock it stamps by.

use std::fmt;

use probepath_us_capture::{SettingMm, igtl};
use serde::{Deserialize, Serialize};

use super::arm::is_host;
use super::line::{Wrong, positive, within};

/// `OpenIGTLink`'s own port.
pub const IGTL_PORT: u16 = igtl::PORT;

/// Where the ultrasound machine is.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum MachineAddress {
    /// Simulated in this process.
    #[default]
    Sim,
    /// An `OpenIGTLink` server that sends B-scans: `igtl://host`, `igtl://host:18944`.
    Igtl {
        /// Name or address on the network.
        host: String,
        /// Its port.
        port: u16,
    },
    /// There is none: the arm alone.
    None,
}

/// Whose clock a machine stamps its B-scans by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MachineClock {
    /// The arm's controller's: a B-scan's stamp is when it was formed.
    Arm,
    /// Its own: brought to the arm's by when B-scans arrive, so that they are stamped late by as long as they are under
    /// way; until somebody calibrated, that is taken to be `latency_ms`.
    #[default]
    Own,
}

impl MachineClock {
    /// As the wire's source has it.
    pub(super) const fn of_stamps(self) -> igtl::MachineClock {
        match self {
            Self::Arm => igtl::MachineClock::OfArm,
            Self::Own => igtl::MachineClock::Own,
        }
    }
}

/// The ultrasound machine of a cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MachineFile {
    /// `sim`, `igtl://host`, or `none`.
    pub address: MachineAddress,
    /// Only B-scans of the device of this name; any when there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// From the echoes to the arrival of the B-scan (ms).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latency_ms: Option<f64>,
    /// Whose clock it stamps by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock: Option<MachineClock>,
    /// How far the drawing of the probe's holder may be from the truth (mm): what is known of the image's place before
    /// anybody calibrated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub holder_error_mm: Option<f64>,
    /// What lies between grey 0 and 255 (dB), as its panel says it: the width of the beam is read from wires with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamic_range_db: Option<f64>,
    /// How it is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setting: Option<SettingMm>,
}

impl MachineFile {
    pub(super) fn check(&self) -> Result<(), Wrong> {
        match self.address {
            MachineAddress::Igtl { .. } => self.described(),
            MachineAddress::Sim | MachineAddress::None => self.says_nothing(),
        }
    }

    fn described(&self) -> Result<(), Wrong> {
        let missing = |field| Wrong::new(field, "is missing; a machine on its wire needs it");
        let latency_ms = self.latency_ms.ok_or_else(|| missing("machine.latency_ms"))?;
        within("machine.latency_ms", latency_ms, (0.0, 2000.0), "ms")?;
        let error_mm = self.holder_error_mm.ok_or_else(|| missing("machine.holder_error_mm"))?;
        within("machine.holder_error_mm", error_mm, (0.0, 20.0), "mm")?;
        if let Some(range_db) = self.dynamic_range_db {
            within("machine.dynamic_range_db", range_db, (20.0, 120.0), "dB")?;
        }
        can_be(self.setting.as_ref().ok_or_else(|| missing("machine.setting"))?)
    }

    fn says_nothing(&self) -> Result<(), Wrong> {
        let given = [
            ("machine.device", self.device.is_some()),
            ("machine.latency_ms", self.latency_ms.is_some()),
            ("machine.clock", self.clock.is_some()),
            ("machine.holder_error_mm", self.holder_error_mm.is_some()),
            ("machine.dynamic_range_db", self.dynamic_range_db.is_some()),
            ("machine.setting", self.setting.is_some()),
        ];
        let Some((field, _)) = given.into_iter().find(|(_, given)| *given) else { return Ok(()) };
        let why = format!(
            "is given, and the machine's address is \"{}\": the machine that is simulated in this process is described \
             under [simulated.machine]; for a machine on its wire write address = \"igtl://host\"",
            self.address
        );
        Err(Wrong::new(field, why))
    }
}

/// Whether a machine can be set so.
fn can_be(setting: &SettingMm) -> Result<(), Wrong> {
    let field = |name: &str| format!("machine.setting.{name}");
    within(&field("depth_mm"), setting.depth_mm, (5.0, 400.0), "mm")?;
    within(&field("focus_mm"), setting.focus_mm, (0.5, 400.0), "mm")?;
    within(&field("window_top_mm"), setting.window_top_mm, (0.0, setting.depth_mm), "mm")?;
    // What reading rounds is no window beyond the depth.
    let left_mm = setting.depth_mm - setting.window_top_mm + 1e-6;
    within(&field("window_height_mm"), setting.window_height_mm, (1.0, left_mm), "mm")?;
    within(&field("window_width_mm"), setting.window_width_mm, (1.0, 400.0), "mm")?;
    for (name, mm, side_mm) in [
        ("pixel_x_mm", setting.pixel_x_mm, setting.window_width_mm),
        ("pixel_y_mm", setting.pixel_y_mm, setting.window_height_mm),
    ] {
        positive(&field(name), mm)?;
        within(&field(name), mm, (1e-3, side_mm / 8.0), "mm")?;
    }
    Ok(())
}

impl TryFrom<String> for MachineAddress {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let wrong = || {
            format!(
                "a machine's address is \"sim\", \"none\", \"igtl://host\" or \"igtl://host:{IGTL_PORT}\"; found {text:?}"
            )
        };
        match text.as_str() {
            "sim" => return Ok(Self::Sim),
            "none" => return Ok(Self::None),
            _ => {}
        }
        let rest = text.strip_prefix("igtl://").ok_or_else(wrong)?;
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        let (host, port) = match rest.split_once(':') {
            None => (rest, IGTL_PORT),
            Some((host, port)) => (host, port.parse().ok().filter(|port| *port > 0).ok_or_else(wrong)?),
        };
        if is_host(host) { Ok(Self::Igtl { host: host.to_owned(), port }) } else { Err(wrong()) }
    }
}

impl From<MachineAddress> for String {
    fn from(address: MachineAddress) -> Self {
        address.to_string()
    }
}

impl fmt::Display for MachineAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sim => f.write_str("sim"),
            Self::None => f.write_str("none"),
            Self::Igtl { host, port: IGTL_PORT } => write!(f, "igtl://{host}"),
            Self::Igtl { host, port } => write!(f, "igtl://{host}:{port}"),
        }
    }
}
