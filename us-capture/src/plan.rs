//! The plan of a calibration: where the probe should look at the phantom from, and how sure the result will be,
//! before anything moves.
//!
//! ```
//! use nalgebra::{Isometry3, UnitQuaternion, Vector3};
//! use probepath_frames::{Point, Pose};
//! use probepath_us_capture::phantom::{Wire, WirePhantom, ZFiducial};
//! use probepath_us_capture::plan::{Bench, VisitOptions, VisitPlan};
//! use probepath_us_capture::{PixelSpacing, Setting};
//!
//! // Two levels of Zs, 20 mm apart; wires along z, the levels one under the other along y, which is down.
//! let wire = |front: f64, back: f64, level: f64| Wire {
//!     name: format!("{front} to {back} at {level}"),
//!     front: Point::new(front, level, 0.0),
//!     back: Point::new(back, level, 0.06),
//! };
//! let (level, z) = ([0.0, 0.02], |i| ZFiducial { first: i, diagonal: i + 1, last: i + 2 });
//! let wires = level.iter().flat_map(|y| {
//!     [(-0.015, -0.015), (-0.015, 0.0), (0.0, 0.0), (0.0, 0.015), (0.015, 0.015)].map(|(f, b)| wire(f, b, *y))
//! });
//! let phantom = WirePhantom {
//!     name: "two levels".into(),
//!     wires: wires.collect(),
//!     zs: [0, 2, 5, 7].map(z).into(),
//!     landmarks: Vec::new(),
//! };
//! let spacing = PixelSpacing { x_m: 40e-3 / 640.0, y_m: 60e-3 / 480.0 };
//! let bench = Bench {
//!     phantom: &phantom,
//!     // FRAMES: the example's phantom lies at the World's origin.
//!     world_from_phantom: Pose::assume(Isometry3::identity()),
//!     // FRAMES: the example's image stands under the middle of the face, Image y along Probe z.
//!     probe_from_image: Pose::assume(Isometry3::new(
//!         Vector3::new(-0.02, 0.0, 0.0),
//!         Vector3::new(std::f64::consts::FRAC_PI_2, 0.0, 0.0),
//!     )),
//!     // FRAMES: the example's probe looks down, Probe z along World y.
//!     upright: Pose::assume(Isometry3::from_parts(
//!         Vector3::zeros().into(),
//!         UnitQuaternion::from_scaled_axis(Vector3::x() * -std::f64::consts::FRAC_PI_2),
//!     )),
//!     setting: Setting {
//!         depth_m: 0.06,
//!         focus_m: 0.04,
//!         window_top_m: 0.0,
//!         window_height_m: 0.06,
//!         window_width_m: 0.04,
//!         spacing,
//!     },
//!     size: (640, 480),
//! };
//! let plan = VisitPlan::new(&bench, &VisitOptions::default(), |_| true)?;
//! assert_eq!(plan.poses.len(), 24);
//! assert!(plan.expected.point_mean_m < 0.25e-3);
//! # Ok::<(), probepath_us_capture::plan::NoPlan>(())
//! ```
//!
//! The nouns: a [`Bench`] is what is known before; a [`VisitPlan`] is the poses to calibrate from, others to check
//! from, and [`Sweep`]s for the lag; [`Expected`] is what it promises.
//!
//! What it does not do: move anything, or know what moves. Who asks says which poses can be reached.

mod candidates;
mod choose;
mod information;
mod sweeps;

use std::fmt;

use probepath_frames::{Image, Phantom, Pose, Probe, World};
use thiserror::Error;

use crate::Setting;
use crate::phantom::WirePhantom;
use candidates::Candidates;
pub use information::Expected;

/// What is known of a calibration before it begins: everything nominal.
#[derive(Clone, Copy, Debug)]
pub struct Bench<'a> {
    /// The phantom.
    pub phantom: &'a WirePhantom,
    /// Where it lies, as far as is known.
    pub world_from_phantom: Pose<World, Phantom>,
    /// Where the image's plane is on the probe, as far as is known.
    pub probe_from_image: Pose<Probe, Image>,
    /// A probe that stands upright over the phantom. Only its axes are used: the phantom's top is where it comes from.
    pub upright: Pose<World, Probe>,
    /// How the machine is set.
    pub setting: Setting,
    /// Columns and rows of an image.
    pub size: (usize, usize),
}

