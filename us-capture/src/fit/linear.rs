//! A start for the fit: linear from the Zs' middle wires, or from planes that labels alone gave.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Phantom, Point, Pose, Probe, Span, Stamp, Track, World};

use super::affine::{self, Pair};
use super::{FitError, FitOptions, Sighting, lag_scan, motion};
use crate::PixelMap;
use crate::phantom::{WirePhantom, ZFiducial};

/// Pairs of a pixel and a point that a linear solution needs.
const LEAST_PAIRS: usize = 6;

/// The middle wire's point in the phantom by the ratio of the image: from the crossing with the first side to the
/// crossing with the last, a part `h = |first - middle| / |first - last|` of the way ([P1] eq. 2-4). `None` when the
/// wires do not cross, or a dot is missing.
pub(crate) fn middle_point(
    phantom: &WirePhantom,
    z: &ZFiducial,
    sighting: &Sighting,
) -> Option<([f64; 2], Point<Phantom>)> {
    let dot = |wire: usize| sighting.dots.iter().find(|d| d.wire == wire).map(|d| d.at_px);
    let (first, middle, last) = (dot(z.first)?, dot(z.diagonal)?, dot(z.last)?);
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let ratio = apart(first, middle) / apart(first, last);
    let from = crossing(phantom, z.diagonal, z.first)?;
    let to = crossing(phantom, z.diagonal, z.last)?;
    let point = from + (to - from) * ratio;
    point.iter().all(|x| x.is_finite()).then_some((middle, Point::from_vector(point)))
}

/// The point of wire `on`, as a line, nearest to wire `other`, as a line. `None` when they are parallel.
fn crossing(phantom: &WirePhantom, on: usize, other: usize) -> Option<Vector3<f64>> {
    let (on, other) = (phantom.wires.get(on)?, phantom.wires.get(other)?);
    let (along, across) = (on.run().try_normalize(1e-9)?, other.run().try_normalize(1e-9)?);
    let normal = along.cross(&across);
    let sine = normal.norm_squared();
    if sine < 1e-9 {
        return None;
    }
    let apart = other.front.vector() - on.front.vector();
    let reach = apart.cross(&across).dot(&normal) / sine;
    Some(on.front.vector() + along * reach)
}

/// Where the image's plane about is, and the lag, from the middle wires of the Zs: at every lag of a grid a linear
/// problem, outliers weighed down; the one that leaves least, made rigid.
///
/// # Errors
/// When there are too few Zs with all three dots, their middles lie on one line, or the solution is far from rigid.
pub fn linear_start(
    phantom: &WirePhantom,
    sightings: &[Sighting],
    track: &Track<World, Probe>,
    options: &FitOptions,
) -> Result<(Pose<Probe, Image>, Span), FitError> {
    let seen: Vec<Seen> = sightings.iter().filter_map(|s| Seen::of(phantom, s)).collect();
    let mut best: Option<Linear> = None;
    let mut trouble = None;
    for lag_s in lag_scan::grid(options.lag) {
        match Linear::at(&seen, track, options, lag_s) {
            Ok(found) if best.as_ref().is_none_or(|best| found.left_m < best.left_m) => best = Some(found),
            Ok(_) => {}
            Err(error) => trouble = Some(error),
        }
    }
    let best = best.ok_or_else(|| trouble.unwrap_or_else(|| too_few(0)))?;
    Ok((
        affine::nearest_pose(&best.map, options.start_spacing(), best.middle_px)?,
        Span::from_seconds(best.lag_s),
    ))
}

/// The Zs that an image saw whole: a middle dot, and its place in the phantom.
struct Seen {
    stamp: Stamp,
    middles: Vec<([f64; 2], Point<Phantom>)>,
}

impl Seen {
    fn of(phantom: &WirePhantom, sighting: &Sighting) -> Option<Self> {
        let middles: Vec<_> = phantom.zs.iter().filter_map(|z| middle_point(phantom, z, sighting)).collect();
        (!middles.is_empty()).then_some(Self { stamp: sighting.stamp, middles })
    }
}

