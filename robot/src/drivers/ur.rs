//! The UR e-series on its wire: RTDE on port 30004, the dashboard on 29999, scripts on 30002; on 30001 it says in words
//! why it stopped.
//!
//! [`UrArm`] is the arm behind [`Arm`](crate::Arm); [`UrSettings`] say what it carries; [`script`] is our half on the
//! controller, and [`registers`] what both halves say to each other; [`signs`] has the table of frames and signs. The
//! codecs ([`rtde`], [`lines`], [`primary`]) are sans-IO: bytes in, packets out, and they serve both ends of the wire.
//!
//! It needs PolyScope 5.10 or later in remote control. It never switches an arm on, releases a brake, clears
//! a violation of the safety system or plays another's program: those are a person's, at the pendant.

mod arm;
mod clock;
mod connect;
mod counts;
pub mod dashboard;
mod error;
pub mod lines;
mod link;
mod measured;
pub mod primary;
pub mod registers;
pub mod rtde;
pub mod safety;
pub mod script;
mod settings;
pub mod signs;
mod socket;
mod words;

pub use arm::UrArm;
pub use connect::Connected;
pub use counts::UrCounts;
pub use error::UrError;
pub use settings::UrSettings;
