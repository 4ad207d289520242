//! The tip of a pointer from many postures with its ball in one place.

use nalgebra::{Matrix3, Vector3};
use probepath_frames::{Frame, Point, Pose};

use super::{Pointer, PointerError, rotation};

/// Six unknowns, three equations a posture, and one posture that may be left out.
const LEAST_POSTURES: usize = 4;
/// A tip 100 mm out that swings less is found no better than 11 times worse than the ball rests.
const LEAST_SWING_DEG: f64 = 5.0;
/// A ball that rests in a hole does not leave it by this.
const MOST_RMS_M: f64 = 3e-3;
/// A posture so many standard deviations from the others slipped: one in 8000 does by chance.
const SLIPPED_SIGMAS: f64 = 4.5;
/// Below this a posture is never called slipped: exact numbers have no spread to be measured by.
const NEVER_SLIPPED_M: f64 = 1e-5;
/// Median distance of a three-dimensional normal variable of standard deviation 1 from its mean.
const MEDIAN_OF_NORM: f64 = 1.5382;

/// A pointer whose tip was found, and what it was found from.
#[derive(Clone, Debug, PartialEq)]
pub struct Pivot<W, F> {
    /// The pointer.
    pub pointer: Pointer<F>,
    /// Where the ball rested.
    pub place: Point<W>,
    /// Root mean square distance of the tip from there, over the postures that were used (m).
    pub rms_m: f64,
    /// How many postures were used.
    pub used: usize,
    /// Postures that were left out because the tip was far from where the others have it; indices into what was given.
    pub left_out: Vec<usize>,
    /// How far the direction that the postures leave most uncertain swings about its mean, root mean square (rad).
    pub swing_rad: f64,
}

/// One solution over some postures.
struct Solved {
    tip: Vector3<f64>,
    place: Vector3<f64>,
    /// Inverse of the normal matrix of the tip; times the variance of the ball's rest, its covariance.
    inverse: Matrix3<f64>,
    swing_rad: f64,
}

/// The pointer's tip, from postures (`world_from_flange`) in which its ball rested in one place.
///
/// `R_i tip + p_i = place` for every posture, least squares; postures in which the ball had slipped are left out, at
/// most a fifth of them. The covariance takes the ball's rest to be equally uncertain in every direction, and its
/// variance from what is left over.
///
/// # Errors
/// When there are fewer than four postures, a number is not finite, they turn too little (with the direction that does
/// not show, and by how much), or the ball did not stay.
pub fn pivot<W: Frame, F: Frame>(world_from_flange: &[Pose<W, F>]) -> Result<Pivot<W, F>, PointerError> {
    let of = world_from_flange.len();
    if of < LEAST_POSTURES {
        return Err(PointerError::TooFewPostures { found: of, least: LEAST_POSTURES });
    }
    if let Some(index) = world_from_flange.iter().position(|pose| !pose.is_finite()) {
        return Err(PointerError::NotFinite { what: format!("posture {}", index + 1) });
    }
    let mut used: Vec<usize> = (0..of).collect();
    let mut left_out = Vec::new();
    loop {
        let poses: Vec<Pose<W, F>> = used.iter().filter_map(|i| world_from_flange.get(*i)).copied().collect();
        let solved = solve(&poses)?;
        let off_m = distances(&poses, &solved);
        let room = used.len() > LEAST_POSTURES && (left_out.len() + 1) * 5 <= of;
        match slipped(&off_m).filter(|_| room) {
            Some(worst) => left_out.push(used.remove(worst)),
            None => return finish(&solved, &off_m, &used, left_out),
        }
    }
}

