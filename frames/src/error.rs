//! What can be wrong with a pose or a track.

use thiserror::Error;

/// Numbers that are not a pose or a direction.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FrameError {
    /// A number is NaN or infinite.
    #[error("{what} has a number that is not finite")]
    NotFinite {
        /// Which pose.
        what: String,
    },
    /// A 4x4 matrix whose last row is not `0 0 0 1`.
    #[error("{what}: the last row of the matrix is not 0 0 0 1; is it stored column by column?")]
    LastRow {
        /// Which pose.
        what: String,
    },
    /// A matrix that scales, shears or mirrors.
    #[error(
        "{what} is not rigid: its columns are {off:.2e} from orthonormal, its determinant is {determinant:.6}; \
         pixel spacing belongs beside the pose, not inside it, and a mirrored system is never a pose"
    )]
    NotRigid {
        /// Which pose.
        what: String,
        /// Largest entry of `R^T R - 1`.
        off: f64,
        /// Determinant of the 3x3 part.
        determinant: f64,
    },
    /// A quaternion that is not of unit length.
    #[error("{what}: the quaternion's length is {length}, not 1 (order x, y, z, w)")]
    NotUnit {
        /// Which pose.
        what: String,
        /// The length found.
        length: f64,
    },
    /// A vector too short to point anywhere.
    #[error("a vector of length {length} in {what} has no direction")]
    NoDirection {
        /// The system it is written in.
        what: String,
        /// Its length.
        length: f64,
    },
    /// A pose between other systems than asked for.
    #[error("expected {expected}, found {found}: give the pose of {expected}, or invert it and rename it")]
    WrongSystems {
        /// The pair that was asked for, as `A_T_B`.
        expected: String,
        /// The pair that came.
        found: String,
    },
}

/// A track that cannot be asked or extended.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TrackError {
    /// No sample at all.
    #[error("the track is empty: no pose was recorded")]
    Empty,
    /// A stamp outside the samples: nothing is extrapolated.
    #[error("no pose at {at_s:.4} s: the track runs from {first_s:.4} s to {last_s:.4} s, {by_s:.4} s away")]
    Outside {
        /// The stamp asked for (s).
        at_s: f64,
        /// First sample (s).
        first_s: f64,
        /// Last sample (s).
        last_s: f64,
        /// How far outside (s).
        by_s: f64,
    },
    /// Neighbours too far apart to interpolate between.
    #[error("no pose at {at_s:.4} s: a gap from {from_s:.4} s to {until_s:.4} s, wider than {widest_s:.4} s")]
    Gap {
        /// The stamp asked for (s).
        at_s: f64,
        /// The sample before (s).
        from_s: f64,
        /// The sample after (s).
        until_s: f64,
        /// The widest gap allowed (s).
        widest_s: f64,
    },
    /// A sample that does not come after the last one.
    #[error("a pose stamped {at_s:.6} s came after one stamped {last_s:.6} s: stamps must increase")]
    OutOfOrder {
        /// The stamp that came (s).
        at_s: f64,
        /// The last one before it (s).
        last_s: f64,
    },
    /// A sample with a number that is not finite.
    #[error("the pose stamped {at_s:.6} s has a number that is not finite")]
    NotFinite {
        /// Its stamp (s).
        at_s: f64,
    },
}
