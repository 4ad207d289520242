//! Where the phantom stands, from landmarks that were touched.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Matrix6x3, Point3, Vector3};
use probepath_frames::{Frame, Phantom, Point, Pose};

use super::assign::{Places, assign};
use super::rigid::{Rigid, mean, off_line_m, rigid};
use super::{PointerError, Touched};
use crate::phantom::Landmark;

/// Landmarks nearer to one line than this (m) leave the turn about it to their errors.
const LEAST_OFF_LINE_M: f64 = 2e-3;
/// Touches farther than this from the landmarks (m, root mean square) are of something else.
const MOST_RMS_M: f64 = 5e-3;
/// Below this (m) a mirror is not looked for: landmarks nearly in one plane fit both ways.
const MIRRORED_RMS_M: f64 = 1e-3;
/// A mirror that fits so many times better is no accident.
const MIRRORED_TIMES: f64 = 4.0;

/// Where the phantom stands, how well the landmarks say so, and how sure that is.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration<W: Frame> {
    /// Where it stands.
    pub world_from_phantom: Pose<W, Phantom>,
    /// Covariance of a small motion of the phantom, written in the phantom at its origin: translation along x, y, z
    /// (m), rotation about x, y, z (rad). The truth is `world_from_phantom.moved_by(motion)`.
    pub covariance: Matrix6<f64>,
    /// Root mean square distance of the touched places from their landmarks (m): the fiducial registration error.
    pub rms_m: f64,
    /// Every place, in the order in which they were given.
    pub residuals: Vec<Residual>,
}

/// One landmark that was touched.
#[derive(Clone, Debug, PartialEq)]
pub struct Residual {
    /// Its name: the one given, or the one found.
    pub landmark: String,
    /// From the landmark to the mean of its touches, in the phantom (m).
    pub off_m: Vector3<f64>,
    /// How many touches.
    pub touches: usize,
    /// How far they lie from their mean, root mean square (m); `None` for a single one.
    pub spread_m: Option<f64>,
}

/// Where the phantom stands: the rigid motion that carries the landmarks onto the means of their touches with the least
/// squares, each landmark counting once. Places without a name get the one that fits.
///
/// The variance of a place comes from what is left over, and is never taken smaller than the touches' own spread says:
/// what all touches of a hole share (how it was drilled, how the ball sits in it) shows only between the holes. The
/// pointer's own uncertainty (m², in the flange) comes on top, as far as the postures share it. What postures do not
/// share shows in the touches' spread as well, so where they turn all round the promise is up to 1.5 times too careful.
///
/// # Errors
/// When fewer than three landmarks were touched or they lie in one line, a name is no landmark's or there twice, two
/// orders of unnamed places fit, the places are a mirror image, or they do not fit.
pub fn register<W: Frame>(
    landmarks: &[Landmark],
    touched: &[Touched<W>],
    tip_covariance_m2: &Matrix3<f64>,
) -> Result<Registration<W>, PointerError> {
    check(landmarks, touched)?;
    let places: Vec<Vector3<f64>> = touched.iter().map(|t| mean(&vectors(&t.at))).collect();
    let chosen = choose(landmarks, touched, &places)?;
    let marks: Vec<Vector3<f64>> = chosen.iter().map(|landmark| landmark.at.vector()).collect();
    let fit = fit(&chosen, &marks, &places)?;
    let from_world = fit.motion.inverse();
    let all = chosen.iter().zip(touched).zip(&places);
    let residuals: Vec<Residual> = all
        .map(|((landmark, t), place)| residual(landmark, t, &(from_world * Point3::from(*place))))
        .collect();
    Ok(Registration {
        covariance: covariance(&marks, touched, &fit, &residuals, tip_covariance_m2),
        // FRAMES: the motion carries the landmarks, written in the phantom, onto places written in the world.
        world_from_phantom: Pose::assume(fit.motion),
        rms_m: fit.rms_m,
        residuals,
    })
}

impl<W: Frame> Registration<W> {
    /// Standard error of a place of the phantom (m): root mean square distance between where it is and where the
    /// registration has it (the target registration error of Fitzpatrick 1998).
    pub fn standard_error_m(&self, at: Point<Phantom>) -> f64 {
        self.covariance_at(at).trace().max(0.0).sqrt()
    }

