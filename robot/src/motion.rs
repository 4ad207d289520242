//! Motions: what a controller is made of.

mod brake;
pub mod follow;
mod hold;
mod point_to_point;
pub mod spline;
pub mod timing;

pub use brake::Brake;
pub use hold::Hold;
pub use point_to_point::{NoMove, PointToPoint};