/// How a calibration is to be planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisitOptions {
    /// How many poses to calibrate from.
    pub poses: usize,
    /// How many other poses to check from.
    pub held_out: usize,
    /// Images at each pose.
    pub images_per_pose: usize,
    /// The farthest tilt about the array's axis, and about the image's normal (rad).
    pub tilt_rad: f64,
    /// The farthest turn about the beam (rad).
    pub turn_rad: f64,
    /// Wires that should lie in the window at each pose.
    pub least_wires: usize,
    /// Wires that have to, where a small window leaves too few poses otherwise.
    pub fewest_wires: usize,
    /// What the face keeps above the highest wire (m): more than the plates stand out.
    pub clearance_m: f64,
    /// How far above the highest wire the face may be (m): less than the water stands there.
    pub highest_m: f64,
    /// Half the size of the probe's face, housing included: along the array and across it (m).
    pub half_face_m: [f64; 2],
    /// Dots nearer to each other than this, along a row and along a column, flow into one (m): neither counts.
    pub apart_m: [f64; 2],
    /// Expected standard deviation of a dot along a row and along a column (m).
    pub dot_sd_m: [f64; 2],
    /// Expected standard deviation of the arm's place in the phantom, each coordinate (m), new at each pose. By default
    /// that of an arm with an accuracy of 0.10 mm (ISO 9283, a mean distance: 0.063 mm a coordinate) over holes that are
    /// drilled to 0.05 mm.
    pub pose_sd_m: f64,
    /// And of its orientation, about each axis (rad): by default as much over a hand's breadth of 0.3 m.
    pub pose_sd_rad: f64,
    /// How well the phantom's place is known: each coordinate (m).
    pub place_sd_m: f64,
    /// And its orientation, about each axis (rad).
    pub place_sd_rad: f64,
    /// How well the size of a pixel is known, as a part of itself; zero when it is not to be estimated.
    pub scale_sd: f64,
    /// Images while moving, for the lag.
    pub sweep: SweepOptions,
}

/// How the probe is to move for the lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepOptions {
    /// How many sweeps, each in another direction; zero for none, when the lag is known.
    pub count: usize,
    /// How fast (m/s).
    pub speed_m_s: f64,
    /// How far from end to end (m).
    pub length_m: f64,
    /// Ways there and back, counted singly.
    pub passes: usize,
    /// Images a second.
    pub rate_hz: f64,
}

impl VisitOptions {
    /// 24 poses tilted by 18 degrees and turned by 10, 12 others, two sweeps; dots good to a tenth of a millimetre, an
    /// arm to another.
    pub const DEFAULT: Self = Self {
        poses: 24,
        held_out: 12,
        images_per_pose: 3,
        tilt_rad: 18f64.to_radians(),
        turn_rad: 10f64.to_radians(),
        least_wires: 6,
        fewest_wires: 4,
        clearance_m: 5e-3,
        highest_m: 50e-3,
        half_face_m: [0.025, 0.006],
        apart_m: [4e-3, 1.2e-3],
        dot_sd_m: [0.15e-3, 0.08e-3],
        pose_sd_m: 0.08e-3,
        pose_sd_rad: 0.24e-3,
        place_sd_m: 2e-3,
        place_sd_rad: 0.02,
        scale_sd: 0.0,
        sweep: SweepOptions::DEFAULT,
    };
}

impl SweepOptions {
    /// Two sweeps of 12 mm at 20 mm/s, there and back.
    pub const DEFAULT: Self = Self { count: 2, speed_m_s: 0.020, length_m: 0.012, passes: 2, rate_hz: 25.0 };
}