    /// Covariance of a place of the phantom, written in the phantom (m²).
    pub fn covariance_at(&self, at: Point<Phantom>) -> Matrix3<f64> {
        let moves = moves(&at.vector());
        moves * self.covariance * moves.transpose()
    }

    /// Standard deviations for a prior on the phantom's place: along an axis at this place (m), about an axis (rad),
    /// each the root mean square over the three axes.
    pub fn standard_deviations(&self, at: Point<Phantom>) -> (f64, f64) {
        let turns = self.covariance.fixed_view::<3, 3>(3, 3).trace();
        (self.standard_error_m(at) / 3f64.sqrt(), (turns / 3.0).max(0.0).sqrt())
    }

    /// The landmark that is farthest off, and how far (m).
    pub fn worst(&self) -> Option<(&str, f64)> {
        let off = self.residuals.iter().map(|r| (r.landmark.as_str(), r.off_m.norm()));
        off.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

fn residual<W: Frame>(landmark: &Landmark, touched: &Touched<W>, in_phantom: &Point3<f64>) -> Residual {
    Residual {
        landmark: landmark.name.clone(),
        off_m: in_phantom.coords - landmark.at.vector(),
        touches: touched.at.len(),
        spread_m: spread_m(&touched.at),
    }
}

fn check<W: Frame>(landmarks: &[Landmark], touched: &[Touched<W>]) -> Result<(), PointerError> {
    if touched.len() < 3 {
        return Err(PointerError::TooFewLandmarks { found: touched.len() });
    }
    if touched.len() > landmarks.len() {
        return Err(PointerError::TooManyPlaces { found: touched.len(), there: landmarks.len() });
    }
    for (index, place) in touched.iter().enumerate() {
        if place.at.is_empty() {
            return Err(PointerError::NoTouch { place: index + 1 });
        }
        if place.at.iter().any(|at| at.vector().iter().any(|x| !x.is_finite())) {
            return Err(PointerError::NotFinite { what: format!("a touch of place {}", index + 1) });
        }
    }
    match landmarks.iter().find(|l| l.at.vector().iter().any(|x| !x.is_finite())) {
        Some(landmark) => Err(PointerError::NotFinite { what: format!("landmark {:?}", landmark.name) }),
        None => Ok(()),
    }
}

/// The landmark of every place.
fn choose<'a, W: Frame>(
    landmarks: &'a [Landmark],
    touched: &[Touched<W>],
    places: &[Vector3<f64>],
) -> Result<Vec<&'a Landmark>, PointerError> {
    let mut known = Vec::new();
    for place in touched {
        let index = place.landmark.as_deref().map(|name| index(landmarks, name)).transpose()?;
        if let Some(name) = place.landmark.as_ref().filter(|_| known.contains(&index)) {
            return Err(PointerError::TouchedTwice { name: name.clone() });
        }
        known.push(index);
    }
    let names: Vec<&str> = landmarks.iter().map(|l| l.name.as_str()).collect();
    let at: Vec<Vector3<f64>> = landmarks.iter().map(|l| l.at.vector()).collect();
    let order = assign(&Places { landmarks: &at, names: &names, places, known: &known })?;
    Ok(order.iter().filter_map(|index| landmarks.get(*index)).collect())
}

fn index(landmarks: &[Landmark], name: &str) -> Result<usize, PointerError> {
    landmarks.iter().position(|l| l.name == name).ok_or_else(|| PointerError::NoSuchLandmark {
        name: name.into(),
        there: landmarks.iter().map(|l| format!("{:?}", l.name)).collect(),
    })
}

