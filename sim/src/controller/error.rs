//! Why a simulated controller cannot start.

use std::net::IpAddr;

use thiserror::Error;

/// Why a simulated controller cannot start.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ControllerError {
    /// A port could not be had.
    #[error(
        "the simulated controller cannot listen on {host}:{port} ({what}): {source}; stop what listens there, or take \
         another loopback address (127.x.y.z)"
    )]
    Port {
        /// The address.
        host: IpAddr,
        /// The port.
        port: u16,
        /// What would be served there.
        what: &'static str,
        /// Why not.
        source: std::io::Error,
    },
    /// The arm is none that a UR controller drives.
    #[error("the cell's arm has {joints} joints and a UR controller drives 6; take the UR5e")]
    Joints {
        /// How many it has.
        joints: usize,
    },
    /// A number of the set-up that cannot be.
    #[error("{field} is {value}; it must be a finite number from {low} to {high}")]
    Config {
        /// Which.
        field: &'static str,
        /// What was given.
        value: f64,
        /// The least.
        low: f64,
        /// The most.
        high: f64,
    },
    /// No thread could be started.
    #[error("the simulated controller's thread {name} did not start: {source}")]
    Thread {
        /// Which.
        name: String,
        /// Why not.
        source: std::io::Error,
    },
}
