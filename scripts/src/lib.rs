//! The session: one façade over the whole system, and the protocols that drive it.

mod options;
pub mod quantity;
pub mod report;