fn fit(chosen: &[&Landmark], marks: &[Vector3<f64>], places: &[Vector3<f64>]) -> Result<Rigid, PointerError> {
    let off_mm = off_line_m(marks).min(off_line_m(places)) * 1e3;
    let fit = rigid(marks, places).filter(|_| off_mm >= LEAST_OFF_LINE_M * 1e3);
    let fit = fit.ok_or(PointerError::InOneLine { off_mm, least_mm: LEAST_OFF_LINE_M * 1e3 })?;
    if fit.rms_m > MIRRORED_RMS_M && fit.mirrored_rms_m * MIRRORED_TIMES < fit.rms_m {
        let (mirrored_mm, proper_mm) = (fit.mirrored_rms_m * 1e3, fit.rms_m * 1e3);
        return Err(PointerError::Mirrored { mirrored_mm, proper_mm });
    }
    if fit.rms_m > MOST_RMS_M {
        return Err(does_not_fit(&fit, chosen, marks, places));
    }
    Ok(fit)
}

fn does_not_fit(
    fit: &Rigid,
    chosen: &[&Landmark],
    marks: &[Vector3<f64>],
    places: &[Vector3<f64>],
) -> PointerError {
    let off = marks
        .iter()
        .zip(places)
        .map(|(mark, place)| (fit.motion * Point3::from(*mark) - Point3::from(*place)).norm());
    let worst = off.zip(chosen).max_by(|a, b| a.0.total_cmp(&b.0));
    let (worst_m, worst) = worst.map_or((0.0, String::new()), |(off, landmark)| (off, landmark.name.clone()));
    PointerError::DoesNotFit {
        found_mm: fit.rms_m * 1e3,
        most_mm: MOST_RMS_M * 1e3,
        worst,
        worst_mm: worst_m * 1e3,
    }
}

/// Of the small motion of the phantom: `place - landmark = motion + noise`, and the tip's own error.
fn covariance<W: Frame>(
    marks: &[Vector3<f64>],
    touched: &[Touched<W>],
    fit: &Rigid,
    residuals: &[Residual],
    tip_covariance_m2: &Matrix3<f64>,
) -> Matrix6<f64> {
    let normal = marks.iter().map(|mark| moves(mark).transpose() * moves(mark)).sum::<Matrix6<f64>>();
    let Some(inverse) = normal.try_inverse() else {
        // Landmarks in one line were refused; an infinite covariance is what they would have.
        return Matrix6::identity() * f64::INFINITY;
    };
    let to_phantom = fit.motion.rotation.inverse().to_rotation_matrix().into_inner();
    let by_tip = marks.iter().zip(touched).map(|(mark, t)| moves(mark).transpose() * to_phantom * t.lever);
    let by_tip = inverse * by_tip.sum::<Matrix6x3<f64>>();
    inverse * variance_m2(residuals) + by_tip * tip_covariance_m2 * by_tip.transpose()
}

/// Variance of a place along an axis: what is left over between the landmarks, at least what the touches' spread makes
/// of their mean.
fn variance_m2(residuals: &[Residual]) -> f64 {
    let between = residuals.iter().map(|r| r.off_m.norm_squared()).sum::<f64>();
    let between = between / (3 * residuals.len()).saturating_sub(6).max(1) as f64;
    let (mut squares, mut freedom, mut inverse_counts) = (0.0, 0, 0.0);
    for residual in residuals {
        inverse_counts += 1.0 / residual.touches as f64;
        if let Some(spread_m) = residual.spread_m {
            squares += spread_m * spread_m * residual.touches as f64;
            freedom += 3 * (residual.touches - 1);
        }
    }
    let one_touch = if freedom > 0 { squares / f64::from(freedom as u32) } else { 0.0 };
    between.max(one_touch * inverse_counts / residuals.len() as f64)
}

/// How a place of the phantom moves with the phantom's small motion (translation, rotation).
fn moves(at: &Vector3<f64>) -> Matrix3x6<f64> {
    let mut moves = Matrix3x6::zeros();
    moves.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    moves.fixed_view_mut::<3, 3>(0, 3).copy_from(&-at.cross_matrix());
    moves
}

fn spread_m<W: Frame>(at: &[Point<W>]) -> Option<f64> {
    let at = vectors(at);
    let mean = mean(&at);
    let squares = at.iter().map(|p| (p - mean).norm_squared()).sum::<f64>();
    (at.len() > 1).then(|| (squares / at.len() as f64).sqrt())
}

fn vectors<W: Frame>(points: &[Point<W>]) -> Vec<Vector3<f64>> {
    points.iter().map(Point::vector).collect()
}
