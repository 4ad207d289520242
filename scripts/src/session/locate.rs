//! Where the phantom of a calibration stands.

use nalgebra::{Matrix3, Matrix3x6, Vector3};
use probepath_frames::{Flange, Phantom, Pose, World};
use probepath_us_capture::phantom::WirePhantom;
use probepath_us_capture::pointer::{PointerError, Registration, pivot, register};

use super::{Session, SessionError};

/// How well a tape measure finds a phantom on a table: each coordinate (m), and about each axis (rad).
const MEASURED_SD_M: f64 = 3e-3;
const MEASURED_SD_RAD: f64 = 0.03;

/// What no landmark is touched better than: an arm's accuracy, a hole's own place (m, rad).
const TOUCHED_SD_M: f64 = 0.3e-3;
const TOUCHED_SD_RAD: f64 = 3e-3;

/// A phantom of wires whose place is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The phantom, as it was drawn.
    pub phantom: WirePhantom,
    /// Where it stands.
    pub world_from_phantom: Pose<World, Phantom>,
    /// How well that is known: each coordinate (m).
    pub sd_m: f64,
    /// And its orientation, about each axis (rad).
    pub sd_rad: f64,
    /// How warm the water around it is (degrees Celsius).
    pub water_celsius: f64,
}

impl Session {
    /// The cell's wire phantom where its file says that it stands.
    ///
    /// # Errors
    /// When the cell has none.
    pub fn phantom_as_measured(&mut self) -> Result<Located, SessionError> {
        let bench = self.cell.bench.clone().ok_or(SessionError::NoPhantom)?;
        self.say(&format!(
            "Phantom {}: {} wires, in water of {:.1} degrees Celsius, where the cell's file says that it stands.",
            bench.phantom.name,
            bench.phantom.wires.len(),
            bench.water_celsius
        ));
        Ok(Located {
            phantom: bench.phantom,
            world_from_phantom: bench.world_from_phantom,
            sd_m: MEASURED_SD_M,
            sd_rad: MEASURED_SD_RAD,
            water_celsius: bench.water_celsius,
        })
    }

    /// The cell's wire phantom where its landmarks are touched with the ball pointer, each in so many postures of the
    /// arm ([P1] II.B.2.b: ten). The same touches find the pointer's tip.
    ///
    /// # Errors
    /// When the cell has no phantom, its landmarks cannot be touched, or the touches do not fit them.
    pub fn phantom_by_touch(&mut self, postures: usize) -> Result<Located, SessionError> {
        let measured = self.phantom_as_measured()?;
        self.say("Guide the ball pointer into every landmark.");
        // The simulated hand stands in for the operator's.
        let simulated = self.cell.simulated.as_ref().ok_or(SessionError::Order(
            "on its wire the landmarks are not touched: the pointer would hang in the probe's place, and payload, guard and \
             kinematics are the probe's there; measure where the phantom stands and use its place as the cell's file has it",
        ))?;
        let touches = simulated.touches(postures)?;
        let of = |landmark: usize| -> Vec<Pose<World, Flange>> {
            touches.iter().filter(|t| t.landmark == landmark).map(|t| t.world_from_flange).collect()
        };
        // The landmark whose postures tell the tip best.
        let landmarks = &measured.phantom.landmarks;
        let pivots: Result<Vec<_>, PointerError> = (0..landmarks.len()).map(|i| pivot(&of(i))).collect();
        let sure = pivots?.into_iter().min_by(|a, b| a.swing_rad.total_cmp(&b.swing_rad));
        let pointer = sure.ok_or(SessionError::NoPhantom)?.pointer;
        let touched: Vec<_> = landmarks
            .iter()
            .enumerate()
            .map(|(i, landmark)| pointer.touched(Some(&landmark.name), &of(i)))
            .collect();
        let found = register(landmarks, &touched, &pointer.covariance_m2)?;
        self.say(&format!(
            "{} landmarks touched in {postures} postures each: they fit to {:.2} mm RMS.",
            landmarks.len(),
            found.rms_m * 1e3
        ));
        let (sd_m, sd_rad) = deviations(&found, &measured.phantom);
        Ok(Located { world_from_phantom: found.world_from_phantom, sd_m, sd_rad, ..measured })
    }
}

/// How well the middle of the wires is known in its worst direction (m), and the orientation about the worst axis (rad).
fn deviations(found: &Registration<World>, phantom: &WirePhantom) -> (f64, f64) {
    let ends = phantom.wires.iter().flat_map(|wire| [wire.front.vector(), wire.back.vector()]);
    let middle = ends.sum::<Vector3<f64>>() / (2 * phantom.wires.len()).max(1) as f64;
    let mut by = Matrix3x6::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    by.fixed_view_mut::<3, 3>(0, 3).copy_from(&-middle.cross_matrix());
    let place: Matrix3<f64> = by * found.covariance * by.transpose();
    let turn: Matrix3<f64> = found.covariance.fixed_view::<3, 3>(3, 3).into_owned();
    let worst = |m: &Matrix3<f64>| m.symmetric_eigenvalues().max().max(0.0).sqrt();
    (worst(&place).max(TOUCHED_SD_M), worst(&turn).max(TOUCHED_SD_RAD))
}
