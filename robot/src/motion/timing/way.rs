//! [`Way`]: the joints over the distance along the path, and what they allow.

use nalgebra::SVector;

use super::super::spline::{Jet, Spline};
use super::PathSpeed;
use crate::joints::MAX_JOINTS;
use crate::{Joints, MotionLimits};

/// One number per joint; those that the arm has not are zero.
pub(super) type Row = SVector<f64, MAX_JOINTS>;

/// The joints along a path, a cubic spline through the postures, with every limit turned over: an entry that is
/// multiplied by a velocity, an acceleration or a jerk is a share of the limit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Way {
    joints: usize,
    spline: Spline<MAX_JOINTS>,
    /// `1 / limit` of every joint: velocity, acceleration, jerk.
    per: [Row; 3],
}

/// First, second and third derivative of every joint over the distance.
pub(super) type Slopes = [Row; 3];

impl Way {
    /// None when the postures make no spline.
    pub(super) fn through(step: f64, postures: &[Joints], limits: &MotionLimits) -> Option<Self> {
        let row = |joints: &Joints| {
            Row::from_iterator(joints.iter().chain(std::iter::repeat(0.0)).take(MAX_JOINTS))
        };
        let spline = Spline::through(step, postures.iter().map(row).collect())?;
        let per =
            [&limits.velocity, &limits.acceleration, &limits.jerk].map(|limit| row(&limit.map(f64::recip)));
        Some(Self { joints: limits.joints(), spline, per })
    }

    /// The same way with only these parts of the accelerations and jerks.
    pub(super) fn within(&self, (of_acceleration, of_jerk): (f64, f64)) -> Self {
        let [velocity, acceleration, jerk] = self.per;
        Self { per: [velocity, acceleration / of_acceleration, jerk / of_jerk], ..self.clone() }
    }

    /// How many joints.
    pub(super) const fn joints(&self) -> usize {
        self.joints
    }

    /// Its length (m).
    pub(super) fn length(&self) -> f64 {
        self.spline.end()
    }

    /// Distance between two postures (m).
    pub(super) fn step(&self) -> f64 {
        self.spline.step()
    }

    /// How many pieces between postures.
    pub(super) fn pieces(&self) -> usize {
        self.spline.knots().len() - 1
    }

    /// The slopes at `s`.
    pub(super) fn at(&self, s: f64) -> Slopes {
        slopes(self.spline.at(s))
    }

    /// The slopes in one piece, `right` of its beginning: at a posture the third derivative jumps.
    pub(super) fn on(&self, piece: usize, right: f64) -> Slopes {
        slopes(self.spline.on(piece, right))
    }

    /// `1 / limit` of every joint: velocity, acceleration, jerk.
    pub(super) const fn per(&self) -> &[Row; 3] {
        &self.per
    }

    /// The highest speed at which a place with these slopes can be passed when the speed does not change there.
    pub(super) fn steady(&self, slopes: &Slopes, wanted: f64) -> f64 {
        let most = |order: usize| slopes[order].component_mul(&self.per[order]).amax();
        wanted.min(1.0 / most(0)).min(most(1).powf(-0.5)).min(most(2).powf(-1.0 / 3.0))
    }

    /// The largest share of any limit that a motion along the path uses, there: of the joints' velocity,
    /// acceleration and jerk.
    pub(super) fn shares(&self, slopes: &Slopes, motion: &Motion) -> [f64; 3] {
        let Motion { speed: v, acceleration: a, jerk: j } = *motion;
        let [first, second, third] = slopes;
        [
            (first * v).component_mul(&self.per[0]).amax(),
            (first * a + second * (v * v)).component_mul(&self.per[1]).amax(),
            (first * j + second * (3.0 * v * a) + third * (v * v * v)).component_mul(&self.per[2]).amax(),
        ]
    }
}

/// Speed, acceleration and jerk along the path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
}

impl Motion {
    /// The largest share of the path's own acceleration and jerk.
    pub(super) fn share(&self, most: &PathSpeed) -> f64 {
        (self.acceleration.abs() / most.acceleration).max(self.jerk.abs() / most.jerk)
    }
}

const fn slopes(jet: Jet<MAX_JOINTS>) -> Slopes {
    let [_, first, second, third] = jet;
    [first, second, third]
}
