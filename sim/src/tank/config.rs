//! The tank's numbers, as the cell's file says them.

use std::path::Path;

use probepath_us_capture::phantom::WirePhantom;
use serde::{Deserialize, Serialize};

use crate::cell::CellError;

/// A wire phantom in water. Lengths of the plates and the echoes are ours; [P1] gives the wires and the distilled
/// water at room temperature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WirePhantomConfig {
    /// Which phantom: the name of one that ships with the project, the path of a phantom's file, or the text of one.
    pub phantom: String,
    /// Which way of the phantom's own axes is up when it stands. Unless said, square to its first Z, toward the
    /// positive of its own axes; z where it has no Zs.
    pub up: Option<[f64; 3]>,
    /// How far each hole was drilled beside its drawing, each way: one standard deviation (mm).
    pub hole_error_mm: f64,
    /// Where the wires' middle stands on the table: World x and z (mm).
    pub at_mm: [f64; 2],
    /// How far it is turned about the vertical (degrees).
    pub turn_deg: f64,
    /// How far it stands from where the software is told it does (mm), in a direction from the seed.
    pub place_error_mm: f64,
    /// And how far it is turned from that (degrees).
    pub place_error_deg: f64,
    /// Temperature of the water (degrees Celsius).
    pub water_celsius: f64,
    /// Water over the highest wire (mm).
    pub water_above_mm: f64,
    /// The container's bottom: over the table, and under the lowest wire (mm).
    pub height_mm: f64,
    /// See `height_mm`.
    pub bottom_below_mm: f64,
    /// How far the plates stand out over the highest wire (mm).
    pub plates_above_mm: f64,
    /// Amplitudes of the echoes of a wire, a plate and the bottom that the beam meets squarely (1 is homogeneous
    /// tissue).
    pub wire_echo: f64,
    /// See `wire_echo`.
    pub plate_echo: f64,
    /// See `wire_echo`.
    pub bottom_echo: f64,
    /// How far the ball pointer's tip is from where its drawing has it (mm), in a direction from the seed.
    pub pointer_error_mm: f64,
    /// How far from a landmark's middle the pointer's tip comes to rest, each way: one standard deviation (mm).
    pub touch_error_mm: f64,
}

impl Default for WirePhantomConfig {
    fn default() -> Self {
        Self {
            phantom: "z-19".into(),
            up: None,
            hole_error_mm: 0.05,
            at_mm: [0.0, 0.0],
            turn_deg: 4.0,
            place_error_mm: 2.0,
            place_error_deg: 1.0,
            water_celsius: 20.0,
            water_above_mm: 60.0,
            height_mm: 20.0,
            bottom_below_mm: 12.0,
            plates_above_mm: 10.0,
            wire_echo: 4.0,
            plate_echo: 6.0,
            bottom_echo: 8.0,
            pointer_error_mm: 0.5,
            touch_error_mm: 0.1,
        }
    }
}

impl WirePhantomConfig {
    /// The phantom as it was drawn.
    ///
    /// # Errors
    /// When none of that name ships, and it is neither the text nor the file of one.
    pub fn phantom(&self) -> Result<WirePhantom, CellError> {
        let named = self.phantom.as_str();
        if let Some(shipped) = WirePhantom::shipped(named) {
            return Ok(shipped);
        }
        let read = match named.contains('\n') {
            true => WirePhantom::from_toml(named),
            false => WirePhantom::read(Path::new(named)),
        };
        read.map_err(|source| {
            let shipped = WirePhantom::shipped_names().collect::<Vec<_>>().join(", ");
            CellError::Phantom {
                named: named.lines().next().unwrap_or("").into(),
                shipped,
                source: source.into(),
            }
        })
    }

    /// Every number, with the least and the most that it may be.
    pub(crate) fn numbers(&self) -> [(&'static str, f64, f64, f64); 16] {
        [
            ("hole_error_mm", self.hole_error_mm, 0.0, 2.0),
            ("at_mm[0]", self.at_mm[0], -500.0, 500.0),
            ("at_mm[1]", self.at_mm[1], -500.0, 500.0),
            ("turn_deg", self.turn_deg, -180.0, 180.0),
            ("place_error_mm", self.place_error_mm, 0.0, 50.0),
            ("place_error_deg", self.place_error_deg, 0.0, 45.0),
            ("water_celsius", self.water_celsius, 0.0, 95.0),
            ("water_above_mm", self.water_above_mm, 0.0, 500.0),
            ("height_mm", self.height_mm, 0.0, 500.0),
            ("bottom_below_mm", self.bottom_below_mm, 0.0, 500.0),
            ("plates_above_mm", self.plates_above_mm, 0.0, 100.0),
            ("wire_echo", self.wire_echo, 0.0, 1000.0),
            ("plate_echo", self.plate_echo, 0.0, 1000.0),
            ("bottom_echo", self.bottom_echo, 0.0, 1000.0),
            ("pointer_error_mm", self.pointer_error_mm, 0.0, 20.0),
            ("touch_error_mm", self.touch_error_mm, 0.0, 20.0),
        ]
    }
}

/// Asks `within` about every number, by its name in the cell's file.
pub(crate) fn refuse(
    config: &WirePhantomConfig,
    within: impl Fn(&str, f64, f64, f64) -> Result<(), CellError>,
) -> Result<(), CellError> {
    for (field, value, low, high) in config.numbers() {
        within(&format!("subject.wire_phantom.{field}"), value, low, high)?;
    }
    let Some(up) = config.up else { return Ok(()) };
    within("subject.wire_phantom.up (its length)", nalgebra::Vector3::from(up).norm(), 0.5, 2.0)
}
