//! [`UrCounts`]: what went over the wire, and what did not.

use probepath_frames::Span;

/// What went over the wire since the arm was first connected, and what did not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UrCounts {
    /// Data packages that came.
    pub packages: u64,
    /// Ticks of the controller for which no package came: it was overloaded, or the link was.
    pub gaps: u64,
    /// The longest run of such ticks.
    pub longest_gap: u64,
    /// Packages that came and were older than another by the time that we looked: we were late.
    pub late: u64,
    /// The oldest state that an exchange returned.
    pub oldest: Span,
    /// What the controller said in words.
    pub texts: u64,
    /// How often it was connected.
    pub connections: u64,
    /// How often it failed.
    pub faults: u64,
}
