//! The sweeps: images while the probe moves, without which there is no telling when an image was formed.

use nalgebra::{Isometry3, Vector3};
use probepath_frames::{Pose, Probe, World};

use super::candidates::Candidates;
use super::information::{Information, covariance};
use super::{NoPlan, Sweep, SweepOptions, VisitOptions};

/// The lag's number among the unknowns.
const LAG: (usize, usize) = (6, 6);

/// Sweeps along the array, along the beam and across the image, the best of each, as many as are wanted; and the
/// information with them.
pub(super) fn choose(
    candidates: &Candidates<'_>,
    at_rest: &Information,
    options: &VisitOptions,
    reachable: &dyn Fn(&Pose<World, Probe>) -> bool,
) -> Result<(Vec<Sweep>, Information), NoPlan> {
    let wish = &options.sweep;
    let mut directions = [Vector3::x(), Vector3::z(), Vector3::y()].into_iter().cycle();
    let (mut sweeps, mut sum) = (Vec::new(), *at_rest);
    for _ in 0..wish.count * 3 {
        if sweeps.len() == wish.count {
            break;
        }
        let Some(direction) = directions.next() else { break };
        if let Some((sweep, told)) = best_along(candidates, &sum, &direction, wish, reachable) {
            sum += told;
            sweeps.push(sweep);
        }
    }
    if sweeps.len() < wish.count {
        let (found, wanted, length_mm) = (sweeps.len(), wish.count, wish.length_m * 1e3);
        return Err(NoPlan::NoSweep { found, wanted, length_mm });
    }
    Ok((sweeps, sum))
}

/// The sweep along one direction of the probe that tells the lag best.
fn best_along(
    candidates: &Candidates<'_>,
    sum: &Information,
    direction: &Vector3<f64>,
    wish: &SweepOptions,
    reachable: &dyn Fn(&Pose<World, Probe>) -> bool,
) -> Option<(Sweep, Information)> {
    let usable = |pose: &Pose<World, Probe>| {
        [-0.5, 0.0, 0.5].into_iter().all(|end| candidates.shows(&along(pose, direction, end * wish.length_m)))
    };
    let mut told: Vec<_> = candidates
        .upright()
        .filter(usable)
        .map(|pose| {
            let told = candidates.view().moving(&images(&pose, direction, wish));
            (covariance(&(sum + told))[LAG], pose, told)
        })
        .collect();
    told.sort_by(|a, b| a.0.total_cmp(&b.0));
    told.into_iter().find_map(|(_, pose, told)| {
        let [from, to] = [-0.5, 0.5].map(|end| along(&pose, direction, end * wish.length_m));
        let sweep = Sweep { from, to, speed_m_s: wish.speed_m_s, passes: wish.passes };
        (reachable(&from) && reachable(&pose) && reachable(&to)).then_some((sweep, told))
    })
}

/// The images of a sweep: poses and velocities in Probe (m/s). The ends, where the probe slows down, are left out.
fn images(
    middle: &Pose<World, Probe>,
    direction: &Vector3<f64>,
    wish: &SweepOptions,
) -> Vec<(Pose<World, Probe>, Vector3<f64>)> {
    let per_pass = (0.8 * wish.length_m / wish.speed_m_s * wish.rate_hz).floor().max(1.0) as usize;
    let place = |i: usize| (i as f64 + 0.5) / per_pass as f64 - 0.5;
    let pass = |number: usize| {
        let way = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
        (0..per_pass).map(move |i| {
            let pose = along(middle, direction, 0.8 * wish.length_m * place(i));
            (pose, direction * (way * wish.speed_m_s))
        })
    };
    (0..wish.passes).flat_map(pass).collect()
}

fn along(pose: &Pose<World, Probe>, direction: &Vector3<f64>, metres: f64) -> Pose<World, Probe> {
    // FRAMES: the probe, moved along one of its own axes, is the probe where it would be then.
    *pose
        * Pose::<Probe, Probe>::assume(Isometry3::translation(
            direction.x * metres,
            direction.y * metres,
            direction.z * metres,
        ))
}
