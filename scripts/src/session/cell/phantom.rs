//! `[phantom]`: the phantom of wires on the table of a cell on its wire.

use std::path::Path;

use probepath_frames::{Phantom, Pose, World};
use probepath_us_capture::phantom::WirePhantom;
use serde::{Deserialize, Serialize};

use super::line::{Wrong, within};
use super::pose::PoseFile;

/// Water that a phantom stands in (degrees Celsius).
const WATER_CELSIUS: (f64, f64) = (0.0, 60.0);

/// A phantom of wires in water, where a tape measure finds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhantomFile {
    /// One that comes along, by its name, or its drawing's file, from the folder of the cell's file.
    pub model: String,
    /// How warm the water is (degrees Celsius).
    pub water_celsius: f64,
    /// Where it stands.
    pub world_from_phantom: PoseFile,
}

/// A phantom on the table, as its drawing and a tape measure have it.
#[derive(Clone, Debug)]
pub(in crate::session) struct OnTable {
    pub(in crate::session) phantom: WirePhantom,
    pub(in crate::session) world_from_phantom: Pose<World, Phantom>,
    pub(in crate::session) water_celsius: f64,
}

impl PhantomFile {
    pub(super) fn check(&self) -> Result<(), Wrong> {
        within("phantom.water_celsius", self.water_celsius, WATER_CELSIUS, "degrees Celsius")?;
        self.place().map(drop)
    }

    fn place(&self) -> Result<Pose<World, Phantom>, Wrong> {
        self.world_from_phantom.pose("phantom.world_from_phantom")
    }

    /// The phantom itself.
    pub(super) fn on_table(&self, folder: &Path) -> Result<OnTable, Wrong> {
        let read = || {
            WirePhantom::read(&folder.join(&self.model)).map_err(|error| {
                let shipped = WirePhantom::shipped_names().collect::<Vec<_>>().join(", ");
                Wrong::new(
                    "phantom.model",
                    format!("is {:?}: {error}; those that come along are {shipped}", self.model),
                )
            })
        };
        let phantom = WirePhantom::shipped(&self.model).map_or_else(read, Ok)?;
        let (world_from_phantom, water_celsius) = (self.place()?, self.water_celsius);
        Ok(OnTable { phantom, world_from_phantom, water_celsius })
    }
}
