//! `[arm]`: where the arm is on the network, which one it is, and what it carries.

use std::path::Path;

use probepath_frames::{Base, Flange, Pose, Probe, World};
use probepath_recon::Tracking;
use probepath_robot::drivers::Address;
use probepath_robot::{Model, ModelError, PANDA_URDF, UR5E_URDF};
use serde::{Deserialize, Serialize};

use super::line::{Wrong, within};
use super::pose::PoseFile;

/// No arm that is driven here carries more (kg).
const MOST_PAYLOAD_KG: f64 = 30.0;
/// The centre of gravity of no probe's holder is further from the flange (mm).
const MOST_LEVER_MM: f64 = 500.0;
/// An arm that is farther off than this scans nothing (mm).
const MOST_ERROR_MM: f64 = 5.0;
/// A guard that waits less would trip over one tick that is late, one that waits longer could not have the arm at rest
/// within 100 ms (ms).
const HEARTBEAT_MS: (f64, f64) = (4.0, 80.0);

/// The arm of a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmFile {
    /// `sim` or `ur://host`.
    #[serde(with = "in_words")]
    pub address: Address,
    /// `ur5e`, `seven_joint`, or a URDF file, relative to the cell file's folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// The URDF's link that is `Base`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_link: Option<String>,
    /// The URDF's link that is `Flange`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tip_link: Option<String>,
    /// What hangs on the flange (kg).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<f64>,
    /// Its centre of gravity in the flange (mm).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_of_gravity_mm: Option<[f64; 3]>,
    /// Mean distance between where the probe is and where the model has it, over the workspace (mm).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy_mm: Option<f64>,
    /// How near it comes to the same place again (mm; the pose repeatability of ISO 9283).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeatability_mm: Option<f64>,
    /// The longest time between two states, and the oldest state that is believed (ms).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heartbeat_ms: Option<f64>,
    /// Whether the controller keeps the wall's time or, as `probepath simulate` can, waits for every command.
    #[serde(skip_serializing_if = "ControllerTime::is_wall")]
    pub time: ControllerTime,
    /// Where the arm stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world_from_base: Option<PoseFile>,
    /// Where the probe is on the flange.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flange_from_probe: Option<PoseFile>,
}

/// Whose time a controller keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerTime {
    /// The wall's: 500 ticks a second, whoever listens.
    #[default]
    Wall,
    /// A simulated controller's that waits for the command of every tick.
    Simulated,
}

impl ControllerTime {
    #[allow(clippy::trivially_copy_pass_by_ref, reason = "serde hands a reference")]
    const fn is_wall(&self) -> bool {
        matches!(self, Self::Wall)
    }
}

/// Where things are on an arm that is reached over its wire.
#[derive(Clone, Debug)]
pub(super) struct ArmPlaces {
    pub(super) world_from_base: Pose<World, Base>,
    pub(super) flange_from_probe: Pose<Flange, Probe>,
}

/// What hangs on the flange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Carried {
    pub(super) payload_kg: f64,
    /// In the flange (m).
    pub(super) centre_of_gravity_m: [f64; 3],
}

impl Default for ArmFile {
    fn default() -> Self {
        Self {
            address: Address::Simulated,
            model: None,
            base_link: None,
            tip_link: None,
            payload_kg: None,
            centre_of_gravity_mm: None,
            accuracy_mm: None,
            repeatability_mm: None,
            heartbeat_ms: None,
            time: ControllerTime::Wall,
            world_from_base: None,
            flange_from_probe: None,
        }
    }
}

impl ArmFile {
    pub(super) fn check(&self) -> Result<(), Wrong> {
        if let Some(heartbeat_ms) = self.heartbeat_ms {
            within("arm.heartbeat_ms", heartbeat_ms, HEARTBEAT_MS, "ms")?;
        }
        match self.address {
            Address::Simulated => self.says_nothing_of_its_own(),
            Address::Ur { .. } => {
                self.carried()?;
                self.places()?;
                self.tracking()?;
                self.names_a_model()
            }
        }
    }

    /// The arm that is simulated in this process is described under `[simulated]`, and nowhere else.
    fn says_nothing_of_its_own(&self) -> Result<(), Wrong> {
        let given = [
            ("arm.model", self.model.is_some()),
            ("arm.base_link", self.base_link.is_some()),
            ("arm.tip_link", self.tip_link.is_some()),
            ("arm.payload_kg", self.payload_kg.is_some()),
            ("arm.centre_of_gravity_mm", self.centre_of_gravity_mm.is_some()),
            ("arm.accuracy_mm", self.accuracy_mm.is_some()),
            ("arm.repeatability_mm", self.repeatability_mm.is_some()),
            ("arm.time", self.time != ControllerTime::Wall),
            ("arm.world_from_base", self.world_from_base.is_some()),
            ("arm.flange_from_probe", self.flange_from_probe.is_some()),
        ];
        let Some((field, _)) = given.into_iter().find(|(_, given)| *given) else { return Ok(()) };
        let why = "is given, and the arm's address is \"sim\": the arm that is simulated in this process is described \
                   under [simulated]; for an arm on its wire write address = \"ur://host\"";
        Err(Wrong::new(field, why))
    }

