//! A start for the fit: linear from the Zs' middle wires, or from planes that labels alone gave.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use probepath_frames::{Image, Phantom, Point, Pose, Probe, Stamp, Track, World};

use super::affine::{self, Pair};
use super::{FitError, FitOptions, Lag, Sighting, motion};
use crate::phantom::{WirePhantom, ZFiducial};

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

/// Where the image's plane about is, from the middle wires of the Zs: a linear problem, outliers weighed down, made
/// rigid. The lag is taken as known, or as none.
///
/// # Errors
/// When there are too few Zs with all three dots, their middles lie on one line, or the solution is far from rigid.
pub fn linear_start(
    phantom: &WirePhantom,
    sightings: &[Sighting],
    track: &Track<World, Probe>,
    options: &FitOptions,
) -> Result<Pose<Probe, Image>, FitError> {
    let pairs = pairs(phantom, sightings, track, options);
    if pairs.len() < 6 {
        let why = format!(
            "{} Zs were seen whole while the track had a pose, 6 are needed; the phantom has {} Zs. Give a start, or \
             label more images",
            pairs.len(),
            phantom.zs.len()
        );
        return Err(FitError::NoStart { why });
    }
    let count = pairs.len() as f64;
    let middle = [0, 1].map(|k| pairs.iter().map(|(at, _)| at[k]).sum::<f64>() / count);
    let scales = options.start_scale();
    let mut spacing = options.spacing;
    (spacing.x_m, spacing.y_m) = (spacing.x_m * scales.0, spacing.y_m * scales.1);
    affine::nearest_pose(&affine::solve(&pairs)?, spacing, middle)
}

fn pairs(
    phantom: &WirePhantom,
    sightings: &[Sighting],
    track: &Track<World, Probe>,
    options: &FitOptions,
) -> Vec<Pair> {
    let world_from_phantom = *options.place.pose().isometry();
    let lag_s = known_lag_s(options);
    let mut pairs = Vec::new();
    for sighting in sightings {
        let Some(world_from_probe) = motion::pose(track, sighting.stamp, lag_s) else { continue };
        let probe_from_phantom = world_from_probe.inverse() * world_from_phantom;
        let seen = phantom.zs.iter().filter_map(|z| middle_point(phantom, z, sighting));
        pairs.extend(
            seen.map(|(at, point)| {
                (at, (probe_from_phantom * nalgebra::Point3::from(point.vector())).coords)
            }),
        );
    }
    pairs
}

fn known_lag_s(options: &FitOptions) -> f64 {
    match options.lag {
        Lag::Known(lag) => lag.seconds(),
        Lag::Estimated { from, to } => 0.0_f64.clamp(from.seconds(), to.seconds()),
    }
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
    let (place, lag_s) = (*options.place.pose().isometry(), known_lag_s(options));
    let one = |(stamp, plane): &(Stamp, Pose<Phantom, Image>)| {
        let world_from_probe = motion::pose(track, *stamp, lag_s)?;
        Some(world_from_probe.inverse() * place * plane.isometry())
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