impl Default for VisitOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Default for SweepOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A way that the probe goes back and forth on while images are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// One end.
    pub from: Pose<World, Probe>,
    /// The other; the orientation is the same.
    pub to: Pose<World, Probe>,
    /// How fast (m/s).
    pub speed_m_s: f64,
    /// Ways there and back, counted singly.
    pub passes: usize,
}

/// Where to look from.
#[derive(Clone, Debug)]
pub struct VisitPlan {
    /// To calibrate from, at rest, in an order that goes little way.
    pub poses: Vec<Pose<World, Probe>>,
    /// To check from, at rest: none of them is one of the others.
    pub held_out: Vec<Pose<World, Probe>>,
    /// For the lag.
    pub sweeps: Vec<Sweep>,
    /// What the poses and the sweeps promise.
    pub expected: Expected,
    /// What was thought of and not taken.
    pub refused: Refused,
}

/// How many of the poses that were thought of could not be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// All that were thought of.
    pub considered: usize,
    /// Too few wires in the window.
    pub too_few_wires: usize,
    /// The face would come too near to the wires, or too far above them.
    pub too_near: usize,
    /// Not reachable, of those that would have been chosen.
    pub unreachable: usize,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "of {} poses {} show too few wires, at {} the face comes too near to the wires or too far above them, {} cannot be reached",
            self.considered, self.too_few_wires, self.too_near, self.unreachable
        )
    }
}

/// Why there is no plan.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NoPlan {
    /// A number that makes no sense.
    #[error("{field} is {found}; it has to be {wanted}")]
    Option {
        /// The field.
        field: &'static str,
        /// What came.
        found: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// The phantom has no wires that run the same way.
    #[error(
        "phantom {phantom}: its wires have no common direction that lies across the beam; \
         turn the phantom so that the probe sees its wires' cross-sections"
    )]
    NoDirection {
        /// The phantom.
        phantom: String,
    },
    /// Not enough poses.
    #[error(
        "only {found} of {wanted} poses can be used: {refused}; \
         bring the phantom nearer to the middle of the arm's reach, or choose a window that shows more of it"
    )]
    TooFew {
        /// Poses found.
        found: usize,
        /// Poses wanted, with those to check from.
        wanted: usize,
        /// What became of the others.
        refused: Refused,
    },
    /// Nowhere can the probe sweep.
    #[error("there is no room for {wanted} sweeps of {length_mm} mm: {found} found; shorten them")]
    NoSweep {
        /// Found.
        found: usize,
        /// Wanted.
        wanted: usize,
        /// Their length (mm).
        length_mm: f64,
    },
}

/// Candidates for each pose that is wanted: fewer leave no choice.
const ENOUGH: usize = 5;

impl VisitPlan {
    /// The poses, among those that show enough wires, keep clear of them and can be reached, that make the expected
    /// standard error of a reconstructed point over the image small: chosen one by one, then exchanged while that helps
    /// (Fedorov 1972; the criterion is the mean variance of prediction, I-optimality). The same question gives the same
    /// answer.
    ///
    /// `reachable` is asked only for poses that would be taken.
    ///
    /// # Errors
    /// When a number makes no sense, or too few poses can be used; the error counts why.
    pub fn new(
        bench: &Bench<'_>,
        options: &VisitOptions,
        reachable: impl Fn(&Pose<World, Probe>) -> bool,
    ) -> Result<Self, NoPlan> {
        options.check()?;
        let mut candidates = Candidates::new(bench, options, options.least_wires)?;
        for wires in (options.fewest_wires..options.least_wires).rev() {
            if candidates.free().count() >= ENOUGH * (options.poses + options.held_out) {
                break;
            }
            candidates = Candidates::new(bench, options, wires)?;
        }
        let prior = information::prior(options);
        let goal = information::over_the_image(bench);
        let mut chosen = choose::best(&mut candidates, &prior, &goal, options.poses, &reachable)?;
        let mut checked = choose::best(&mut candidates, &prior, &goal, options.held_out, &reachable)?;
        let at_rest = choose::total(&prior, &chosen, &candidates);
        let (sweeps, moving) = sweeps::choose(&candidates, &at_rest, options, &reachable)?;
        choose::in_order(&mut chosen, &candidates);
        choose::in_order(&mut checked, &candidates);
        Ok(Self {
            poses: chosen.iter().filter_map(|i| candidates.pose(*i)).collect(),
            held_out: checked.iter().filter_map(|i| candidates.pose(*i)).collect(),
            sweeps,
            expected: Expected::of(&moving, bench, options),
            refused: candidates.refused,
        })
    }
}