    fn names_a_model(&self) -> Result<(), Wrong> {
        let model = needed(self.model.as_ref(), "arm.model")?;
        let (field, ok) = match is_shipped(model) {
            true => ("arm.base_link", self.base_link.is_none() && self.tip_link.is_none()),
            false => ("arm.model", self.base_link.is_some() && self.tip_link.is_some()),
        };
        let why = "does not go together: a URDF file needs base_link and tip_link, the models that come along (ur5e, \
                   seven_joint) have their own";
        if ok { Ok(()) } else { Err(Wrong::new(field, why)) }
    }

    /// Where things are, all of it given and possible.
    pub(super) fn places(&self) -> Result<ArmPlaces, Wrong> {
        let world_from_base = needed(self.world_from_base.as_ref(), "arm.world_from_base")?;
        let flange_from_probe = needed(self.flange_from_probe.as_ref(), "arm.flange_from_probe")?;
        Ok(ArmPlaces {
            world_from_base: world_from_base.pose("arm.world_from_base")?,
            flange_from_probe: flange_from_probe.pose("arm.flange_from_probe")?,
        })
    }

    /// How well it knows where the probe is, where its file says it: both figures, or neither.
    pub(super) fn tracking(&self) -> Result<Option<Tracking>, Wrong> {
        let (accuracy_mm, repeatability_mm) = match (self.accuracy_mm, self.repeatability_mm) {
            (None, None) => return Ok(None),
            (Some(_), None) => {
                return Err(Wrong::new("arm.accuracy_mm", "is given without repeatability_mm"));
            }
            (None, Some(_)) => {
                return Err(Wrong::new("arm.repeatability_mm", "is given without accuracy_mm"));
            }
            (Some(accuracy_mm), Some(repeatability_mm)) => (accuracy_mm, repeatability_mm),
        };
        within("arm.accuracy_mm", accuracy_mm, (0.0, MOST_ERROR_MM), "mm")?;
        within("arm.repeatability_mm", repeatability_mm, (0.0, MOST_ERROR_MM), "mm")?;
        Ok(Some(Tracking { accuracy_m: accuracy_mm * 1e-3, repeatability_m: repeatability_mm * 1e-3 }))
    }

    /// What hangs on the flange, given and possible.
    pub(super) fn carried(&self) -> Result<Carried, Wrong> {
        let payload_kg = *needed(self.payload_kg.as_ref(), "arm.payload_kg")?;
        within("arm.payload_kg", payload_kg, (0.0, MOST_PAYLOAD_KG), "kg")?;
        let centre = *needed(self.centre_of_gravity_mm.as_ref(), "arm.centre_of_gravity_mm")?;
        for mm in centre {
            within("arm.centre_of_gravity_mm", mm, (-MOST_LEVER_MM, MOST_LEVER_MM), "mm")?;
        }
        Ok(Carried { payload_kg, centre_of_gravity_m: centre.map(|mm| mm / 1e3) })
    }

    /// The arm's model and its URDF's text.
    pub(super) fn model(&self, urdf: Option<&str>, folder: &Path) -> Result<(Model, String), ModelError> {
        let name = self.model.as_deref().unwrap_or_default();
        match name {
            "ur5e" => return Ok((Model::ur5e(), UR5E_URDF.to_owned())),
            "seven_joint" => return Ok((Model::seven_joint(), PANDA_URDF.to_owned())),
            _ => {}
        }
        let read = || {
            let file = folder.join(name);
            std::fs::read_to_string(&file).map_err(|error| ModelError::Unreadable {
                file: file.display().to_string(),
                why: error.to_string(),
            })
        };
        let text = urdf.map_or_else(read, |text| Ok(text.to_owned()))?;
        let ends = [&self.base_link, &self.tip_link].map(|link| link.as_deref().unwrap_or_default());
        let (model, _) = Model::from_urdf(&text, name, ends[0], ends[1])?;
        Ok((model, text))
    }
}

fn is_shipped(model: &str) -> bool {
    matches!(model, "ur5e" | "seven_joint")
}

/// A field that an arm on its wire has to have.
fn needed<'a, T>(value: Option<&'a T>, field: &str) -> Result<&'a T, Wrong> {
    value.ok_or_else(|| Wrong::new(field, "is missing; an arm on its wire needs it"))
}

/// A name or an address without port, path or blanks.
pub(super) fn is_host(host: &str) -> bool {
    let letter = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    !host.is_empty() && host.chars().all(letter)
}

/// An address as it is written.
mod in_words {
    use probepath_robot::drivers::Address;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(address: &Address, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(address)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Address, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}