/// The linear solution at one lag.
struct Linear {
    map: PixelMap<Probe>,
    left_m: f64,
    lag_s: f64,
    middle_px: [f64; 2],
}

impl Linear {
    fn at(
        seen: &[Seen],
        track: &Track<World, Probe>,
        options: &FitOptions,
        lag_s: f64,
    ) -> Result<Self, FitError> {
        let place = *options.place.pose().isometry();
        let (mut pairs, mut covered): (Vec<Pair>, _) = (Vec::new(), 0);
        for image in seen {
            let Some(world_from_probe) = motion::pose(track, image.stamp, lag_s) else { continue };
            covered += 1;
            let probe_from_phantom = world_from_probe.isometry().inverse() * place;
            let in_probe =
                |point: &Point<Phantom>| (probe_from_phantom * Point3::from(point.vector())).coords;
            pairs.extend(image.middles.iter().map(|(at, point)| (*at, in_probe(point))));
        }
        // A lag that leaves most images without a pose would win with what is left.
        if 2 * covered < seen.len() {
            return Err(FitError::OutsideTrack { inside: covered, images: seen.len(), lag_s });
        }
        if pairs.len() < LEAST_PAIRS {
            return Err(too_few(pairs.len()));
        }
        let count = pairs.len() as f64;
        let middle_px = [0, 1].map(|k| pairs.iter().map(|(at, _)| at[k]).sum::<f64>() / count);
        let (map, left_m) = affine::solve(&pairs)?;
        Ok(Self { map, left_m, lag_s, middle_px })
    }
}

fn too_few(seen: usize) -> FitError {
    let why = format!(
        "{seen} Zs were seen whole while the track had a pose, {LEAST_PAIRS} are needed; give a start where the \
         phantom has no Zs, or label more images"
    );
    FitError::NoStart { why }
}

/// Where the image's plane about is, from planes that each image's labels gave alone: the one in the middle, outliers
/// left out.
///
/// # Errors
/// When the track has a pose for fewer than three of them.
pub fn start_from_planes(
    planes: &[(Stamp, Pose<Phantom, Image>)],
    track: &Track<World, Probe>,
    options: &FitOptions,
) -> Result<Pose<Probe, Image>, FitError> {
    let (place, lag_s) = (*options.place.pose().isometry(), options.lag.start().seconds());
    let one = |(stamp, plane): &(Stamp, Pose<Phantom, Image>)| {
        let world_from_probe = motion::pose(track, *stamp, lag_s)?;
        Some(world_from_probe.isometry().inverse() * place * plane.isometry())
    };
    let found: Vec<Isometry3<f64>> = planes.iter().filter_map(one).collect();
    if found.len() < 3 {
        return Err(FitError::OutsideTrack { inside: found.len(), images: planes.len(), lag_s });
    }
    // FRAMES: each is the Image's pose in the Probe, by its own plane.
    Ok(Pose::assume(middle_of(&found)))
}

/// The pose with the medians of all coordinates, turned from one of them.
fn middle_of(poses: &[Isometry3<f64>]) -> Isometry3<f64> {
    let median = |mut numbers: Vec<f64>| {
        let middle = numbers.len() / 2;
        *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let medians = |of: &dyn Fn(&Isometry3<f64>) -> Vector3<f64>| {
        Vector3::from_fn(|k, _| median(poses.iter().map(|p| of(p)[k]).collect()))
    };
    let shift = medians(&|pose| pose.translation.vector);
    let mut turn = poses.first().map_or_else(UnitQuaternion::identity, |pose| pose.rotation);
    for _ in 0..10 {
        let off = medians(&|pose| (turn.inverse() * pose.rotation).scaled_axis());
        turn *= UnitQuaternion::from_scaled_axis(off);
    }
    Isometry3::from_parts(Translation3::from(shift), turn)
}
