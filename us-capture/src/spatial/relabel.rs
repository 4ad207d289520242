//! Labels where a calibration predicts them.

use probepath_frames::{Phantom, Pose, Probe, World};

use super::Seen;
use super::look::Looked;
use super::options::Prediction;
use crate::fit::SeenWire;
use crate::label::{Labeller, Labels};
use crate::shots::{Shot, Shots};

/// An image that the track does not cover, the lag counted, may be this many gates from the track's end.
const BEYOND_TRACK: f64 = 3.0;

/// The labels of every image where `prediction` says.
pub(super) fn all(
    shots: &Shots,
    looked: &[Looked],
    labeller: &Labeller,
    prediction: &Prediction,
    gate_m: f64,
) -> Vec<Seen> {
    let one = |(shot, looked): (&Shot, &Looked)| Seen {
        number: shot.number,
        dots: looked.as_ref().map_or_else(|_| Vec::new(), Clone::clone),
        labels: match looked {
            Ok(dots) => {
                let (world_from_probe, gates) = pose(shots, shot, prediction);
                let phantom_from_image =
                    phantom_from_world(prediction) * world_from_probe * prediction.probe_from_image;
                labeller
                    .near(dots, &phantom_from_image, prediction.spacing, gate_m * gates)
                    .map_err(Into::into)
            }
            Err(reason) => Err(reason.clone()),
        },
    };
    shots.shots().iter().zip(looked).map(one).collect()
}

fn phantom_from_world(prediction: &Prediction) -> Pose<Phantom, World> {
    prediction.world_from_phantom.inverse()
}

/// Where the probe was, and how many gates off that may be. An image outside the track still shows its wires: it is
/// labelled from the nearest pose, and takes no part in the fit or in the errors.
fn pose(shots: &Shots, shot: &Shot, prediction: &Prediction) -> (Pose<World, Probe>, f64) {
    let (track, stamp) = (shots.track(), shot.stamp + prediction.lag);
    if let Ok(pose) = track.at(stamp) {
        return (pose, 1.0);
    }
    let samples = track.samples();
    let after = samples.partition_point(|(s, _)| *s < stamp);
    let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|k| samples.get(k));
    let nearest = near.min_by_key(|(s, _)| (*s - stamp).nanoseconds().abs());
    (nearest.map_or_else(identity, |(_, pose)| *pose), BEYOND_TRACK)
}

/// An empty track has no pose at all; [`Shots`] refuses to hold one.
fn identity() -> Pose<World, Probe> {
    // FRAMES: no pose is known; nothing will be found near this one.
    Pose::assume(nalgebra::Isometry3::identity())
}

/// Whether two rounds gave every image the same dots.
pub(super) fn same(before: &[Seen], after: &[Seen]) -> bool {
    let dots = |seen: &Seen| seen.labels.as_ref().ok().map(|labels| labels.dots.clone());
    before.len() == after.len() && before.iter().zip(after).all(|(a, b)| dots(a) == dots(b))
}

/// The dots that are measured with: one that an edge cuts helps to label, and its centre is not to be trusted.
pub(super) fn measured(labels: &Labels) -> Vec<SeenWire> {
    let all = labels.dots.iter().enumerate().filter_map(|(wire, dot)| dot.map(|dot| (wire, dot)));
    all.filter(|(_, dot)| !dot.cut)
        .map(|(wire, dot)| SeenWire { wire, at_px: dot.at_px, covariance_px2: dot.covariance_px2 })
        .collect()
}
