//! The UR e-series on its wire: RTDE on port 30004, the dashboard on 29999, scripts on 30002.
//!
//! The codecs are sans-IO: bytes in, packets out, and they serve both ends of the wire.

pub mod registers;
pub mod rtde;
pub mod script;