fn solve<W: Frame, F: Frame>(poses: &[Pose<W, F>]) -> Result<Solved, PointerError> {
    let count = poses.len() as f64;
    let mean_rotation = poses.iter().map(rotation).sum::<Matrix3<f64>>() / count;
    let mean_at = poses.iter().map(at).sum::<Vector3<f64>>() / count;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for pose in poses {
        // The place is free, so it takes the mean of everything with it.
        let turn = rotation(pose) - mean_rotation;
        normal += turn.transpose() * turn;
        right -= turn.transpose() * (at(pose) - mean_at);
    }
    let eigen = normal.symmetric_eigen();
    let weak = eigen.eigenvalues.imin();
    // The mean of a direction that swings by s is shorter by 1 - cos s: what is missing is its sine.
    let swing_rad = (eigen.eigenvalues[weak].max(0.0) / count).sqrt().min(1.0).asin();
    let weakest = eigen.eigenvectors.column(weak).into_owned();
    let inverse = normal.try_inverse().filter(|_| swing_rad.to_degrees() >= LEAST_SWING_DEG);
    let inverse = inverse.ok_or_else(|| too_little(poses, weakest, swing_rad))?;
    let tip = inverse * right;
    Ok(Solved { tip, place: mean_at + mean_rotation * tip, inverse, swing_rad })
}

fn too_little<W: Frame, F: Frame>(
    poses: &[Pose<W, F>],
    weakest: Vector3<f64>,
    swing_rad: f64,
) -> PointerError {
    let pairs = poses.iter().enumerate().flat_map(|(i, a)| poses.iter().skip(i + 1).map(move |b| (a, b)));
    let widest_rad = pairs.map(|(a, b)| a.distance(b).1).fold(0.0, f64::max);
    PointerError::TurnedTooLittle {
        direction: [weakest.x, weakest.y, weakest.z],
        swing_deg: swing_rad.to_degrees(),
        least_deg: LEAST_SWING_DEG,
        widest_deg: widest_rad.to_degrees(),
    }
}

fn distances<W: Frame, F: Frame>(poses: &[Pose<W, F>], solved: &Solved) -> Vec<f64> {
    poses.iter().map(|pose| (rotation(pose) * solved.tip + at(pose) - solved.place).norm()).collect()
}

/// The posture that is farthest from the others, when it is far.
fn slipped(off_m: &[f64]) -> Option<usize> {
    let mut sorted = off_m.to_vec();
    sorted.sort_by(f64::total_cmp);
    let sigma = sorted.get(sorted.len() / 2)? / MEDIAN_OF_NORM;
    let limit = (SLIPPED_SIGMAS * sigma).max(NEVER_SLIPPED_M);
    worst(off_m).filter(|(_, off)| *off > limit).map(|(index, _)| index)
}

fn worst(off_m: &[f64]) -> Option<(usize, f64)> {
    off_m.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
}

fn finish<W: Frame, F: Frame>(
    solved: &Solved,
    off_m: &[f64],
    used: &[usize],
    mut left_out: Vec<usize>,
) -> Result<Pivot<W, F>, PointerError> {
    let count = off_m.len();
    let squares = off_m.iter().map(|off| off * off).sum::<f64>();
    let rms_m = (squares / count as f64).sqrt();
    if rms_m > MOST_RMS_M {
        let worst = worst(off_m).and_then(|(index, _)| used.get(index)).map_or(0, |index| index + 1);
        let (of, left_out) = (count + left_out.len(), left_out.len());
        let (found_mm, most_mm) = (rms_m * 1e3, MOST_RMS_M * 1e3);
        return Err(PointerError::Slipped { found_mm, most_mm, worst, left_out, of });
    }
    left_out.sort_unstable();
    let variance_m2 = squares / (3 * count - 6) as f64;
    Ok(Pivot {
        pointer: Pointer { tip: Point::from_vector(solved.tip), covariance_m2: solved.inverse * variance_m2 },
        place: Point::from_vector(solved.place),
        rms_m,
        used: count,
        left_out,
        swing_rad: solved.swing_rad,
    })
}

fn at<W: Frame, F: Frame>(pose: &Pose<W, F>) -> Vector3<f64> {
    pose.isometry().translation.vector
}