/// What poses of one's own promise: the same figure for a plan that was made elsewhere, or by hand.
pub fn expected(bench: &Bench<'_>, options: &VisitOptions, poses: &[Pose<World, Probe>]) -> Expected {
    let view = information::View::new(bench, options);
    let each = poses.iter().map(|pose| view.at_rest(pose));
    Expected::of(&each.fold(information::prior(options), |sum, one| sum + one), bench, options)
}

impl VisitOptions {
    fn check(&self) -> Result<(), NoPlan> {
        let sweep = &self.sweep;
        let numbers = [
            ("poses", self.poses as f64, 4.0, 200.0, "4 to 200"),
            ("held_out", self.held_out as f64, 0.0, 200.0, "0 to 200"),
            ("images_per_pose", self.images_per_pose as f64, 1.0, 100.0, "1 to 100"),
            ("tilt_deg", self.tilt_rad.to_degrees(), 0.0, 45.0, "0 to 45 degrees"),
            ("turn_deg", self.turn_rad.to_degrees(), 0.0, 45.0, "0 to 45 degrees"),
            ("least_wires", self.least_wires as f64, 3.0, 100.0, "3 to 100"),
            ("fewest_wires", self.fewest_wires as f64, 3.0, self.least_wires as f64, "3 to least_wires"),
            ("clearance_mm", self.clearance_m * 1e3, 0.0, 100.0, "0 to 100 mm"),
            ("highest_mm", self.highest_m * 1e3, self.clearance_m * 1e3, 1000.0, "clearance_mm to 1000 mm"),
            ("apart_mm (along a row)", self.apart_m[0] * 1e3, 0.0, 50.0, "0 to 50 mm"),
            ("apart_mm (along a column)", self.apart_m[1] * 1e3, 0.0, 50.0, "0 to 50 mm"),
            ("dot_sd_mm (along a row)", self.dot_sd_m[0] * 1e3, 1e-3, 5.0, "0.001 to 5 mm"),
            ("dot_sd_mm (along a column)", self.dot_sd_m[1] * 1e3, 1e-3, 5.0, "0.001 to 5 mm"),
            ("pose_sd_mm", self.pose_sd_m * 1e3, 1e-4, 10.0, "0.0001 to 10 mm"),
            ("pose_sd_deg", self.pose_sd_rad.to_degrees(), 1e-4, 10.0, "0.0001 to 10 degrees"),
            ("place_sd_mm", self.place_sd_m * 1e3, 1e-4, 1000.0, "0.0001 to 1000 mm"),
            ("place_sd_deg", self.place_sd_rad.to_degrees(), 1e-4, 180.0, "0.0001 to 180 degrees"),
            ("scale_sd", self.scale_sd, 0.0, 0.5, "0 to 0.5"),
            ("sweep.count", sweep.count as f64, 0.0, 10.0, "0 to 10"),
            ("sweep.speed_mm_s", sweep.speed_m_s * 1e3, 1.0, 50.0, "1 to 50 mm/s"),
            ("sweep.length_mm", sweep.length_m * 1e3, 2.0, 100.0, "2 to 100 mm"),
            ("sweep.passes", sweep.passes as f64, 2.0, 100.0, "2 to 100"),
            ("sweep.rate_hz", sweep.rate_hz, 1.0, 1000.0, "1 to 1000 Hz"),
        ];
        // Written so that NaN is refused as well.
        let bad = numbers.into_iter().find(|(_, value, least, most, _)| !(value >= least && value <= most));
        bad.map_or(Ok(()), |(field, found, _, _, wanted)| Err(NoPlan::Option { field, found, wanted }))
    }
}

#[cfg(test)]
mod tests;
