//! Where things are, and when: coordinate systems as types, and integer time of a named clock.
//!
//! ```
//! use probepath_frames::{Base, Image, Point, Pose, Probe, nalgebra::{Isometry3, Vector3}};
//!
//! // FRAMES: the flange's forward kinematics and the calibration, as bare numbers from a test.
//! let base_from_probe = Pose::<Base, Probe>::assume(Isometry3::translation(0.4, 0.0, 0.2));
//! let probe_from_image = Pose::<Probe, Image>::assume(Isometry3::translation(-0.02, 0.0, 0.0));
//! let lumen = Point::<Image>::new(0.02, 0.034, 0.0);
//!
//! let in_base: Point<Base> = base_from_probe * probe_from_image * lumen;
//! assert!((in_base.vector() - Vector3::new(0.4, 0.034, 0.2)).norm() < 1e-12);
//! ```
//!
//! The nouns: a [`Pose<A, B>`](Pose) is system B defined in A (`a_from_b`, equation `A_T_B`); a [`Point`],
//! [`Direction`], [`Twist`] or [`Wrench`] carries the system it is written in; a [`Stamp`] is an instant of a
//! named clock; a [`Track`] is a pose that moves. The systems themselves are in [`systems`].
//!
//! What it does not do: know any robot, image or file. SI units throughout: metres, radians, seconds, newtons.

mod clock_offset;
mod error;
mod named;
mod pose;
mod se3;
mod stamp;
pub mod systems;
mod track;
mod vectors;
mod wrench;

pub use clock_offset::ClockOffset;
pub use error::{FrameError, TrackError};
pub use nalgebra;
pub use named::NamedPose;
pub use pose::Pose;
pub use stamp::{ArmClock, Clock, ExamClock, HostClock, ImageClock, Span, Stamp};
pub use systems::{Base, Flange, Frame, Image, Leg, Phantom, Probe, World};
pub use track::Track;
pub use vectors::{Direction, Point};
pub use wrench::{Twist, Wrench};
