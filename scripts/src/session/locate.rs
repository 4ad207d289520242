//! Where the phantom of a calibration stands.

use probepath_frames::{Phantom, Pose, World};
use probepath_us_capture::phantom::WirePhantom;

use super::{Session, SessionError};

/// How well a tape measure finds a phantom on a table: each coordinate (m), and about each axis (rad).
const MEASURED_SD_M: f64 = 3e-3;
const MEASURED_SD_RAD: f64 = 0.03;

/// A phantom of wires whose place is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The phantom, as it was drawn.
    pub phantom: WirePhantom,
    /// Where it stands.
    pub world_from_phantom: Pose<World, Phantom>,
    /// How well that is known: each coordinate (m).
    pub sd_m: f64,
    /// And its orientation, about each axis (rad).
    pub sd_rad: f64,
    /// How warm the water around it is (degrees Celsius).
    pub water_celsius: f64,
}

impl Session {
    /// The cell's wire phantom where its file says that it stands.
    ///
    /// # Errors
    /// When the cell has none.
    pub fn phantom_as_measured(&mut self) -> Result<Located, SessionError> {
        let bench = self.cell.bench.clone().ok_or(SessionError::NoPhantom)?;
        self.say(&format!(
            "Phantom {}: {} wires, in water of {:.1} degrees Celsius, where the cell's file says that it stands.",
            bench.phantom.name,
            bench.phantom.wires.len(),
            bench.water_celsius
        ));
        Ok(Located {
            phantom: bench.phantom,
            world_from_phantom: bench.world_from_phantom,
            sd_m: MEASURED_SD_M,
            sd_rad: MEASURED_SD_RAD,
            water_celsius: bench.water_celsius,
        })
    }
}
