//! The session: one façade over the whole system, and the protocols that drive it.
//!
//! ```no_run
//! use std::sync::Arc;
//! use probepath_scripts::{Operator, ScanRequest};
//!
//! let request = ScanRequest { protocol: None, cell: None, seed: 1, out: "out".into(), date: None };
//! let report = request.run(&Operator::new(), Arc::new(()))?;
//! println!("{report}");
//! # Ok::<(), probepath_scripts::ScanError>(())
//! ```
//!
//! The nouns: a [`Session`](session::Session) connects, teaches, scans, reconstructs and reports; a
//! [`Protocol`](protocol::Protocol) says in which order, as a Rhai script with typed quantities; a
//! [`Report`](report::Report) is what a reader holds. [`offline`] works without an arm, [`validate`] measures.
//!
//! What it does not do: know any screen or network. It tells its progress to whoever listens.

pub mod dicom;
pub mod offline;
mod options;
mod progress;
pub mod protocol;
pub mod quantity;
pub mod report;
mod request;
pub mod session;
pub mod validate;

pub use probepath_recon::View;
pub use probepath_robot::Operator;
pub use progress::Progress;
pub use request::{ScanError, ScanRequest};
