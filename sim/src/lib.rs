//! A world to scan, from one seed, in simulated time: legs and phantoms whose lumen is known exactly, and the
//! B-scans that an ultrasound machine would make of them.
//!
//! ```
//! use probepath_sim::{Leg, LegConfig};
//!
//! let leg = Leg::new(&LegConfig::default(), 1);
//! let stenosis = leg.main().stenoses()[0];
//! let (skin, outward) = leg.skin_over(stenosis.at_m);
//! assert!(leg.surface(skin.moved(outward, 0.01)).0 > 0.0099);
//! assert_eq!(leg.segment(leg.main().centre(stenosis.at_m)).map(|name| name.code()), Some("SFA proximal"));
//! ```
//!
//! The cell around them, driven tick by tick:
//!
//! ```
//! use probepath_robot::{Arm, Command};
//! use probepath_sim::{CellConfig, SimulatedCell};
//! use probepath_us_capture::BScanSource;
//!
//! let cell = SimulatedCell::new(&CellConfig::default(), 1)?;
//! let (mut arm, mut machine) = (cell.arm(), cell.machine());
//! let state = arm.exchange(&Command::Stay).expect("it answers");
//! assert!(machine.poll(state.stamp).expect("it is switched on").is_none(), "nothing arrives within 2 ms");
//! # Ok::<(), probepath_sim::CellError>(())
//! ```
//!
//! The nouns: a [`Vessel`] is a tube with an exact lumen; a [`Leg`] or a [`VascularPhantom`] is skin and vessels, a
//! [`WireTank`] a calibration phantom in water;
//! [`Tissue`] is what the beam meets, and a [`Renderer`] makes the B-scan of it.
//!
//! What it does not do: know any algorithm under test. It leans on none, and its truth goes to tests and reports only.

mod arm;
mod case;
mod cell;
pub mod controller;
mod disturbance;
mod hand;
pub mod igtl;
mod knobs;
mod leg;
mod machine;
mod phantom;
mod random;
mod skin;
mod spline;
mod subject;
mod tank;
mod tissue;
mod ultrasound;
mod vessel;

pub use arm::{KinematicError, SensorConfig, SimulatedArm, ToolConfig};
pub use case::Case;
pub use cell::{
    ArmConfig, ArmKind, CellConfig, CellError, MachineConfig, Moment, Nominal, SimulatedCell, SimulatedHand,
    SubjectConfig, TICK, Touch, Truth, Window,
};
pub use disturbance::DisturbanceConfig;
pub use hand::HandConfig;
pub use knobs::{ArmKnobs, Interval, Knobs, MachineKnobs, Ticks};
pub use leg::{Leg, LegConfig, Side};
pub use machine::SimulatedMachine;
pub use phantom::{PhantomConfig, VascularPhantom};
pub use skin::{HALF_FACE_X_M, HALF_FACE_Y_M, SkinConfig, Surface};
pub use subject::Subject;
pub use tank::{Bench, WirePhantomConfig, WireTank};
pub use tissue::{ASSUMED_M_S, Facet, Homogeneous, Medium, Reflector, Strand, Tissue};
pub use ultrasound::{
    Contact, DoubleEcho, ImagingConfig, ImagingError, Overlay, Renderer, Reverberation, Shadow, settings,
};
pub use vessel::{Calibre, Segment, SegmentName, Stenosis, SurfaceGrid, Vessel};
