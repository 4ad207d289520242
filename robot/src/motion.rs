//! Motions: what a controller is made of.

pub mod follow;
pub mod spline;
