//! Where the phantom stands: a ball pointer whose tip is found by pivoting, and landmarks touched with it
//! ([P1], section II.B.2.b).
//!
//! ```
//! use probepath_frames::{Flange, Phantom, Point, Pose, World, nalgebra::{Isometry3, Vector3}};
//! use probepath_us_capture::phantom::WirePhantom;
//! use probepath_us_capture::pointer::{pivot, register};
//!
//! // Ten postures with the ball at rest in one place: the pointer's tip is 120 mm out of the flange.
//! let tip = Vector3::new(0.0, 0.0, 0.12);
//! let touch = |at: Vector3<f64>| (0..10).map(move |i| {
//!     let turn = Vector3::new(0.3 * f64::from(i).sin(), 0.3 * f64::from(i).cos(), 0.0);
//!     let turned = Isometry3::new(Vector3::zeros(), turn);
//!     // FRAMES: a made-up posture whose tip is at `at`.
//!     Pose::<World, Flange>::assume(Isometry3::from_parts((at - turned * tip).into(), turned.rotation))
//! }).collect::<Vec<_>>();
//! let pointer = pivot(&touch(Vector3::new(0.4, 0.1, 0.0))).unwrap().pointer;
//!
//! // The paper's procedure: each of the four holes touched in ten postures.
//! let phantom = WirePhantom::shipped("z-19").unwrap();
//! let touched: Vec<_> = phantom.landmarks.iter()
//!     .map(|hole| pointer.touched(Some(&hole.name), &touch(hole.at.vector())))
//!     .collect();
//! let found = register(&phantom.landmarks, &touched, &pointer.covariance_m2).unwrap();
//! assert!(found.world_from_phantom.distance(&Pose::assume(Isometry3::identity())).0 < 1e-9);
//! ```
//!
//! A [`Pointer`] is a tip in the system of what carries it, with how uncertain it is; a [`Pivot`] is where it comes
//! from; [`Touched`] is one landmark touched in one posture or many; a [`Registration`] is where the phantom stands,
//! with its residuals and its covariance. Whose `Flange` it is, an arm's or a tracked stylus's, is not asked.
//!
//! No iterative closest points, though the paper used them: they find which point belongs to which, and here that is
//! known, or found by trying every order. With the pairs known the least squares have one closed solution (Kabsch
//! 1976, by Horn's and Arun's proofs), which is where closest points would end when they start well, and which needs
//! no start.
//!
//! What it does not do: move anything, or find the phantom in images (the wires alone do that in the fit).

mod assign;
mod error;
mod pivot;
mod register;
mod rigid;

use nalgebra::Matrix3;
use probepath_frames::{Frame, Point, Pose};

pub use error::PointerError;
pub use pivot::{Pivot, pivot};
pub use register::{Registration, Residual, register};

/// A pointer with a ball at its tip, fixed to `F`.
#[derive(Clone, Debug, PartialEq)]
pub struct Pointer<F> {
    /// The ball's centre.
    pub tip: Point<F>,
    /// How uncertain it is (m², in `F`); zero for a tip that is known.
    pub covariance_m2: Matrix3<f64>,
}

/// A landmark that was touched, in one posture or in many.
#[derive(Clone, Debug, PartialEq)]
pub struct Touched<W> {
    /// Which it was; `None` when nobody wrote it down.
    pub landmark: Option<String>,
    /// Where the tip was, once for each posture.
    pub at: Vec<Point<W>>,
    /// How an error of the tip in its own system moves the mean of `at`: the mean rotation of the postures. Zero for
    /// points that come from no pointer.
    pub lever: Matrix3<f64>,
}

impl<F: Frame> Pointer<F> {
    /// A pointer whose tip is known from its drawing.
    pub fn known(tip: Point<F>) -> Self {
        Self { tip, covariance_m2: Matrix3::zeros() }
    }

    /// Where its tip is in every posture.
    pub fn touched<W: Frame>(&self, landmark: Option<&str>, world_from_flange: &[Pose<W, F>]) -> Touched<W> {
        let rotations = world_from_flange.iter().map(rotation);
        let count = world_from_flange.len().max(1) as f64;
        Touched {
            landmark: landmark.map(str::to_owned),
            at: world_from_flange.iter().map(|pose| *pose * self.tip).collect(),
            lever: rotations.sum::<Matrix3<f64>>() / count,
        }
    }
}

impl<W: Frame> Touched<W> {
    /// Points that something else measured.
    pub fn points(landmark: Option<&str>, at: Vec<Point<W>>) -> Self {
        Self { landmark: landmark.map(str::to_owned), at, lever: Matrix3::zeros() }
    }
}

fn rotation<W: Frame, F: Frame>(pose: &Pose<W, F>) -> Matrix3<f64> {
    pose.isometry().rotation.to_rotation_matrix().into_inner()
}

#[cfg(test)]
mod tests;
